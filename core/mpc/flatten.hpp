#pragma once

/// An attribute, [[SOLENOID_FLATTEN]]: whatever the function calls is inlined into it. Not where the address sanitizer
/// watches each inlined variable, which takes the compiler seventeen times as long.
#ifdef __SANITIZE_ADDRESS__
#define SOLENOID_FLATTEN
#else
#define SOLENOID_FLATTEN gnu::flatten
#endif
