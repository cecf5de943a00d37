# Installs the built project to a scratch prefix, then configures, builds and runs a tiny outside project against it.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "failed: ${ARGN}\n${output}")
  endif()
  message("${output}")
endfunction()

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
run(${CMAKE_COMMAND} -G Ninja -S ${SOURCE} -B ${WORK}/build -DCMAKE_PREFIX_PATH=${WORK}/prefix -DCMAKE_BUILD_TYPE=Release
    -DSANITIZE=${SANITIZE})
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/outside)
run(${WORK}/build/instances ${SOURCE}/../../../experiments/instances/closed_loops.instances)
run(${WORK}/build/fishing)

# The page that explains how to add a system shows this very file.
file(READ ${SOURCE}/fishing.cpp listing)
file(READ ${SOURCE}/../../../docs/how-to-add-a-system.md page)
string(FIND "${page}" "${listing}" at)
if(at LESS 0)
  message(FATAL_ERROR "docs/how-to-add-a-system.md does not show tests/packaging/outside/fishing.cpp as it is")
endif()
