#pragma once

#include "core/reference/restartable.hpp"
#include "core/rt/controller.hpp"

#include <memory>
#include <span>

namespace solenoid {

/// What a system lends the fallback ladder (fallback_ladder.hpp): an estimate to watch the channels by, and what stands
/// in for a plan. All but the constructor: no allocation, lock or exception.
class Guard {
 public:
  virtual ~Guard() = default;

  /// Takes a tick's believed values (NaN: not believed) and returns the state they show.
  virtual StateValues watch(const Measurement& believed) noexcept = 0;
  /// Tells which switched inputs (a point of the mode set) and continuous inputs act until the next tick.
  virtual void applied(std::span<const double> switched, const ContinuousValues& continuous) noexcept = 0;
  /// The last tick's innovations squared, in variances; 0 for a channel left out.
  virtual ChannelValues innovations() const noexcept = 0;
  /// How the model moves each channel in a tick from this state at rest, under these switched inputs: what a stuck
  /// sensor would have to show; 0 where nothing can be said.
  virtual ChannelValues expected_change(const StateValues& state, std::span<const double> switched) const noexcept = 0;
  /// Whether the plant moves slowly enough for a task to begin anew.
  virtual bool at_rest(const StateValues& state) const noexcept = 0;
  /// Starts anew.
  virtual void reset() noexcept = 0;

  /// Has only the k-th of the sets of what is left to choose from, from now on (System::spare_modes).
  virtual void use(std::size_t /*k*/) noexcept {}

  /// A mode to hold from now on, the best of a few, in bounded time (rung dmpc).
  virtual SwitchPattern held_mode(const StateValues& state, const DelayLines& lines,
                                  const RestartableReference& reference, double time_s) noexcept = 0;
  /// The continuous inputs beside it, `decided` being those of a plan that has grown old.
  virtual ContinuousValues held_inputs(const ContinuousValues& decided) const noexcept { return decided; }
  /// Whether the system has a law for its continuous inputs alone (rung motor).
  virtual bool has_backup_law() const noexcept { return false; }
  /// That law.
  virtual ContinuousValues backup_law(const ReferenceSample& /*desired*/, const StateValues& /*state*/) const noexcept {
    return {};
  }
  /// Continuous inputs that brake the plant in SAFE.
  virtual ContinuousValues brake(const StateValues& /*state*/) const noexcept { return {}; }
};

}  // namespace solenoid
