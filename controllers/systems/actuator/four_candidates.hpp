#pragma once

#include "core/mpc/problem.hpp"
#include "core/reference/restartable.hpp"
#include "core/systems/actuator/dynamics.hpp"
#include "solvers/search/exhaustive.hpp"

namespace solenoid {

/// The thesis's DMPC (5.1)-(5.8) as a stand-in for a solver that is late: each chamber filling or exhausting, held over
/// the horizon as fast as it goes, four candidates; with fewer such modes in the set, others make up the four. Its time is bounded: 4 x
/// 100 model steps, tens of microseconds.
class FourCandidates {
 public:
  /// May allocate and throw.
  FourCandidates(const PneumaticActuator& model, const ModeSet& modes, double tick_s, int steps = 100);

  /// The coils to hold from now: state, commands in flight, reference from `time_s` on; where the coils' limits allow none of the
  /// four, what is commanded. No allocation or exception.
  SwitchPattern search(const ActuatorState& state, const DelayLines& lines, const RestartableReference& reference,
                       double time_s) noexcept;

  const ModeSet& modes() const { return problem_.modes; }

 private:
  ModeSet all_;
  Problem<PneumaticActuator> problem_;
  Exhaustive<PneumaticActuator> solver_;
  Plan<PneumaticActuator> plan_;
};

}  // namespace solenoid
