# `cmake --install`: headers under include/solenoid, static libraries, the program, find_package(solenoid).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

install(TARGETS core solvers controllers EXPORT solenoidTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(TARGETS solenoid_program RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
foreach(folder core solvers controllers)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/solenoid
          FILES_MATCHING PATTERN "*.hpp" PATTERN "*.ipp")
endforeach()

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/solenoid)
install(EXPORT solenoidTargets NAMESPACE solenoid:: DESTINATION ${package_dir})
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/solenoidConfig.cmake.in
                              ${PROJECT_BINARY_DIR}/solenoidConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/solenoidConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/solenoidConfig.cmake ${PROJECT_BINARY_DIR}/solenoidConfigVersion.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindSuiteSparse.cmake ${PROJECT_SOURCE_DIR}/cmake/FindIpopt.cmake
        DESTINATION ${package_dir})
