# cmake -DROOT=<source folder> -DTO=<folder> -P PublicHeaders.cmake: the library's headers as other projects see them.
#
# A header includes another as "core/...". Outside, that would need a folder on the include path with `core` in it, where the
# project may have a `core` of its own: the copies say "solenoid/core/...". An unchanged copy is left alone, one without a header goes.
file(GLOB_RECURSE stale RELATIVE ${TO} ${TO}/*)
foreach(folder core solvers controllers)
  file(GLOB_RECURSE headers RELATIVE ${ROOT} ${ROOT}/${folder}/*.hpp ${ROOT}/${folder}/*.ipp)
  foreach(header IN LISTS headers)
    file(READ ${ROOT}/${header} text)
    string(REGEX REPLACE "(#[ \t]*include[ \t]*\")(core|solvers|controllers)/" "\\1solenoid/\\2/" text "${text}")
    set(before "")
    if(EXISTS ${TO}/${header})
      file(READ ${TO}/${header} before)
    endif()
    if(NOT text STREQUAL before)
      file(WRITE ${TO}/${header} "${text}")
    endif()
    list(REMOVE_ITEM stale ${header})
  endforeach()
endforeach()
list(TRANSFORM stale PREPEND ${TO}/)
if(stale)
  file(REMOVE ${stale})
endif()
