#pragma once

#include <solenoid/abi_hash.hpp>

/// What a plug-in and the program that loads it must share: version and public headers, compiler, standard library and
/// what changes the layout of types.

#define SOLENOID_TEXT_OF_(value) #value
#define SOLENOID_TEXT_OF(value) SOLENOID_TEXT_OF_(value)

#ifdef __clang__
#define SOLENOID_COMPILER "clang " SOLENOID_TEXT_OF(__clang_major__)
#else
#define SOLENOID_COMPILER "gcc " SOLENOID_TEXT_OF(__GNUC__)
#endif

#define SOLENOID_ABI                                                              \
  SOLENOID_VERSION_OF_HEADERS " " SOLENOID_HASH_OF_HEADERS ", " SOLENOID_COMPILER \
                              ", alignment " SOLENOID_TEXT_OF(__BIGGEST_ALIGNMENT__)
