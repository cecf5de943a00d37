#include "controllers/factory.hpp"

#include <vector>

#include <fmt/format.h>

namespace solenoid {

std::unique_ptr<Controller> make_controller(const VariantConfig& v, const Motion& reference,
                                            const SolverDecorator& decorate) {
  if (const LawRow* law = find_row(system_of(v).laws(), v.solver)) return law->make(v, reference);
  return system_of(v).mpc(v, reference, decorate);
}

std::unique_ptr<FallbackLadder> make_ladder(const VariantConfig& v, const Motion& reference, LadderSettings settings,
                                            const SolverDecorator& decorate) {
  const System& system = system_of(v);
  const std::size_t channels = system.description().channels.size();
  if (settings.plausibility.channels.size() != channels)
    throw std::invalid_argument(fmt::format("ladder: bounds for {} channels (allowed: one for each of the {}'s {})",
                                            settings.plausibility.channels.size(), system.name(), channels));
  std::vector<std::size_t> axis_channels;
  for (const Axis& axis : system.description().axes) axis_channels.push_back(axis.channel);
  return std::make_unique<FallbackLadder>(
      FallbackLadder::Parts{make_controller(v, reference, decorate), system.guard(v), system.modes(v),
                            restartable(reference, system.description()), axis_channels, v.timing, std::move(settings),
                            system.safe_switches(v)});
}

CommandLimits make_limits(const VariantConfig& v) {
  const System& system = system_of(v);
  const ModeSet modes = system.modes(v);
  const SwitchPattern safe = system.safe_switches(v);
  if (modes.find(safe) < 0)
    throw std::logic_error(system.name() + ": the safe pattern is no mode of '" + v.modes + "'");
  return {modes, system.continuous_limits(v), safe};
}

}  // namespace solenoid
