#pragma once

#include "controllers/commands_in_flight.hpp"
#include "controllers/estimators/estimator.hpp"
#include "core/reference/restartable.hpp"
#include "core/rt/controller.hpp"
#include "core/system/description.hpp"

namespace solenoid {

/// A motion that can begin anew, each axis going to its start as fast as the system has it.
inline RestartableReference restartable(const Motion& motion, const SystemDescription& system) {
  AxisValues speeds{};
  for (std::size_t a = 0; a < system.axes.size(); ++a) speeds[a] = system.axes[a].approach;
  return RestartableReference(motion, speeds);
}

/// What a decider sees of a tick beside the decision so far (reference and estimate).
struct Moment {
  std::int64_t tick = 0;  ///< since the start, skipped ones counted
  double time_s = 0.0;
  const RestartableReference& reference;
  const CommandsInFlight& in_flight;  ///< as the tick begins, without its own command
};

/// What every controller does around its decision, predictive control and feedback laws alike:
///
///     skipped ticks caught up -> reference -> estimate -> Decider -> the command taken as what acts on the plant
///
/// and afterwards what the exit made of it (applied), a task begun anew (restart).
///
/// Decider:  decide(const Moment&, Decision&) noexcept          sets d.command, and what else it knows of d
///           look_ahead(const Moment&, const Decision&, SwitchPattern in_effect) noexcept    once the command is given
///           restart(std::int64_t tick) noexcept
///           believe(const EstimateDetail&) noexcept            what the estimator found beyond the state
template <class Decider>
class ControllerShell final : public Controller {
 public:
  /// What the shell is made of.
  struct Parts {
    RestartableReference reference;
    Estimator estimator;
    ModeSet modes;
    double tick_s = 0.001;
  };
  ControllerShell(Parts parts, Decider decider)
      : parts_(std::move(parts)), decider_(std::move(decider)), in_flight_(parts_.modes, parts_.tick_s) {}

  Decision step(const Measurement& measured) noexcept override {
    tick_ += in_flight_.catch_up(measured, parts_.estimator);
    Decision d;
    d.reference = parts_.reference.at(measured.time_s);
    take_estimate(measured, d);
    const Moment moment{tick_, measured.time_s, parts_.reference, in_flight_};
    decider_.decide(moment, d);
    const SwitchPattern in_effect = in_flight_.take(d.command, parts_.estimator);
    decider_.look_ahead(moment, d, in_effect);
    ++tick_;
    return d;
  }

  void applied(const Command& command) noexcept override { in_flight_.correct(command, parts_.estimator); }

  void restart(double time_s, const AxisValues& from) noexcept override {
    parts_.reference.restart(time_s, from);
    decider_.restart(tick_);
  }

 private:
  /// Under ideal sensing the true state passes the estimator by.
  void take_estimate(const Measurement& measured, Decision& d) noexcept {
    if (measured.ideal) {
      d.estimate = measured.truth;
      return;
    }
    d.estimate = parts_.estimator.update(measured);
    d.detail = parts_.estimator.detail();
    decider_.believe(d.detail);
  }

  Parts parts_;
  Decider decider_;
  CommandsInFlight in_flight_;
  std::int64_t tick_ = 0;
};

}  // namespace solenoid
