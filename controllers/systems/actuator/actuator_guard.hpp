#pragma once

#include "controllers/ladder/fallback_ladder.hpp"
#include "controllers/switch_health.hpp"
#include "controllers/systems/actuator/estimators/kalman.hpp"
#include "controllers/systems/actuator/four_candidates.hpp"
#include "controllers/systems/actuator/motor_laws.hpp"
#include "controllers/systems/actuator/resting_slide.hpp"
#include "core/systems/actuator/servo_actuator.hpp"

#include <optional>
#include <vector>

namespace solenoid {

/// The actuator's part of the fallback ladder: a Kalman filter of its own watches the sensors whatever the controller's
/// estimator is; four candidates stand in for a solver, the motor's position law for the valves.
class ActuatorGuard final : public Guard {
 public:
  /// No gains: the slide has no motor. Servo valves, where they are in place of those of the mode set. `spares`: of the mode
  /// set, what may take its place.
  ActuatorGuard(const PneumaticActuator& model, const ModeSet& modes, std::optional<MotorGains> motor, double tick_s,
                std::optional<ServoPair> servo = {}, const std::vector<SpareModes>& spares = {});

  ActuatorGuard(const ActuatorGuard&) = delete;  // it refers to candidates of its own
  ActuatorGuard& operator=(const ActuatorGuard&) = delete;

  StateValues watch(const Measurement& believed) noexcept override;
  void applied(std::span<const double> opening, const ContinuousValues& continuous) noexcept override;
  ChannelValues innovations() const noexcept override;
  ChannelValues expected_change(const StateValues& state, std::span<const double> opening) const noexcept override;
  bool at_rest(const StateValues& state) const noexcept override;
  void reset() noexcept override;
  void use(std::size_t k) noexcept override;
  SwitchPattern held_mode(const StateValues& state, const DelayLines& lines, const RestartableReference& reference,
                          double time_s) noexcept override;
  /// Servo valves are shut.
  ContinuousValues held_inputs(const ContinuousValues& decided) const noexcept override;
  bool has_backup_law() const noexcept override { return motor_.has_value(); }
  ContinuousValues backup_law(const ReferenceSample& desired, const StateValues& state) const noexcept override;
  ContinuousValues brake(const StateValues& state) const noexcept override;

 private:
  static constexpr std::size_t none = static_cast<std::size_t>(-1);
  static constexpr double rest_speed_m_s = 0.02;
  static constexpr double braking_n_s_m = 200.0;  // within the motor's limit

  PneumaticActuator model_;
  double tick_s_;
  std::optional<PdMotor> motor_;
  FourCandidates candidates_;
  std::vector<FourCandidates> spare_candidates_;
  std::vector<std::size_t> spare_of_;  // of each spare set the candidates
  FourCandidates* in_use_ = &candidates_;
  ActuatorKalman watch_, new_watch_;
  RestingSlide slide_, new_slide_;
  double motor_n_ = 0.0;
  std::optional<ServoPair> servo_;
  SwitchedOf<PneumaticActuator> opening_{};  // in the tick just commanded
};

/// Limits of the ladder for the thesis's rig: potentiometer on 13 bits over -10..110 mm, pressures behind a 50 Hz Bessel
/// filter on 13 bits over +-210 kPa gauge. Pressures beyond what lies between the parameters' atmosphere and supply, but
/// for compression by the slide's own motion, are not plausible for long.
LadderSettings actuator_ladder(const ActuatorParameters& parameters = {});

}  // namespace solenoid
