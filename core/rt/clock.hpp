#pragma once

namespace solenoid {

/// Simulated time: a sleep is a jump. The executive's clock in simulation and in tests.
class FakeClock {
 public:
  double now_s() const { return now_s_; }
  void sleep_until(double time_s) {
    if (time_s > now_s_) now_s_ = time_s;
  }

 private:
  double now_s_ = 0.0;
};

}  // namespace solenoid
