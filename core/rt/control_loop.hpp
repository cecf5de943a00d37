#pragma once

#include "core/rt/controller.hpp"
#include "core/rt/recorder.hpp"
#include "core/safety/limits.hpp"

namespace solenoid {

/// The control loop, in simulation and on the rig alike; only plant and clock differ.
///
///     plant.read -> controller (filter, estimator, every 5 ms the solver, motor law) -> limits -> plant.write ->
///     recorder
template <class Clock, class Recorder>
class ControlLoop {
 public:
  ControlLoop(Plant& plant, Clock& clock, Controller& controller, CommandLimits& limits, Recorder& recorder)
      : plant_(plant), clock_(clock), controller_(controller), limits_(limits), recorder_(recorder) {}

  /// Ticks every period_s from now on, `ticks` times.
  void run(std::int64_t ticks, double period_s) noexcept {
    const double start_s = clock_.now_s();
    for (std::int64_t k = 0; k < ticks; ++k) {
      clock_.sleep_until(start_s + static_cast<double>(k) * period_s);
      tick(static_cast<double>(k) * period_s);
    }
  }

  void tick(double time_s) noexcept {
    TickRecord record;
    record.sensors = plant_.read(time_s);
    record.decision = controller_.step(record.sensors);
    record.applied = limits_.checked(record.decision.command);
    plant_.write(record.applied);
    recorder_.record(record);
  }

 private:
  Plant& plant_;
  Clock& clock_;
  Controller& controller_;
  CommandLimits& limits_;
  Recorder& recorder_;
};

}  // namespace solenoid
