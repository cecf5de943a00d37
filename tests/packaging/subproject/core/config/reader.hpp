#pragma once

// It has the name that the library's reader has inside the library.
constexpr int parents_own = 1;
