#pragma once

#include "experiments/campaign/shard_file.hpp"

#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <tuple>

namespace solenoid {

/// Of each variant the runs with the largest errors so far, unstable ones before all, with their traces.
class WorstTraces {
 public:
  /// `most` of a variant.
  WorstTraces(const Campaign& campaign, std::size_t most)
      : session_(session_of(campaign)), campaign_(campaign), most_(most) {}

  void take(std::string_view encoded, std::string_view trace);
  /// Gives them away, variants by name, the worst of each first.
  void hand_on(const std::function<void(std::string_view encoded, std::string_view trace)>& to);

 private:
  struct Kept {
    double error = 0.0;
    std::string encoded, trace;
    bool operator<(const Kept& other) const { return std::tie(other.error, encoded) < std::tie(error, other.encoded); }
  };

  WritingSession session_;
  const Campaign& campaign_;
  std::size_t most_;
  std::map<std::string, std::set<Kept>> kept_;  // by variant, the worst first
};

}  // namespace solenoid
