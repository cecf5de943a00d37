# What every target of the project shares: warnings, sanitizers, include roots, floating-point contract.

find_program(SOLENOID_CCACHE ccache)
if(SOLENOID_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${SOLENOID_CCACHE})
endif()

add_library(solenoid_flags INTERFACE)
target_include_directories(solenoid_flags INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(solenoid_flags INTERFACE -Wall -Wextra -Wconversion $<$<BOOL:${SOLENOID_WERROR}>:-Werror>)
if(SOLENOID_SANITIZE)
  # Of `undefined` the checks of each access and each pointer's sum are left out: they alone double the time to compile, and
  # most of what they find ends a run under the address sanitizer too.
  target_compile_options(solenoid_flags INTERFACE -fsanitize=${SOLENOID_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all
                                                  -fno-sanitize=null,alignment,object-size,pointer-overflow
                                                  $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)  # GCC 12 finds it in its own <regex>
  target_link_options(solenoid_flags INTERFACE -fsanitize=${SOLENOID_SANITIZE})
endif()
option(SOLENOID_COVERAGE "programs count which of their lines run: ./solenoid coverage" OFF)
if(SOLENOID_COVERAGE)
  add_library(solenoid_coverage_exit STATIC ${PROJECT_SOURCE_DIR}/tests/coverage/exit.cpp)
  target_compile_options(solenoid_flags INTERFACE --coverage -fprofile-update=atomic)
  target_link_options(solenoid_flags INTERFACE --coverage -Wl,--wrap=_exit)
  target_link_libraries(solenoid_flags INTERFACE solenoid_coverage_exit)
endif()

# The library's headers as another project includes them, <solenoid/core/...>: copied into the build folder, installed from there.
set(SOLENOID_INCLUDE_DIR ${PROJECT_BINARY_DIR}/include)
set(public_headers)
foreach(folder core solvers controllers)
  file(GLOB_RECURSE headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/${folder}/*.hpp ${PROJECT_SOURCE_DIR}/${folder}/*.ipp)
  list(APPEND public_headers ${headers})
endforeach()
file(GLOB headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/experiments/plants/*.hpp ${PROJECT_SOURCE_DIR}/experiments/plugin/*.hpp
                                    ${PROJECT_SOURCE_DIR}/experiments/described/*.hpp ${PROJECT_SOURCE_DIR}/experiments/campaign/*.hpp)
list(APPEND public_headers ${headers})
set(headers_script ${PROJECT_SOURCE_DIR}/cmake/PublicHeaders.cmake)
set(write_headers ${CMAKE_COMMAND} -DROOT=${PROJECT_SOURCE_DIR} -DTO=${SOLENOID_INCLUDE_DIR}/solenoid -DVERSION=${PROJECT_VERSION}
    -P ${headers_script})
execute_process(COMMAND ${write_headers} COMMAND_ERROR_IS_FATAL ANY)  # for tools that read sources where nothing was built yet
add_custom_command(OUTPUT ${PROJECT_BINARY_DIR}/public_headers.stamp
  COMMAND ${write_headers}
  COMMAND ${CMAKE_COMMAND} -E touch ${PROJECT_BINARY_DIR}/public_headers.stamp
  DEPENDS ${public_headers} ${headers_script} VERBATIM)
add_custom_target(solenoid_headers DEPENDS ${PROJECT_BINARY_DIR}/public_headers.stamp)

option(SOLENOID_UNITY "compile the program's files and its tests' in groups: a whole build takes a third as long, one after a change longer" OFF)
# solenoid_unity(<target> <regex> [-O<level>] <regex> [-O<level>]...): the target's files whose path below the calling folder
# begins with a regex are compiled as one; a later regex takes files from an earlier one. For files that take long to read and
# not to optimise: headers are read and templates instantiated once for the group. A level takes the place of -O2 in a release:
# for groups where a run spends no time.
function(solenoid_unity target)
  if(NOT SOLENOID_UNITY)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  get_target_property(sources ${target} SOURCES)
  set(number -1)
  foreach(argument IN LISTS ARGN)
    if(argument MATCHES "^-O")
      # The file that CMake writes for the group: options of a file of the group would take it out of the group.
      set_source_files_properties(${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/${target}.dir/Unity/unity_${number}_cxx.cxx
                                  PROPERTIES COMPILE_OPTIONS $<$<CONFIG:Release>:${argument}>)
      continue()
    endif()
    set(group ${sources})
    list(FILTER group INCLUDE REGEX "^${CMAKE_CURRENT_SOURCE_DIR}/(${argument})")
    if(NOT group)
      message(FATAL_ERROR "solenoid_unity: ${target} has no file that begins with ${argument}")
    endif()
    math(EXPR number "${number} + 1")
    set_source_files_properties(${group} PROPERTIES UNITY_GROUP ${number})
  endforeach()
endfunction()

# solenoid_library(<name> DEPENDS <targets...> [FOLDERS <folders...>] [EXCLUDE <regexes...>] [WITHOUT <target>]): a static library
# solenoid_<name>, known as solenoid::<name>, from every .cpp below the calling folder or these folders of it; EXCLUDE leaves out
# files by their path, WITHOUT those of another target.
function(solenoid_library name)
  cmake_parse_arguments(arg "" "WITHOUT" "DEPENDS;FOLDERS;EXCLUDE" ${ARGN})
  set(patterns ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  if(arg_FOLDERS)
    list(TRANSFORM arg_FOLDERS REPLACE "(.+)" "${CMAKE_CURRENT_SOURCE_DIR}/\\1/*.cpp" OUTPUT_VARIABLE patterns)
  endif()
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${patterns})
  foreach(pattern IN LISTS arg_EXCLUDE)
    list(FILTER sources EXCLUDE REGEX ${pattern})
  endforeach()
  if(arg_WITHOUT)
    get_target_property(others ${arg_WITHOUT} SOURCES)
    list(REMOVE_ITEM sources ${others})
  endif()
  set(target solenoid_${name})
  add_library(${target} STATIC ${sources})
  add_library(solenoid::${name} ALIAS ${target})
  add_dependencies(${target} solenoid_headers)
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON)
  target_include_directories(${target} INTERFACE $<BUILD_INTERFACE:${SOLENOID_INCLUDE_DIR}> $<INSTALL_INTERFACE:include>)
  target_compile_features(${target} PUBLIC cxx_std_20)
  # One formula, one rounding: without contraction the scalar path and every SIMD lane agree to the last bit.
  # Nobody reads errno after sqrt; keeping it costs a branch and spills around every root of a prediction.
  target_compile_options(${target} PUBLIC -ffp-contract=off -fno-math-errno)
  target_link_libraries(${target} PUBLIC ${arg_DEPENDS} PRIVATE $<BUILD_INTERFACE:solenoid_flags>)
endfunction()
