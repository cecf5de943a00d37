# Tests under SOLENOID_SANITIZE: what the runtimes are told, and what has to be loaded before a program without them.
#
#   patience            how much longer a test may take
#   one_in              of how many cases in a long list a test takes one: a search takes up to fifty times as long
#   sanitizer_preload   for LD_PRELOAD: the runtime, which wants to be first, and the library whose exceptions it watches

# Every test of this build is told, and so is every program that a test starts. What the caller's own ASAN_OPTIONS and so on
# say comes after, and wins.
file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/sanitizers.cmake @ONLY CONTENT [[
set(folder "@CMAKE_CURRENT_LIST_DIR@")
set(ENV{ASAN_OPTIONS} "suppressions='${folder}/asan.supp':$ENV{ASAN_OPTIONS}")
set(ENV{LSAN_OPTIONS} "suppressions='${folder}/lsan.supp':print_suppressions=0:$ENV{LSAN_OPTIONS}")
set(ENV{UBSAN_OPTIONS} "suppressions='${folder}/ubsan.supp':print_stacktrace=1:$ENV{UBSAN_OPTIONS}")
set(ENV{TSAN_OPTIONS} "suppressions='${folder}/tsan.supp':$ENV{TSAN_OPTIONS}")
]])
set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${PROJECT_BINARY_DIR}/sanitizers.cmake)

set(patience 6)
set(one_in 20)
set(sanitizer_preload "")
foreach(sanitizer address:libasan.so thread:libtsan.so)
  string(REPLACE ":" ";" sanitizer ${sanitizer})
  list(GET sanitizer 0 name)
  list(GET sanitizer 1 library)
  if(SOLENOID_SANITIZE MATCHES ${name})
    foreach(preloaded ${library} libstdc++.so)
      execute_process(COMMAND ${CMAKE_CXX_COMPILER} -print-file-name=${preloaded} OUTPUT_VARIABLE path OUTPUT_STRIP_TRAILING_WHITESPACE)
      file(REAL_PATH ${path} path)
      string(APPEND sanitizer_preload ${path}:)
    endforeach()
  endif()
endforeach()
