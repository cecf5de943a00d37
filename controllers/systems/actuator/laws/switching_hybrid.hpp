#pragma once

#include "controllers/systems/actuator/laws/three_mode_sliding.hpp"

#include <cmath>

namespace solenoid {

/// The switching control of a hybrid pneumatic-electric actuator:
///
///     coarse phase   cylinder by sliding mode (ThreeModeSliding) and motor by its PD law
///     fine phase     motor alone by the same PD law; chambers exhausted, as published, or closed
///     coarse -> fine when |y_d - y| < fine_below,    fine -> coarse when |y_d - y| > coarse_above
///
/// F. Takemura, S. R. Pandian, Y. Nagase, H. Mizutani, Y. Hayakawa, S. Kawamura, "Control of a hybrid
/// pneumatic/electric motor", IEEE/RSJ International Conference on Intelligent Robots and Systems, 209-214, 2000: an
/// air motor under two servo valves in a horizontal plane, one threshold. Adapted here: on/off valves, so three modes
/// on the surface; two thresholds against chattering; closed chambers, since this motor cannot carry the load in the
/// vertical plane (docs/results/baselines.md has the figures of both).
class SwitchingHybrid {
 public:
  SwitchingHybrid(const PhaseSettings& phases, const SlidingSettings& sliding, const ModeSet& modes)
      : phases_(phases), exhausts_(phases.rest == "exhaust"), patterns_(modes), cylinder_(sliding, modes) {}

  SwitchPattern coils(const LawInput& in) noexcept {
    using enum ChamberAction;
    const bool was_coarse = coarse_;
    coarse_ = next_phase(std::abs(in.desired.value - in.state[position]));
    if (coarse_ && !was_coarse) cylinder_.restart();  // decides at once
    if (coarse_) return cylinder_.coils(in);
    return exhausts_ ? patterns_(exhaust, exhaust) : patterns_(closed, closed);
  }
  void restart() noexcept {
    cylinder_.restart();
    coarse_ = false;
  }
  bool coarse() const { return coarse_; }

 private:
  bool next_phase(double error_m) const noexcept {
    return coarse_ ? error_m >= phases_.fine_below_m : error_m > phases_.coarse_above_m;
  }

  PhaseSettings phases_;
  bool exhausts_;
  ChamberPatterns patterns_;
  ThreeModeSliding cylinder_;
  bool coarse_ = false;
};

}  // namespace solenoid
