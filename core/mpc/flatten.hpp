#pragma once

/// An attribute, [[SOLENOID_FLATTEN]]: whatever the function calls is inlined into it. Not where the address sanitizer
/// watches the scope of each inlined variable, which takes the compiler twenty times as long; the search's kernels are
/// compiled without that watch, and say what the attribute is themselves.
#if defined(__SANITIZE_ADDRESS__) && !defined(SOLENOID_FLATTEN)
#define SOLENOID_FLATTEN
#elif !defined(SOLENOID_FLATTEN)
#define SOLENOID_FLATTEN gnu::flatten
#endif
