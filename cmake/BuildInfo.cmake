# solenoid_build_info(<target>): version and git revision inside the target; a new commit configures again.
function(solenoid_build_info target)
  set(git_revision "")
  find_package(Git QUIET)
  if(GIT_FOUND)
    execute_process(COMMAND ${GIT_EXECUTABLE} describe --always --dirty --abbrev=12
                    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE git_revision
                    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    execute_process(COMMAND ${GIT_EXECUTABLE} rev-parse --git-path logs/HEAD
                    WORKING_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE head_log
                    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    get_filename_component(head_log "${head_log}" ABSOLUTE BASE_DIR ${PROJECT_SOURCE_DIR})
    if(EXISTS "${head_log}" AND NOT IS_DIRECTORY "${head_log}")
      set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${head_log}")
    endif()
  endif()
  set(generated ${CMAKE_CURRENT_BINARY_DIR}/build_info.cpp)
  file(CONFIGURE OUTPUT ${generated} @ONLY CONTENT [[
#include "experiments/base/build_info.hpp"

namespace solenoid {

BuildInfo build_info() { return {"@PROJECT_VERSION@", "@git_revision@", "@CMAKE_CXX_COMPILER_ID@ @CMAKE_CXX_COMPILER_VERSION@", "@CMAKE_BUILD_TYPE@"}; }

}  // namespace solenoid
]])
  target_sources(${target} PRIVATE ${generated})
endfunction()
