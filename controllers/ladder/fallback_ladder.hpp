#pragma once

#include "controllers/systems/actuator/estimators/kalman.hpp"
#include "controllers/systems/actuator/four_candidates.hpp"
#include "controllers/systems/actuator/motor_laws.hpp"
#include "core/rt/controller.hpp"
#include "core/safety/plausibility.hpp"

#include <array>
#include <atomic>
#include <memory>
#include <optional>

namespace solenoid {

/// How long each rung may stand in for the one above, and what ends it all.
struct LadderSettings {
  int shifted_slots = 4;       ///< k: an older plan's own later blocks
  int dmpc_slots = 200;        ///< then four candidates
  int motor_slots = 100;       ///< then the motor's law alone; also after a pressure sensor has failed
  int longest_gap_ticks = 20;  ///< standing still for longer ends in SAFE: the node has gone there too
  double position_low_m = -0.005, position_high_m = 0.1085;  ///< beyond: SAFE
  double pressure_limit_pa = 305e3;                          ///< absolute; beyond: SAFE
  double lowering_s = 0.0;                                   ///< in SAFE: so long the motor brakes the slide; 0: not
  double lowering_damping = 200.0;                           ///< [N s/m], within the motor's limit
  int rearm_sound_ticks = 50;                                ///< sensors sound for so long before a re-arm
  double rearm_speed_m_s = 0.02;                             ///< no re-arm while the slide is faster
  PlausibilitySettings plausibility;
};

/// What the ladder did so far.
struct LadderCounts {
  std::array<std::int64_t, rungs> slots{};  ///< begun on each rung
  std::int64_t safe_entries = 0, rearms = 0, refused_rearms = 0;
};

/// Stands around a controller: believes no implausible sensor, replaces plans that do not come, and latches SAFE.
///
///     fresh plan -> shifted plan, k slots -> four-candidate DMPC -> motor law, coils off -> SAFE, latched
///
/// Upwards it climbs by itself, in the tick a plan arrives, but never out of SAFE: that takes request_rearm(), which is
/// refused while sensors are not sound or the slide moves. Re-armed, the task begins anew from the measured position
/// (bumpless). A Kalman filter of its own watches the sensors whatever the controller's estimator is. step, applied,
/// restart: no allocation, lock or exception. request_*: from any thread or signal handler.
class FallbackLadder final : public Controller {
 public:
  /// What the ladder is made of: the controller inside and what its lower rungs need.
  struct Parts {
    std::unique_ptr<Controller> controller;
    PneumaticActuator model;
    ModeSet modes;
    Trajectory reference;
    std::optional<MotorGains> motor;  ///< none: the slide has no motor, that rung is left out
    LadderSettings settings;
  };
  explicit FallbackLadder(Parts parts);

  Decision step(const Sensors& sensors) noexcept override;
  void applied(const Command& command) noexcept override;
  void restart(double time_s, double position_m) noexcept override;

  /// Asks to leave SAFE in the next tick; refused as said above.
  void request_rearm() noexcept { rearm_.store(true, std::memory_order_relaxed); }
  /// Latches SAFE in the next tick, for good.
  void request_stop(Fault why = Fault::stopped) noexcept { stop_.store(static_cast<int>(why) + 1); }

  bool safe() const { return safe_; }
  const LadderCounts& counts() const { return counts_; }

 private:
  std::array<double, 2> expected_pressure_change() const noexcept;
  void look_for_danger(const Sensors& sensors, const Plausibility::Verdict& verdict, Decision& d) noexcept;
  void consider_rearm(const Sensors& sensors) noexcept;
  void catch_up(double time_s) noexcept;
  void assume(const Command& command) noexcept;
  void latch(FaultSet causes, double time_s) noexcept;
  Rung choose(const Decision& d, const Plausibility::Verdict& verdict, double time_s) noexcept;
  Rung below_plans(double time_s, FaultSet failed) noexcept;
  void command(Rung rung, double time_s, Decision& d) noexcept;
  void count(Rung rung, bool slot_begins) noexcept;

  std::unique_ptr<Controller> controller_;
  PneumaticActuator model_;
  ModeSet modes_;
  SwitchTiming timing_;
  RestartableReference reference_;
  std::optional<PdMotor> motor_;
  LadderSettings settings_;
  Plausibility plausibility_;
  FourCandidates candidates_;
  ActuatorKalman watch_, new_watch_;
  ActuatorState watched_{};

  DelayLines lines_{0};
  Command decided_, last_left_;
  SwitchPattern dmpc_coils_ = 0;
  FaultSet causes_;
  LadderCounts counts_;
  double last_time_s_ = 0.0, safe_since_s_ = 0.0;
  std::int64_t slot_ = -1;
  int dmpc_slots_ = 0, motor_slots_ = 0, sound_ticks_ = 0;
  bool safe_ = false, refused_ = false, started_ = false, slot_begins_ = false;
  Rung last_ = Rung::fresh;
  std::atomic<bool> rearm_{false};
  std::atomic<int> stop_{0};
};

}  // namespace solenoid
