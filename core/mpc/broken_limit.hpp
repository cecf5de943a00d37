#pragma once

#include <cstdint>

namespace solenoid {

/// Which limit of a problem a plan breaks first, and how.
struct BrokenLimit {
  enum class Kind : std::uint8_t {
    none,           ///< it keeps to all of them
    dwell,          ///< switch `index` changes `value` steps after its last change; `limit` at least
    window,         ///< switch `index` has changed `value` times in its window; `limit` at most before it may again
    one_at_a_time,  ///< more than one switch of group `index` changes
    state,          ///< state `index` is `value`, beyond `limit`
  };
  Kind kind = Kind::none;
  int step = 0;  ///< of the horizon, from 0: a command before it, a state after it
  int index = 0;
  double value = 0.0, limit = 0.0;

  bool operator==(const BrokenLimit&) const = default;
};

}  // namespace solenoid
