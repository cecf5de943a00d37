#pragma once

#include "controllers/ladder/guard.hpp"
#include "core/rt/controller.hpp"
#include "core/safety/plausibility.hpp"
#include "core/system/timing.hpp"

#include <array>
#include <atomic>
#include <limits>
#include <memory>
#include <vector>

namespace solenoid {

/// A channel outside of this ends in SAFE.
struct ChannelLimits {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  Fault fault = Fault::axis_limit;  ///< under this name
};

/// How long each rung may stand in for the one above, and what ends it all.
struct LadderSettings {
  int shifted_slots = 4;              ///< k: an older plan's own later blocks
  int held_slots = 200;               ///< then a few held modes
  int backup_slots = 100;             ///< then the backup law alone; also after a channel needed to plan has failed
  int longest_gap_ticks = 20;         ///< standing still for longer ends in SAFE: the node has gone there too
  std::vector<ChannelLimits> limits;  ///< of each channel, or none
  std::vector<std::size_t> needed_to_stop;  ///< channels whose failure ends in SAFE
  std::vector<std::size_t> needed_to_plan;  ///< channels without which nothing can be said about the switches
  double lowering_s = 0.0;                  ///< in SAFE: so long the continuous inputs brake the plant; 0: not
  int rearm_sound_ticks = 50;               ///< channels sound for so long before a re-arm
  PlausibilitySettings plausibility;
};

/// Throws std::invalid_argument for settings without bounds of each channel, or with limits of some.
void require_complete(const LadderSettings& settings, const SystemDescription& system);

/// What the ladder did so far.
struct LadderCounts {
  std::array<std::int64_t, rungs> slots{};  ///< begun on each rung
  std::int64_t safe_entries = 0, rearms = 0, refused_rearms = 0;
  std::int64_t infeasible = 0;      ///< problems for which no plan kept to the limits
  double first_infeasible_s = 0.0;  ///< the first of them, and why
  BrokenLimit first_broken{};
};

/// Stands around a controller: believes no implausible channel, replaces plans that do not come, and latches SAFE.
///
///     fresh plan -> shifted plan, k slots -> a few held modes -> backup law, switches safe -> SAFE, latched
///
/// Upwards it climbs by itself, in the tick a plan arrives, but never out of SAFE: that takes request_rearm(), which is
/// refused while channels are not sound or the plant moves. Re-armed, the task begins anew from where the plant is
/// (bumpless). The system's Guard watches the channels whatever the controller's estimator is. step, applied, restart:
/// no allocation, lock or exception. request_*: from any thread or signal handler.
class FallbackLadder final : public Controller {
 public:
  /// What the ladder is made of: the controller inside and what its lower rungs need.
  struct Parts {
    std::unique_ptr<Controller> controller;
    std::unique_ptr<Guard> guard;
    ModeSet modes;
    RestartableReference reference;
    std::vector<std::size_t> axis_channels;  ///< of each axis, the channel that measures it
    Timing timing;
    LadderSettings settings;
  };
  explicit FallbackLadder(Parts parts);

  Decision step(const Measurement& measured) noexcept override;
  void applied(const Command& command) noexcept override;
  void restart(double time_s, const AxisValues& from) noexcept override;

  /// Asks to leave SAFE in the next tick; refused as said above.
  void request_rearm() noexcept { rearm_.store(true, std::memory_order_relaxed); }
  /// Latches SAFE in the next tick, for good.
  void request_stop(Fault why = Fault::stopped) noexcept { stop_.store(static_cast<int>(why) + 1); }

  const ModeSet* left() const noexcept override { return controller_->left(); }
  bool doubts_switches() const noexcept override { return controller_->doubts_switches(); }

  bool safe() const { return safe_; }
  const LadderCounts& counts() const { return counts_; }

 private:
  ChannelValues expected_change() const noexcept;
  AxisValues measured_axes(const Measurement& measured) const noexcept;
  void look_for_danger(const Measurement& measured, const Plausibility::Verdict& verdict, Decision& d) noexcept;
  void consider_rearm(const Measurement& measured) noexcept;
  void catch_up(double time_s) noexcept;
  void assume(const Command& command) noexcept;
  void take_what_is_left(const Decision& d) noexcept;
  const ModeSet& modes() const noexcept { return left_ ? *left_ : modes_; }
  void latch(FaultSet causes, double time_s) noexcept;
  Rung choose(const Decision& d, const Plausibility::Verdict& verdict, double time_s) noexcept;
  Rung below_plans(double time_s, FaultSet failed) noexcept;
  void command(Rung rung, double time_s, Decision& d) noexcept;
  void count(Rung rung, bool slot_begins) noexcept;
  void count_infeasible(const Decision& d, double time_s) noexcept;

  std::unique_ptr<Controller> controller_;
  std::unique_ptr<Guard> guard_;
  ModeSet modes_;
  const ModeSet* left_ = nullptr;  // of modes_, since a switch was found to have failed
  Timing timing_;
  SwitchTiming switch_timing_;
  RestartableReference reference_;
  std::vector<std::size_t> axis_channels_;
  LadderSettings settings_;
  Plausibility plausibility_;
  StateValues watched_{};

  DelayLines lines_{modes_.safe_pattern()};
  Command decided_, last_left_{modes_.safe_pattern(), {}};
  SwitchPattern held_mode_ = 0;
  FaultSet causes_;
  LadderCounts counts_;
  double last_time_s_ = 0.0, safe_since_s_ = 0.0;
  std::int64_t slot_ = -1;
  int held_slots_ = 0, backup_slots_ = 0, sound_ticks_ = 0;
  bool safe_ = false, refused_ = false, started_ = false, slot_begins_ = false;
  Rung last_ = Rung::fresh;
  std::atomic<bool> rearm_{false};
  std::atomic<int> stop_{0};
};

}  // namespace solenoid
