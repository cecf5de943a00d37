#pragma once

#include "controllers/switch_health.hpp"
#include "controllers/systems/actuator/estimators/chamber_filter.hpp"
#include "core/systems/actuator/signals.hpp"

#include <array>
#include <memory>
#include <span>
#include <vector>

namespace solenoid {

/// Finds the coil that has failed, from the pressures, the position and what was commanded.     [estimators.md, section 7]
///
/// A fault touches one chamber alone, so each chamber has a bank of its own: a ChamberFilter that believes every valve sound,
/// and one for each way in which a coil can fail. A hypothesis begins as a copy of the sound filter in the tick in which its
/// openings part from the sound ones, and gathers
///
///     g_h <- g_h + (min(n_0, c) - min(n_h, c) - max(0, log S_h/S_0))/2 - d,   n = nu^2/S, begun anew below the floor   (7.5)
///
/// which is the cumulative sum of Page [9] with the onset where g_h last began: the generalised likelihood ratio over
/// the fault's onset. A fault that is rarer has a higher threshold, as the logarithm of its prior would have it. Of those above their
/// thresholds that explain the pressure (mean squared innovation) the one of greatest
///
///     g_h - threshold + log m_h,   m_h the ticks before it began in which it said the same as the sound filter           (7.5a)
///
/// is called, when every other is `margin` below, or when it has been above for `patience_s`: m_h onsets explain the data alike, where a
/// fault that would have shown itself must have begun in that very tick. From then on the sound filter has the fault in it.
///
/// What is not known of the plant is not held against a coil: a tick that was skipped, a channel that is not believed or a node that
/// was in its safe state begins all but what has been found anew, and no hypothesis for `quiet_s`; and while both chambers accuse,
/// as a wrong position makes them do, none is called.
///
/// What changes no flow cannot be seen: a valve stuck closed that nobody opens, a supply valve stuck open at a full chamber.
///
/// cost        two filters of 14 states a tick at least, and one for each hypothesis whose openings differ
/// promise     no allocation, lock or exception in update and commanded
class ValveHealth final : public SwitchHealth {
 public:
  /// Of the model that the controller believes. May allocate.
  ValveHealth(const PneumaticActuator& model, const ModeSet& modes, const HealthTuning& tuning = {});

  /// Every fault that can be found.
  static std::vector<FailedSwitch> findable(const ModeSet& modes, const HealthTuning& tuning);

  std::optional<FailedSwitch> update(const Measurement& measured) noexcept override;
  bool doubts() const noexcept override;
  void commanded(SwitchPattern switches) noexcept override { command_ = switches; }

  /// A way in which a coil can have failed.
  struct Hypothesis {
    std::size_t c = 0;
    SwitchFault fault;
    ChamberFilter filter{};
    PathOpenings open{};  ///< of the tick
    double score = 0.0;   ///< g_h
    double fit = 1.0;     ///< mean squared innovation, in variances
    int above = 0;        ///< ticks above the threshold
    int equal = 0;        ///< ticks since its openings differed from the sound ones
    int age = 0;          ///< ticks since it began
    int onsets = 1;       ///< ticks in which it could have begun and said the same
    bool alive = false;   ///< its filter is its own
  };
  /// Chamber 0 is A, 1 is B.
  const ChamberFilter& sound(std::size_t chamber) const { return chambers_[chamber].sound; }
  const std::vector<Hypothesis>& hypotheses(std::size_t chamber) const { return chambers_[chamber].hypotheses; }

 private:
  /// The states of every coil over a tick, and its edges in ticks of delay.
  struct Coils {
    std::array<double, max_switches> open{}, edge{};
  };
  struct Chamber {
    ChamberFilter::Chamber constants;
    ChamberFilter sound;
    std::vector<Hypothesis> hypotheses;
    double accused = 0.0;  ///< the greatest score of late
  };

  void begin_anew(std::span<const double, 2> pressure_pa, double position_m) noexcept;
  void pass_tick() noexcept;
  PathOpenings openings(std::size_t chamber, const Hypothesis* hypothesis) const noexcept;
  double state_of(std::size_t c, const SwitchFault& fault, double& edge) const noexcept;
  void begin(Chamber& chamber, Hypothesis& h, const PathOpenings& sound, double length_m) noexcept;
  void predict(std::size_t chamber, double from_m, double to_m) noexcept;
  void correct(Chamber& chamber, double measured_pa) noexcept;
  std::optional<FailedSwitch> decide() noexcept;
  double above_threshold(const Hypothesis& h) const noexcept;
  double standing(const Hypothesis& h) const noexcept;

  HealthTuning tuning_;
  std::size_t coils_;
  std::array<Vector<double, 4>, max_switches> gain_{};
  Vector<double, 4> offset_{};
  std::array<SwitchFault, max_switches> failed_{};  // what has been found
  SwitchTiming timing_, slow_timing_;
  DelayLines lines_, slow_lines_;
  SwitchPattern in_effect_, slow_in_effect_, before_, slow_before_, command_;
  std::vector<Chamber> chambers_;
  double position_m_ = 0.0, last_time_s_ = 0.0;
  bool started_ = false;
  bool blind_ = true;    // until a tick that is whole
  int quiet_ticks_ = 0;  // until hypotheses may begin
};

}  // namespace solenoid
