# SuiteSparse 5 ships no CMake package: finds the parts this project uses.
#
#   SuiteSparse::amd   fill-reducing ordering
#   SuiteSparse::ldl   sparse L D L' of a quasi-definite matrix: symbolic once, numeric without allocation
#
# Debian: libsuitesparse-dev.
find_path(SuiteSparse_INCLUDE_DIR ldl.h PATH_SUFFIXES suitesparse)
foreach(part amd ldl suitesparseconfig)
  find_library(SuiteSparse_${part}_LIBRARY ${part})
  list(APPEND suitesparse_libraries SuiteSparse_${part}_LIBRARY)
endforeach()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(SuiteSparse
  REQUIRED_VARS SuiteSparse_INCLUDE_DIR ${suitesparse_libraries}
  REASON_FAILURE_MESSAGE "install it with: apt-get install libsuitesparse-dev")

if(SuiteSparse_FOUND)
  foreach(part suitesparseconfig amd ldl)
    if(NOT TARGET SuiteSparse::${part})
      add_library(SuiteSparse::${part} UNKNOWN IMPORTED)
      set_target_properties(SuiteSparse::${part} PROPERTIES
        IMPORTED_LOCATION ${SuiteSparse_${part}_LIBRARY}
        INTERFACE_INCLUDE_DIRECTORIES ${SuiteSparse_INCLUDE_DIR})
    endif()
  endforeach()
  set_property(TARGET SuiteSparse::amd PROPERTY INTERFACE_LINK_LIBRARIES SuiteSparse::suitesparseconfig)
  set_property(TARGET SuiteSparse::ldl PROPERTY INTERFACE_LINK_LIBRARIES SuiteSparse::amd)
endif()
mark_as_advanced(SuiteSparse_INCLUDE_DIR ${suitesparse_libraries})
