# HPIPM and BLASFEO, which it computes with, are in no distribution.
#
#   HPIPM::hpipm   both libraries; HPIPM_BLASFEO_TARGET is the processor that BLASFEO was built for
#
# HPIPM_ROOT is where they were installed: by `make install_static PREFIX=...`, which gives each a folder, or by CMake.
# Nowhere else is looked, and nothing is kept for the next time: another path is another installation.
set(there PATHS ${HPIPM_ROOT} NO_DEFAULT_PATH NO_CACHE)
find_path(HPIPM_INCLUDE_DIR hpipm_d_ocp_qp_ipm.h ${there} PATH_SUFFIXES hpipm/include include)
find_path(HPIPM_BLASFEO_INCLUDE_DIR blasfeo_target.h ${there} PATH_SUFFIXES blasfeo/include include)
find_library(HPIPM_LIBRARY hpipm ${there} PATH_SUFFIXES hpipm/lib lib)
find_library(HPIPM_BLASFEO_LIBRARY blasfeo ${there} PATH_SUFFIXES blasfeo/lib lib)
if(HPIPM_BLASFEO_INCLUDE_DIR)
  file(STRINGS ${HPIPM_BLASFEO_INCLUDE_DIR}/blasfeo_target.h HPIPM_BLASFEO_TARGET REGEX "^#define TARGET_X|^#define TARGET_[AG]" LIMIT_COUNT 1)
  string(REGEX REPLACE "^#define TARGET_([A-Z0-9_]+).*" "\\1" HPIPM_BLASFEO_TARGET "${HPIPM_BLASFEO_TARGET}")
endif()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(HPIPM
  REQUIRED_VARS HPIPM_INCLUDE_DIR HPIPM_BLASFEO_INCLUDE_DIR HPIPM_LIBRARY HPIPM_BLASFEO_LIBRARY
  REASON_FAILURE_MESSAGE "no headers or no libraries of both HPIPM and BLASFEO in ${HPIPM_ROOT}: docs/results/peers.md tells how to install them")

if(HPIPM_FOUND AND NOT TARGET HPIPM::hpipm)
  add_library(HPIPM::blasfeo UNKNOWN IMPORTED)
  set_target_properties(HPIPM::blasfeo PROPERTIES
    IMPORTED_LOCATION ${HPIPM_BLASFEO_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${HPIPM_BLASFEO_INCLUDE_DIR}
    INTERFACE_LINK_LIBRARIES m)
  add_library(HPIPM::hpipm UNKNOWN IMPORTED)
  set_target_properties(HPIPM::hpipm PROPERTIES
    IMPORTED_LOCATION ${HPIPM_LIBRARY}
    INTERFACE_INCLUDE_DIRECTORIES ${HPIPM_INCLUDE_DIR}
    INTERFACE_LINK_LIBRARIES HPIPM::blasfeo)
endif()
