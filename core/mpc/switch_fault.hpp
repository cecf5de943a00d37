#pragma once

#include "core/mpc/mode_set.hpp"

#include <optional>

namespace solenoid {

/// In these ways a switch can fail.
enum class SwitchFaultKind : std::uint8_t {
  none,
  stuck_on,   ///< on, whatever is commanded
  stuck_off,  ///< off, whatever is commanded
  leaking,    ///< off, a share of it stays on; on, it is as it was
  slow,       ///< both its edges take effect later than they did
};

/// The kind in words: "stuck on".
const char* to_string(SwitchFaultKind kind);

/// How a switch has failed.
struct SwitchFault {
  SwitchFaultKind kind = SwitchFaultKind::none;
  double value = 0.0;  ///< leaking: the share, in (0, 1]; slow: by so much later [s]
  /// What becomes of a state of the switch in [0, 1].
  double opening(double sound) const noexcept {
    switch (kind) {
      case SwitchFaultKind::stuck_on:
        return 1.0;
      case SwitchFaultKind::stuck_off:
        return 0.0;
      case SwitchFaultKind::leaking:
        return value + (1.0 - value) * sound;
      case SwitchFaultKind::none:
      case SwitchFaultKind::slow:
        break;
    }
    return sound;
  }
  bool operator==(const SwitchFault&) const = default;
};

/// The mode set of what is left when switch c has failed: the same switches, so that a pattern stays a pattern, and points
/// that have the fault in them. With point(b) = offset + sum_c gain[c] b_c:
///
///     stuck on    offset + gain[c], and gain[c] = 0
///     stuck off   gain[c] = 0
///     leaking     offset + value gain[c], and gain[c] (1 - value)
///     slow        both delays of c longer by `value`, at most to max_delay_steps of `dt`
///
/// A stuck switch is commanded off: of the modes those stay that do not use it, each once. `opposed` says of a pair of
/// switched inputs (i, j) that i undoes what j does. Of a switch stuck on, or
/// leaking, modes in which inputs that are opposed to its own are open, but by less than what stays on of it, are left
/// out: they spend and turn nothing round. The safe pattern stays a mode: with it, the switch off, wherever that is one.
///
/// Nothing is left where fewer than two modes are. Throws std::invalid_argument for a switch there is not.
std::optional<ModeSet> with_fault(const ModeSet& modes, std::size_t c, const SwitchFault& fault, double dt,
                                  std::span<const std::array<std::size_t, 2>> opposed = {});

}  // namespace solenoid
