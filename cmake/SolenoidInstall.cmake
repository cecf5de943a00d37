# `cmake --install`: headers under include/solenoid, static libraries, the program, find_package(solenoid).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

install(TARGETS solenoid_core solenoid_solvers solenoid_controllers EXPORT solenoidTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
if(TARGET solenoid_program)
  install(TARGETS solenoid_program RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
install(DIRECTORY ${SOLENOID_INCLUDE_DIR}/solenoid DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/solenoid)
install(EXPORT solenoidTargets NAMESPACE solenoid:: DESTINATION ${package_dir})
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/solenoidConfig.cmake.in
                              ${PROJECT_BINARY_DIR}/solenoidConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/solenoidConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/solenoidConfig.cmake ${PROJECT_BINARY_DIR}/solenoidConfigVersion.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindSuiteSparse.cmake ${PROJECT_SOURCE_DIR}/cmake/FindIpopt.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindTomlPlusPlus.cmake
        DESTINATION ${package_dir})
