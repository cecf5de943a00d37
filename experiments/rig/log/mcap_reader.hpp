#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace solenoid {

/// What a log holds.
struct McapContents {
  struct Message {
    std::string_view topic;  ///< into `topics`
    std::uint64_t time_ns = 0;
    std::string json;
  };
  std::map<std::uint16_t, std::string> topics;
  std::map<std::string, std::map<std::string, std::string>> metadata;
  std::vector<Message> messages;
  bool complete = false;  ///< it ends as a closed file does
  std::string problem;    ///< where reading had to end before that
};

/// Reads an MCAP file from its front, as far as it goes: a file that was cut gives all records before the cut, those of
/// an unfinished chunk included. Only uncompressed chunks. Throws ConfigError for a file that is none.
McapContents read_mcap(std::string_view bytes, const std::string& name);

}  // namespace solenoid
