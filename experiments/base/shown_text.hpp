#pragma once

#include <string>
#include <string_view>

namespace solenoid {

/// Text from a file as a message may show it: in quotes, with whatever a terminal would not show, or would obey, as
/// "\xNN", and no longer than a line takes.
std::string shown(std::string_view text);

}  // namespace solenoid
