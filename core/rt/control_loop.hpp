#pragma once

#include "core/rt/controller.hpp"
#include "core/rt/recorder.hpp"
#include "core/safety/limits.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid {

/// These counts say how the ticks of a run kept their time.
struct LoopCounts {
  std::int64_t ticks = 0;    ///< done
  std::int64_t skipped = 0;  ///< left out: their time had passed before they could begin
  std::int64_t late = 0;     ///< done, but ended after the next was due
};

/// Runs the control loop, in simulation and on the rig alike; only plant and clock differ.
///
///     plant.read -> controller (filter, estimator, every period the solver, input law) -> limits
///                -> plant.write -> recorder
///
/// Tick k is due at start + k period. Ticks whose whole period has passed are skipped and counted, never made up for,
/// so the phase stays. No allocation, lock or exception of its own.
template <class Clock, class Recorder>
class ControlLoop {
 public:
  /// Of parts that outlive it.
  ControlLoop(Plant& plant, Clock& clock, Controller& controller, CommandLimits& limits, Recorder& recorder)
      : plant_(plant), clock_(clock), controller_(controller), limits_(limits), recorder_(recorder) {}

  /// Ticks every period_s from now on, `ticks` times, skipped ones included.
  void run(std::int64_t ticks, double period_s) noexcept {
    run(ticks, period_s, [] { return false; });
  }
  /// Does the same until `stop()`, which it asks after every tick, says so.
  template <class Stop>
  void run(std::int64_t ticks, double period_s, Stop stop) noexcept {
    const double start_s = clock_.now_s();
    for (std::int64_t k = 0; k < ticks; ++k) {
      const std::int64_t due = std::max(k, passed(start_s, period_s));
      clock_.sleep_until(start_s + static_cast<double>(due) * period_s);
      const std::int64_t now = std::max(due, passed(start_s, period_s));
      if (now >= ticks) {
        counts_.skipped += ticks - k;
        return;
      }
      const double due_s = start_s + static_cast<double>(now) * period_s;
      tick(static_cast<double>(now) * period_s, due_s, static_cast<int>(now - k));
      if (clock_.now_s() > due_s + 1.000001 * period_s) ++counts_.late;
      k = now;
      if (stop()) return;
    }
  }

  /// What became of the ticks, of all runs together.
  const LoopCounts& counts() const { return counts_; }

 private:
  /// Counts the whole periods since the start; a rounding error of a product does not hide one.
  std::int64_t passed(double start_s, double period_s) const noexcept {
    return static_cast<std::int64_t>(std::floor((clock_.now_s() - start_s) / period_s + 1e-6));
  }
  static float us(double seconds) { return static_cast<float>(1e6 * seconds); }

  void tick(double time_s, double due_s, int skipped) noexcept {
    TickRecord record;
    record.skipped = skipped;
    const double began = clock_.now_s();
    record.sensors = plant_.read(time_s);
    const double measured = clock_.now_s();
    record.decision = controller_.step(record.sensors);
    limits_.restrict_to(controller_.left());
    record.applied = limits_.checked(record.decision.command);
    const double decided = clock_.now_s();
    plant_.write(record.applied);
    const double written = clock_.now_s();
    controller_.applied(record.applied);
    record.timing = {us(began - due_s), us(measured - began), us(decided - measured), us(written - decided)};
    recorder_.record(record);
    ++counts_.ticks;
    counts_.skipped += skipped;
  }

  Plant& plant_;
  Clock& clock_;
  Controller& controller_;
  CommandLimits& limits_;
  Recorder& recorder_;
  LoopCounts counts_;
};

}  // namespace solenoid
