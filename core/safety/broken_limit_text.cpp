#include "core/safety/broken_limit_text.hpp"

#include <fmt/format.h>

namespace solenoid {

std::string broken_limit_text(const BrokenLimit& broken, const SystemDescription& system, const ModeSet& modes,
                              double tick_s) {
  using Kind = BrokenLimit::Kind;
  const auto at = static_cast<std::size_t>(broken.index);
  const double tick_ms = 1e3 * tick_s;
  const auto coil = [&] { return fmt::format("{} '{}'", system.switch_noun, modes.switches()[at].name); };
  switch (broken.kind) {
    case Kind::none:
      return "";
    case Kind::dwell:
      return fmt::format("{} changes {:g} ms after its last change, of {:g} ms at least, {:g} ms ahead", coil(),
                         broken.value * tick_ms, broken.limit * tick_ms, broken.step * tick_ms);
    case Kind::window:
      return fmt::format("{} has changed {:g} times in {:g} ms, of {:g} at most, {:g} ms ahead", coil(), broken.value,
                         1e3 * modes.switches()[at].window_s, broken.limit, broken.step * tick_ms);
    case Kind::one_at_a_time:
      return fmt::format("more than one {} of a group changes at once, {:g} ms ahead", system.switch_noun,
                         broken.step * tick_ms);
    case Kind::state:
      return fmt::format("{} {:.6g} {} beyond its bound of {:g} {}, {:g} ms ahead", system.states[at].label,
                         broken.value, system.states[at].unit, broken.limit, system.states[at].unit,
                         (broken.step + 1) * tick_ms);
  }
  return "";
}

}  // namespace solenoid
