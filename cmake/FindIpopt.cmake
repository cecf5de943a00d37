# Ipopt 3.11 ships a .pc file and no CMake package.
#
#   Ipopt::ipopt   the library; its headers lie in a folder of their own
#
# Debian: coinor-libipopt-dev.
find_path(Ipopt_INCLUDE_DIR IpTNLP.hpp PATH_SUFFIXES coin coin-or)
find_library(Ipopt_LIBRARY ipopt)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Ipopt
  REQUIRED_VARS Ipopt_INCLUDE_DIR Ipopt_LIBRARY
  REASON_FAILURE_MESSAGE "install it with: apt-get install coinor-libipopt-dev")

if(Ipopt_FOUND AND NOT TARGET Ipopt::ipopt)
  add_library(Ipopt::ipopt UNKNOWN IMPORTED)
  set_target_properties(Ipopt::ipopt PROPERTIES
    IMPORTED_LOCATION ${Ipopt_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${Ipopt_INCLUDE_DIR})
endif()
mark_as_advanced(Ipopt_INCLUDE_DIR Ipopt_LIBRARY)
