# `cmake --install`: headers under include/solenoid, static libraries, find_package(solenoid); the program with its manual
# page, completion and pages. Components are `program`, `development` and `python`, a package each (SolenoidPackages).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

install(TARGETS solenoid_core solenoid_solvers solenoid_controllers EXPORT solenoidTargets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
if(TARGET solenoid_program)
  install(TARGETS solenoid_program RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT program)
  if(SOLENOID_MAN_PAGE)
    install(FILES ${SOLENOID_MAN_PAGE} DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT program)
  endif()
  install(FILES ${PROJECT_SOURCE_DIR}/experiments/cli/completion.bash RENAME solenoid
          DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT program)
  # What the help texts cite as docs/...
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/solenoid COMPONENT program
          FILES_MATCHING PATTERN "*.md" PATTERN "images" EXCLUDE)
endif()
install(DIRECTORY ${SOLENOID_INCLUDE_DIR}/solenoid DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/solenoid)
install(EXPORT solenoidTargets NAMESPACE solenoid:: DESTINATION ${package_dir} COMPONENT development)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/solenoidConfig.cmake.in
                              ${PROJECT_BINARY_DIR}/solenoidConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/solenoidConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/solenoidConfig.cmake ${PROJECT_BINARY_DIR}/solenoidConfigVersion.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindSuiteSparse.cmake ${PROJECT_SOURCE_DIR}/cmake/FindIpopt.cmake
              ${PROJECT_SOURCE_DIR}/cmake/FindTomlPlusPlus.cmake ${PROJECT_SOURCE_DIR}/cmake/SolenoidPlugin.cmake
        DESTINATION ${package_dir} COMPONENT development)
