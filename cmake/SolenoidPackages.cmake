# Debian packages, a component each: `cpack --config build/release/CPackConfig.cmake -G DEB`, or ./solenoid package.
#
#   solenoid            the program, its manual page, completion and pages
#   libsolenoid-dev     the library: headers, static libraries, find_package(solenoid)
#   python3-solenoid    the Python package, where it is built
#
# Debian: dpkg-dev, for the shared libraries that programs depend on.
include(SolenoidDebianDocs)

# What has to be built before anything can be installed or packed.
add_custom_target(solenoid_installed DEPENDS solenoid_core solenoid_solvers solenoid_controllers)
set(CPACK_COMPONENTS_ALL development)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libsolenoid-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
    "libeigen3-dev, libfmt-dev, libsuitesparse-dev, coinor-libipopt-dev, libxsimd-dev, libtomlplusplus-dev")
if(BONMIN_FOUND)
  string(APPEND CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS ", coinor-libbonmin-dev")
endif()
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS "solenoid, cmake")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION
"Model predictive control of actuators whose inputs switch: library
Models of hybrid systems, mode sets with delays and dwell times, solvers by
search, by relaxation and rounding, estimators, and controllers that run in
real time without allocation. Headers below solenoid/, static libraries, and
a CMake package: find_package(solenoid).")
solenoid_debian_docs(libsolenoid-dev development)

if(TARGET solenoid_program)
  add_dependencies(solenoid_installed solenoid_program)
  list(APPEND CPACK_COMPONENTS_ALL program)
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME solenoid)
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "gnuplot-nox")
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "python3-solenoid, libcomedi0, bash-completion")
  set(CPACK_COMPONENT_PROGRAM_DESCRIPTION
"Model predictive control of actuators whose inputs switch
Compares controllers of actuators with on/off valves, alone or beside a
continuous input, in simulation and in real time: ranks variants on
scenarios, reports on the runs, tunes, identifies, profiles solvers, and
reproduces the tables of the thesis its first system comes from, a pneumatic
cylinder helped by a small motor.

Figures are drawn by gnuplot; a rig is reached by comedi or over UDP.")
  solenoid_debian_docs(solenoid program)
endif()

if(TARGET solenoid_python)
  add_dependencies(solenoid_installed solenoid_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
  string(REGEX MATCH "^([0-9]+)\\.([0-9]+)" python_version ${SOLENOID_PYTHON_VERSION})
  math(EXPR next_python "${CMAKE_MATCH_2} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-solenoid)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
      "python3 (>= ${python_version}), python3 (<< ${CMAKE_MATCH_1}.${next_python}), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SUGGESTS "solenoid, python3-matplotlib, python3-sympy, g++, libsolenoid-dev")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_LIST_DIR}/deb/postinst ${CMAKE_CURRENT_LIST_DIR}/deb/prerm)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_STRICT_PERMISSION ON)
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION
"Model predictive control of actuators whose inputs switch: Python
Variants, scenarios, runs and campaigns of solenoid from Python, with arrays
of NumPy that look into a run's memory. It is typed, and its numbers are the
program's to the last digit.")
  solenoid_debian_docs(python3-solenoid python)
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME solenoid)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each component's own first line is
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "${SOLENOID_DEBIAN_MAINTAINER}")
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
# Whatever the umask of who packs, folders are everyone's to read.
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ
                                                WORLD_EXECUTE)
include(CPack)
