#include "controllers/systems/actuator/four_candidates.hpp"

#include <algorithm>
#include <array>

namespace solenoid {
namespace {

/// Fills or empties each chamber as fast as any mode does: what is left of a bank may not do it at full width.
class Driving {
 public:
  explicit Driving(const ModeSet& all) : all_(all) {
    for (const Mode& mode : all.modes())
      for (std::size_t chamber = 0; chamber < 2; ++chamber) {
        least_[chamber] = std::min(least_[chamber], net_opening(mode, chamber));
        most_[chamber] = std::max(most_[chamber], net_opening(mode, chamber));
      }
  }
  bool both_chambers(const Mode& mode) const { return drives(mode, 0) && drives(mode, 1); }

 private:
  /// By how much wider a chamber's way in is open than its way out.
  double net_opening(const Mode& mode, std::size_t chamber) const {
    const SwitchedPoint opening = all_.point(mode.pattern);
    return opening[2 * chamber + fill_a] - opening[2 * chamber + exhaust_a];
  }
  bool drives(const Mode& mode, std::size_t chamber) const {
    constexpr double tiny = 1e-9;
    const double net = net_opening(mode, chamber);
    return net <= least_[chamber] + tiny || net >= most_[chamber] - tiny;
  }

  const ModeSet& all_;
  std::array<double, 2> least_{}, most_{};
};

ModeSet four_of(const ModeSet& all) {
  const Driving driving(all);
  std::vector<Mode> chosen;
  for (const bool both : {true, false})
    for (const Mode& mode : all.modes())
      if (driving.both_chambers(mode) == both && chosen.size() < 4) chosen.push_back(mode);
  const std::vector<double> offset(all.offset().begin(), all.offset().end());
  std::vector<std::vector<double>> gain;
  for (std::size_t c = 0; c < all.switches().size(); ++c) gain.emplace_back(all.gain(c).begin(), all.gain(c).end());
  const std::vector<Switch> switches(all.switches().begin(), all.switches().end());
  const std::vector<SwitchPattern> one_at_a_time(all.one_at_a_time().begin(), all.one_at_a_time().end());
  return {"four of " + all.name(), switches, chosen, offset, gain, one_at_a_time};
}

}  // namespace

FourCandidates::FourCandidates(const PneumaticActuator& model, const ModeSet& modes, double tick_s, int steps)
    : all_(modes),
      problem_(model, four_of(modes), Horizon{tick_s, {steps}}, Cost<PneumaticActuator>{.tracking = {1.0, 0.0}}),
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
  if (usable(report.status)) return problem_.modes.pattern(plan_.modes.front());
  return all_.find(lines.commanded()) >= 0 ? lines.commanded() : all_.safe_pattern();
}

}  // namespace solenoid
