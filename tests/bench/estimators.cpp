// Time of one estimate on a recorded closed loop: median, p99 and maximum in microseconds, of the thread's own time
// (free of what else the machine does) and on the wall.
#include "controllers/catalogue.hpp"
#include "core/metrics/metrics.hpp"
#include "tests/support/drawn_world.hpp"

#include <chrono>
#include <cstdio>
#include <ctime>
#include <vector>

namespace {
double thread_us() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}
}  // namespace

int main() {
  using namespace solenoid;
  using Clock = std::chrono::steady_clock;
  struct Tick {
    Measurement sensors;
    Vector<double, 4> opening;
    double motor_n;
  };
  std::vector<Tick> ticks;
  DrawnWorld world(moderate_tuning(), 1);
  for (int k = 0; k < 8000; ++k) {
    const Measurement s = world.sensors();
    world.advance(s);
    ticks.push_back({s, world.opening(), world.motor_n()});
  }
  std::printf("%-12s %27s %29s\n%-12s %9s %9s %9s %9s %9s %9s\n", "", "thread [us]", "wall [us]", "estimator", "median",
              "p99", "max", "median", "p99", "max");
  for (const char* name : {"thesis", "ekf", "payload_ekf", "mhe"}) {
    Estimator estimator = make_estimator(name, PneumaticActuator(), estimator_row(name).tuning);
    std::vector<double> wall, own;
    for (const Tick& tick : ticks) {
      const auto start = Clock::now();
      const double before = thread_us();
      estimator.update(tick.sensors);
      own.push_back(thread_us() - before);
      wall.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
      estimator.applied(tick.opening, {tick.motor_n});
    }
    const Percentiles p = percentiles(own), q = percentiles(wall);
    std::printf("%-12s %9.2f %9.2f %9.2f %9.2f %9.2f %9.2f\n", name, p.p50, p.p99, p.max, q.p50, q.p99, q.max);
  }
}
