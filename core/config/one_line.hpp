#pragma once

#include <string>
#include <string_view>

namespace solenoid {

/// A message as a line of a terminal may show it, whatever a file or a command line put into it: what a terminal would
/// obey, and a line's end, becomes "\xNN"; of more than 1900 characters some in the middle are left out. Such a line stays
/// as it is.
std::string one_line(std::string_view text);

}  // namespace solenoid
