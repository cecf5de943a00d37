#pragma once

#include "core/mpc/switch_fault.hpp"
#include "experiments/systems/actuator/twin/twin_parameters.hpp"

#include <array>
#include <random>

namespace solenoid {

/// Openings of the coils in continuous time: every commanded edge waits for its dead time, then ramps. As in
/// DelayLines, edges are delayed each on its own and the last command wins: it cancels edges that would start after
/// it, so a pulse shorter than its delay is swallowed.
class ValveActuation {
 public:
  /// Delays from the switches of `modes`, travel and jitter from `travel`; all coils off.
  ValveActuation(const ModeSet& modes, const ValveTravel& travel, std::uint64_t seed);

  /// Commands all coils at `time_s`, which never decreases.
  void command(SwitchPattern pattern, double time_s) noexcept;
  /// Opening of coil c in [0, 1] at `time_s`, not before the last time given to settle().
  double opening(std::size_t c, double time_s) const noexcept;
  /// Its mean over [from_s, to_s].
  double mean_opening(std::size_t c, double from_s, double to_s) const noexcept;
  /// The next moment after `time_s` when a slope changes; infinity if none is pending.
  double next_kink(double time_s) const noexcept;
  /// Forgets edges that have started before `time_s`.
  void settle(double time_s) noexcept;
  std::size_t coils() const noexcept { return coils_; }
  /// Makes coil c fail, or be sound again, from `time_s` on, which is not before the last time given to settle(). Its
  /// plunger goes on moving as commanded underneath: a leaking valve never closes beyond its share, of a slow one edges
  /// that are commanded from now on wait longer.
  void fail(std::size_t c, const SwitchFault& fault, double time_s) noexcept;

 private:
  struct Edge {
    double start_s = 0;
    bool on = false;
  };
  /// Opening `base` at `since_s`, moving towards `on`; then the pending edges in order of their start.
  struct Coil {
    double base = 0, since_s = 0;
    bool on = false;
    double dead_rise_s = 0, dead_fall_s = 0;
    SwitchFault fault{};
    std::array<Edge, 64> pending{};
    std::size_t count = 0;
  };
  double moved(double base, bool on, double elapsed_s) const noexcept;
  double settled_at(double base, bool on, double since_s) const noexcept;
  double jitter() noexcept;
  /// The opening of coil c if it were sound.
  double sound_opening(std::size_t c, double time_s) const noexcept;
  double sound_mean_opening(std::size_t c, double from_s, double to_s) const noexcept;

  ValveTravel travel_;
  std::size_t coils_ = 0;
  std::array<Coil, max_switches> coil_{};
  SwitchPattern commanded_ = 0;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

}  // namespace solenoid
