// Time of one estimate on a recorded closed loop: median, p99 and maximum in microseconds.
#include "controllers/estimators/estimator.hpp"
#include "core/metrics/metrics.hpp"
#include "tests/support/drawn_world.hpp"

#include <chrono>
#include <cstdio>
#include <vector>

int main() {
  using namespace solenoid;
  using Clock = std::chrono::steady_clock;
  struct Tick {
    Sensors sensors;
    Vector<double, 4> opening;
    double motor_n;
  };
  std::vector<Tick> ticks;
  DrawnWorld world(moderate_tuning(), 1);
  for (int k = 0; k < 8000; ++k) {
    const Sensors s = world.sensors();
    world.advance(s);
    ticks.push_back({s, world.opening(), world.motor_n()});
  }
  std::printf("%-12s %9s %9s %9s\n", "estimator", "median", "p99", "max [us]");
  for (const char* name : {"thesis", "ekf", "payload_ekf", "mhe"}) {
    Estimator estimator(name, PneumaticActuator(), estimator_tuning(name));
    std::vector<double> times;
    for (const Tick& tick : ticks) {
      const auto start = Clock::now();
      estimator.update(tick.sensors);
      times.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
      estimator.applied(tick.opening, tick.motor_n);
    }
    const Percentiles p = percentiles(times);
    std::printf("%-12s %9.2f %9.2f %9.2f\n", name, p.p50, p.p99, p.max);
  }
}
