#pragma once

#include "controllers/commands_in_flight.hpp"
#include "controllers/estimators/estimator.hpp"
#include "controllers/switch_health.hpp"
#include "core/reference/restartable.hpp"
#include "core/rt/controller.hpp"
#include "core/system/description.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

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
///           use(k, tick) noexcept                              optional: commands the k-th of the sets of what is left
///
/// A SwitchHealth watches the switches, if there is one: in the tick in which a switch has failed the set of what is left takes
/// the place of all of them, in the shell's own lines and in the decider, before anything is decided.
template <class Decider>
class ControllerShell final : public Controller {
 public:
  /// What the shell is made of.
  struct Parts {
    RestartableReference reference;
    Estimator estimator;
    ModeSet modes;
    double tick_s = 0.001;
    std::unique_ptr<SwitchHealth> health{};
    std::vector<SpareModes> spares{};  ///< one for each fault that health can find
  };
  ControllerShell(Parts parts, Decider decider)
      : parts_(std::move(parts)), decider_(std::move(decider)), in_flight_(parts_.modes, parts_.tick_s) {}

  Decision step(const Measurement& measured) noexcept override {
    tick_ += in_flight_.catch_up(measured, parts_.estimator);
    Decision d;
    look_at_switches(measured);
    tell(d);
    d.reference = parts_.reference.at(measured.time_s);
    take_estimate(measured, d);
    const Moment moment{tick_, measured.time_s, parts_.reference, in_flight_};
    decider_.decide(moment, d);
    const SwitchPattern in_effect = in_flight_.take(d.command, parts_.estimator);
    decider_.look_ahead(moment, d, in_effect);
    if (parts_.health) parts_.health->commanded(d.command.switches);
    ++tick_;
    return d;
  }

  void applied(const Command& command) noexcept override {
    in_flight_.correct(command, parts_.estimator);
    if (parts_.health) parts_.health->commanded(command.switches);
  }
  bool doubts_switches() const noexcept override { return doubted_ticks_ > 0 && doubted_ticks_ <= longest_doubt_ticks; }
  const ModeSet* left() const noexcept override { return set_ > 0 ? &*parts_.spares[set_ - 1].left : nullptr; }

  void restart(double time_s, const AxisValues& from) noexcept override {
    parts_.reference.restart(time_s, from);
    decider_.restart(tick_);
  }

 private:
  /// A first switch that failed is done without, if anything is left; of a second one the lines would be wrong.
  void look_at_switches(const Measurement& measured) noexcept {
    if (!parts_.health || measured.ideal) return;
    const auto found = parts_.health->update(measured);
    const bool settling = failed_ && tick_ - failed_tick_ < settling_ticks;
    doubted_ticks_ = parts_.health->doubts() || found || settling ? doubted_ticks_ + 1 : 0;
    if (!found) return;
    failed_tick_ = tick_;
    const auto spare = std::ranges::find(parts_.spares, *found, &SpareModes::failed);
    if (failed_ || spare == parts_.spares.end() || !spare->left) {
      lost_ = true;
      if (!failed_) failed_ = found;
      return;
    }
    failed_ = found;
    if constexpr (requires { decider_.use(std::size_t{}, tick_); }) {
      const auto k = static_cast<std::size_t>(spare - parts_.spares.begin());
      set_ = k + 1;
      in_flight_.use(*spare->left);
      decider_.use(k, tick_);
    } else {
      lost_ = true;
    }
  }

  void tell(Decision& d) const noexcept {
    d.mode_set = static_cast<int>(set_);
    if (!failed_) return;
    d.failed_switch = static_cast<int>(failed_->c);
    d.failed_as = failed_->fault.kind;
    d.faults.add(Fault::switch_failed);
    if (lost_) d.faults.add(Fault::switches_lost);
  }

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
  static constexpr int settling_ticks = 150;       // of an estimator that was told of switches which were not so
  static constexpr int longest_doubt_ticks = 400;  // beyond, a channel may be to blame after all
  std::optional<FailedSwitch> failed_{};
  std::int64_t failed_tick_ = 0;
  int doubted_ticks_ = 0;
  std::size_t set_ = 0;
  bool lost_ = false;
  std::int64_t tick_ = 0;
};

}  // namespace solenoid
