# What every target of the project shares: warnings, sanitizers, include root, floating-point contract.

find_program(SOLENOID_CCACHE ccache)
if(SOLENOID_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${SOLENOID_CCACHE})
endif()

add_library(solenoid_flags INTERFACE)
target_compile_options(solenoid_flags INTERFACE -Wall -Wextra -Wconversion -Werror)
if(SOLENOID_SANITIZE)
  target_compile_options(solenoid_flags INTERFACE -fsanitize=${SOLENOID_SANITIZE} -fno-omit-frame-pointer
                                                  -fno-sanitize-recover=all)
  target_link_options(solenoid_flags INTERFACE -fsanitize=${SOLENOID_SANITIZE})
endif()

# solenoid_library(<name> DEPENDS <targets...>): a static library from every .cpp below the calling folder.
function(solenoid_library name)
  cmake_parse_arguments(arg "" "" "DEPENDS;EXCLUDE" ${ARGN})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  foreach(pattern IN LISTS arg_EXCLUDE)
    list(FILTER sources EXCLUDE REGEX ${pattern})
  endforeach()
  add_library(${name} STATIC ${sources})
  add_library(solenoid::${name} ALIAS ${name})
  set_target_properties(${name} PROPERTIES OUTPUT_NAME solenoid_${name} POSITION_INDEPENDENT_CODE ON)
  target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                                            $<INSTALL_INTERFACE:include/solenoid> $<INSTALL_INTERFACE:include>)
  target_compile_features(${name} PUBLIC cxx_std_20)
  # One formula, one rounding: without contraction the scalar path and every SIMD lane agree to the last bit.
  # Nobody reads errno after sqrt; keeping it costs a branch and spills around every root of a prediction.
  target_compile_options(${name} PUBLIC -ffp-contract=off -fno-math-errno)
  target_link_libraries(${name} PUBLIC ${arg_DEPENDS} PRIVATE $<BUILD_INTERFACE:solenoid_flags>)
endfunction()
