# solenoid_model_build(<package folder> <installed to>): writes _build.json beside the Python package, what a model of Python is
# compiled with: as the library is (SolenoidPlugin.cmake), further instruction sets as in solvers/CMakeLists.txt.
function(solenoid_model_build package installed)
  set(of "$<TARGET_PROPERTY:solenoid_controllers,INTERFACE_")
  string(TOUPPER "${CMAKE_BUILD_TYPE}" config)
  separate_arguments(flags UNIX_COMMAND "${CMAKE_CXX_FLAGS} ${CMAKE_CXX_FLAGS_${config}}")
  list(APPEND flags -std=c++20 -fPIC)
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    list(APPEND flags -fno-gnu-unique)  # as for every plug-in
  endif()
  set(kernels)
  foreach(kernel avx2 avx512)
    get_source_file_property(own ${PROJECT_SOURCE_DIR}/solvers/search/kernels/${kernel}.cpp
                             DIRECTORY ${PROJECT_SOURCE_DIR}/solvers COMPILE_OPTIONS)
    list(JOIN own "\", \"" own)
    list(APPEND kernels "\"${kernel}\": [\"${own}\"]")
  endforeach()
  list(JOIN kernels ", " kernels)
  list(JOIN flags "\", \"" flags)
  set(options "$<REMOVE_DUPLICATES:${of}COMPILE_OPTIONS>>")
  set(defined "$<REMOVE_DUPLICATES:${of}COMPILE_DEFINITIONS>>")
  set(includes "$<FILTER:$<REMOVE_DUPLICATES:${of}INCLUDE_DIRECTORIES>>,EXCLUDE,^(/usr/include$|${SOLENOID_INCLUDE_DIR})>")
  set(text "\"flags\": [\"${flags}\", \"$<JOIN:${options},\", \">\", \"-D$<JOIN:${defined},\", \"-D>\"],
 \"includes\": [\"$<JOIN:${includes},\", \">\"],
 \"kernels\": {${kernels}}}
")
  file(GENERATE OUTPUT ${package}/_build.json CONTENT "{\"compilers\": [\"${CMAKE_CXX_COMPILER}\"],
 \"own_includes\": [\"${SOLENOID_INCLUDE_DIR}\"],
 ${text}")

  # Installed, whatever the prefix: the compiler of the same generation, for others make other libraries.
  string(REGEX MATCH "^[0-9]+" generation ${CMAKE_CXX_COMPILER_VERSION})
  set(compiler g++)
  if(CMAKE_CXX_COMPILER_ID MATCHES Clang)
    set(compiler clang++)
  endif()
  file(RELATIVE_PATH include /${installed} /include)
  file(GENERATE OUTPUT ${PROJECT_BINARY_DIR}/model_build.json CONTENT
       "{\"compilers\": [\"${compiler}-${generation}\", \"${compiler}\", \"c++\"],
 \"own_includes\": [\"${include}\", \"include\", \"/usr/include\"],
 ${text}")
  install(FILES ${PROJECT_BINARY_DIR}/model_build.json RENAME _build.json DESTINATION ${installed} COMPONENT python)
endfunction()
