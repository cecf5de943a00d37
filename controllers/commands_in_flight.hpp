#pragma once

#include "controllers/estimators/estimator.hpp"
#include "core/mpc/mode_set.hpp"
#include "core/rt/controller.hpp"
#include "core/system/timing.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace solenoid {

/// What a controller believes acts on the plant: the commands on their way to the switches, and what the estimator is
/// told of them.
class CommandsInFlight {
 public:
  CommandsInFlight(const ModeSet& modes, double tick_s) : modes_(modes), timing_(modes, tick_s), tick_s_(tick_s) {}

  /// From now on switches act as these say, which outlive it.
  void use(const ModeSet& left) noexcept {
    left_ = &left;
    timing_ = SwitchTiming(left, tick_s_);
  }
  /// What the switches that are left can do.
  const ModeSet& modes() const noexcept { return left_ ? *left_ : modes_; }

  /// The lines as the next tick begins.
  const DelayLines& lines() const { return lines_; }

  /// This tick's command acts until the next; returns the switch states it finds in effect.
  SwitchPattern take(const Command& command, Estimator& estimator) noexcept {
    before_ = lines_;
    return pass(command, estimator);
  }

  /// The plant was given another command in the tick that take() was last told of.
  void correct(const Command& command, Estimator& estimator) noexcept {
    if (command == last_) return;
    lines_ = before_;
    pass(command, estimator);
  }

  /// Ticks skipped before this sample went by under the last command, unmeasured; the estimator predicts through the
  /// first of them. Returns how many. The first sample ever has none before it.
  std::int64_t catch_up(const Measurement& measured, Estimator& estimator) noexcept {
    const std::int64_t skipped = begun_ ? std::llround((measured.time_s - last_time_s_) / tick_s_) - 1 : 0;
    begun_ = true;
    last_time_s_ = measured.time_s;
    if (skipped <= 0) return 0;
    Measurement unknown = measured;
    unknown.value.fill(std::numeric_limits<double>::quiet_NaN());
    for (std::int64_t k = 0; k < skipped; ++k) {
      if (k < most_predicted_ticks && !measured.ideal) estimator.update(unknown);
      pass(last_, estimator);
    }
    return skipped;
  }

 private:
  static constexpr std::int64_t most_predicted_ticks = 20;

  SwitchPattern pass(const Command& command, Estimator& estimator) noexcept {
    last_ = command;
    lines_.command(command.switches, timing_);
    const SwitchPattern in_effect = lines_.effective();
    estimator.applied(modes().point(in_effect), command.continuous);
    lines_.advance(1);
    return in_effect;
  }

  ModeSet modes_;
  const ModeSet* left_ = nullptr;
  SwitchTiming timing_;
  double tick_s_;
  DelayLines lines_{modes_.safe_pattern()}, before_{lines_};
  Command last_{modes_.safe_pattern(), {}};
  double last_time_s_ = 0.0;
  bool begun_ = false;
};

}  // namespace solenoid
