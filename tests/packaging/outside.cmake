# Installs the built project to a scratch prefix, then configures, builds and runs a tiny outside project against it.
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)

file(REMOVE_RECURSE ${WORK})
run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix)
run(${CMAKE_COMMAND} -G Ninja -S ${SOURCE} -B ${WORK}/build -DCMAKE_PREFIX_PATH=${WORK}/prefix -DCMAKE_BUILD_TYPE=Release
    -DSANITIZE=${SANITIZE})
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/outside)
set(recorded ${SOURCE}/../../../experiments/systems/actuator/data/instances/closed_loops.instances)
run(${WORK}/build/instances ${recorded})
run(${WORK}/build/fishing)
run(${WORK}/build/one_change ${recorded})
run(${WORK}/build/kernel)

# The pages that explain how to add a system and a solver show these very files.
foreach(shown fishing.cpp:how-to-add-a-system.md one_change.hpp:how-to-add-a-solver.md)
  string(REPLACE ":" ";" shown ${shown})
  list(GET shown 0 listing_name)
  list(GET shown 1 page_name)
  file(READ ${SOURCE}/${listing_name} listing)
  file(READ ${SOURCE}/../../../docs/how-to/${page_name} page)
  string(FIND "${page}" "${listing}" at)
  if(at LESS 0)
    message(FATAL_ERROR "docs/how-to/${page_name} does not show tests/packaging/outside/${listing_name} as it is")
  endif()
endforeach()
