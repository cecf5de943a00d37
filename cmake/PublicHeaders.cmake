# cmake -DROOT=<source folder> -DTO=<folder> -DVERSION=<version> -P PublicHeaders.cmake: the headers as other projects see them,
# those of the library and those that plug-ins need.
#
# A header includes another as "core/...". Outside, that would need a folder on the include path with `core` in it, where the
# project may have a `core` of its own: the copies say "solenoid/core/...". An unchanged copy is left alone, one without a header goes.
# abi_hash.hpp says which headers these are: what was made with others is refused where it is loaded.
file(GLOB_RECURSE stale RELATIVE ${TO} ${TO}/*)
set(globs core/*.hpp core/*.ipp solvers/*.hpp solvers/*.ipp controllers/*.hpp controllers/*.ipp)
set(of_plugins experiments/plants/*.hpp experiments/plugin/plugin.hpp experiments/described/*.hpp experiments/plugin/abi.hpp
    experiments/campaign/simulated_system.hpp experiments/campaign/run_in_progress.hpp experiments/campaign/scenario.hpp experiments/campaign/trace_layout.hpp)
list(TRANSFORM globs PREPEND ${ROOT}/)
list(TRANSFORM of_plugins PREPEND ${ROOT}/)
file(GLOB_RECURSE headers RELATIVE ${ROOT} ${globs})
file(GLOB more RELATIVE ${ROOT} ${of_plugins})
list(APPEND headers ${more})
list(SORT headers)

# Leaves a file alone that has this text already.
function(write_if_new file text)
  set(before "")
  if(EXISTS ${file})
    file(READ ${file} before)
  endif()
  if(NOT text STREQUAL before)
    file(WRITE ${file} "${text}")
  endif()
endfunction()

set(all "")
foreach(header IN LISTS headers)
  file(READ ${ROOT}/${header} text)
  string(REGEX REPLACE "(#[ \t]*include[ \t]*\")(core|solvers|controllers|experiments)/" "\\1solenoid/\\2/" text "${text}")
  write_if_new(${TO}/${header} "${text}")
  string(SHA256 all "${all}${header}${text}")
endforeach()
string(SUBSTRING "${all}" 0 16 hash)
write_if_new(${TO}/abi_hash.hpp "#pragma once\n\n#define SOLENOID_VERSION_OF_HEADERS \"${VERSION}\"\n#define SOLENOID_HASH_OF_HEADERS \"${hash}\"\n")

list(REMOVE_ITEM stale ${headers} abi_hash.hpp)
list(TRANSFORM stale PREPEND ${TO}/)
if(stale)
  file(REMOVE ${stale})
endif()
