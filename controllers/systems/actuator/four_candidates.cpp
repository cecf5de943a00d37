#include "controllers/systems/actuator/four_candidates.hpp"

#include <algorithm>

namespace solenoid {
namespace {

/// Openings: fill A, exhaust A, fill B, exhaust B.
bool drives_both_chambers(std::span<const double> opening) {
  return opening[0] + opening[1] == 1.0 && opening[2] + opening[3] == 1.0;
}

ModeSet four_of(const ModeSet& all) {
  std::vector<Mode> chosen;
  for (const bool driving : {true, false})
    for (const Mode& mode : all.modes())
      if (drives_both_chambers(all.point(mode.pattern)) == driving && chosen.size() < 4) chosen.push_back(mode);
  const std::vector<double> offset(all.offset().begin(), all.offset().end());
  std::vector<std::vector<double>> gain;
  for (std::size_t c = 0; c < all.switches().size(); ++c) gain.emplace_back(all.gain(c).begin(), all.gain(c).end());
  const std::vector<Switch> switches(all.switches().begin(), all.switches().end());
  const std::vector<SwitchPattern> one_at_a_time(all.one_at_a_time().begin(), all.one_at_a_time().end());
  return {"four of " + all.name(), switches, chosen, offset, gain, one_at_a_time};
}

}  // namespace

FourCandidates::FourCandidates(const PneumaticActuator& model, const ModeSet& modes, double tick_s, int steps)
    : problem_(model, four_of(modes), Horizon{tick_s, {steps}}, Cost<PneumaticActuator>{.tracking = {1.0, 0.0}}),
      plan_(problem_) {
  solver_.prepare(problem_);
}

SwitchPattern FourCandidates::search(const ActuatorState& state, const DelayLines& lines,
                                     const RestartableReference& reference, double time_s) noexcept {
  problem_.initial = problem_.model.nearest_valid(state);
  problem_.lines = lines;
  for (std::size_t j = 0; j < problem_.reference.size(); ++j) {
    const MotionSample ahead = reference.at(time_s + static_cast<double>(j + 1) * problem_.horizon.dt_s).axis[0];
    problem_.reference[j] = {ahead.value, ahead.rate};
  }
  const SolveReport report = solver_.solve(problem_, plan_, Deadline::never());
  return usable(report.status) ? problem_.modes.pattern(plan_.modes.front()) : SwitchPattern{0};
}

}  // namespace solenoid
