#pragma once

#include "core/mpc/mode_set.hpp"
#include "core/rt/io.hpp"
#include "core/safety/limits.hpp"
#include "core/signal/filters.hpp"

#include <array>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

namespace solenoid {

/// The time that a bench keeps: the computer's, or one that jumps.
class BenchClock {
 public:
  virtual ~BenchClock() = default;
  virtual double now_s() = 0;
  virtual void sleep_until(double time_s) = 0;
};

/// Any clock of core/rt as a bench's.
template <class Clock>
class BenchClockOf final : public BenchClock {
 public:
  double now_s() override { return clock_.now_s(); }
  void sleep_until(double time_s) override { clock_.sleep_until(time_s); }

 private:
  Clock clock_;
};

/// A tick as the bench saw it.
struct BenchSample {
  double time_s = 0.0;  ///< since this part of a step began
  double position_m = 0.0;
  std::array<double, 2> pressure_pa{};  ///< read as A and B, absolute
  double slow_position_m = 0.0;         ///< filtered, for laws
  double speed_m_s = 0.0;
  double read_us = 0.0;  ///< what reading took
  bool fresh = false;    ///< measured for this tick
  Command applied;
};

/// A step was stopped, outputs safe; what() says why.
struct BenchStopped : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// The operator ended it.
struct BenchInterrupted : BenchStopped {
  using BenchStopped::BenchStopped;
};

/// What may not be exceeded while a part of a step is played. Bounds of what is read, whatever it means.
struct BenchGuard {
  double travel_m = 0.03;  ///< from where the part began
  double pressure_pa = 101325.0 + 60e3;
};

/// Plays commands tick by tick, every one of them through CommandLimits, and looks at the sensors: what is no number,
/// stays away or leaves the guard's bounds stops it with safe outputs.
class Bench {
 public:
  /// What is commanded in a tick.
  using Law = std::function<Command(const BenchSample&)>;
  using Until = std::function<bool(const BenchSample&)>;

  /// Parts outlive it. `interrupted` is asked every tick.
  Bench(Plant& plant, BenchClock& clock, const ModeSet& modes, double motor_limit_n, double tick_s,
        std::function<bool()> interrupted);

  /// Plays a law for `seconds` or until `until` says so. The last command stands afterwards. Throws BenchStopped.
  std::vector<BenchSample> play(double seconds, const BenchGuard& guard, const Law& law, const Until& until = {});
  /// Safe outputs, now.
  void safe() noexcept;

  Plant& plant() { return plant_; }
  const ModeSet& modes() const { return modes_; }
  double tick_s() const { return tick_s_; }
  double now_s() { return clock_.now_s(); }
  /// Ticks that came too late and were left out, so far.
  std::int64_t skipped() const { return skipped_; }

 private:
  BenchSample look(const Measurement& sensors, double began_s);
  void require(const BenchSample& sample, const BenchSample& first, const BenchGuard& guard);
  [[noreturn]] void stop(const std::string& why);

  Plant& plant_;
  BenchClock& clock_;
  ModeSet modes_;
  CommandLimits limits_;
  double tick_s_;
  std::function<bool()> interrupted_;
  Butterworth2 filter_;
  BackwardDifference difference_;
  double start_s_;
  std::int64_t tick_ = -1, skipped_ = 0;
};

}  // namespace solenoid
