#pragma once

#include "core/systems/actuator/signals.hpp"
#include "experiments/rig/rig_io.hpp"

#include <memory>

namespace solenoid {

class TableReader;

/// quantity = offset + gain * volts.
struct LinearChannel {
  double offset = 0.0, gain = 1.0;
  double value(double volts) const { return offset + gain * volts; }
  double volts(double value) const { return (value - offset) / gain; }
};

/// From volts to the actuator's quantities. The defaults are the twin's: -5..5 V for -10..110 mm and +-210 kPa gauge,
/// and the amplifier's 1.6 N a volt (4.10).
struct Calibration {
  LinearChannel position{0.05, 0.012};          ///< [m], [m/V]
  LinearChannel pressure_a{101325.0, 42000.0};  ///< [Pa], [Pa/V]
  LinearChannel pressure_b{101325.0, 42000.0};
  LinearChannel motor{0.0, 1.6};  ///< [N], [N/V]
  double motor_limit_v = 5.0;
};

/// Table [calibration]: position, pressure_a, pressure_b, motor, each { offset, gain }; motor_limit_v.
Calibration read_calibration(TableReader& table);

/// A RigIo as the control loop's plant. What the controller may take for the truth is what was measured.
class RigPlant final : public Plant {
 public:
  /// Opens the io.
  RigPlant(std::unique_ptr<RigIo> io, const Calibration& calibration, double tick_s);
  ~RigPlant() override;

  Measurement read(double time_s) noexcept override;
  void write(const Command& command) noexcept override;
  RigIo& io() { return *io_; }

 private:
  std::unique_ptr<RigIo> io_;
  Calibration calibration_;
  double tick_s_, last_time_s_ = -1.0;
  int stale_ticks_ = 0;
};

/// While it lives, a crash of the process (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT) first makes this io safe.
class CrashGuard {
 public:
  explicit CrashGuard(RigIo& io);
  ~CrashGuard();
  CrashGuard(const CrashGuard&) = delete;
  CrashGuard& operator=(const CrashGuard&) = delete;
};

}  // namespace solenoid
