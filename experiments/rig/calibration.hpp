#pragma once

#include "core/rt/io.hpp"
#include "core/safety/plausibility.hpp"
#include "experiments/rig/rig_io.hpp"

#include <memory>
#include <optional>
#include <vector>

namespace solenoid {

class System;
class TableReader;
struct VariantConfig;

/// quantity = offset + gain * volts.
struct LinearChannel {
  double offset = 0.0, gain = 1.0;
  double value(double volts) const { return offset + gain * volts; }
  double volts(double value) const { return (value - offset) / gain; }
};

/// A continuous input's amplifier.
struct LinearOutput : LinearChannel {
  double limit_v = 5.0;  ///< the most it is told, either way
};

/// From volts to a system's quantities and back, in the order of its description.
struct Calibration {
  std::vector<LinearChannel> channels;
  std::vector<LinearOutput> continuous;
  std::vector<std::optional<ChannelNoise>> noise;  ///< of each channel, in its unit, where the file states it
};

inline constexpr int usual_converter_bits = 13;  ///< a MultiQ3's
/// The step of a converter of so many bits over -5..5 V, in the unit of a channel of this gain.
double converter_step(double gain, int bits = usual_converter_bits);

/// Converters of -5..5 V between the rails of each channel and over the range of each continuous input. (The actuator's:
/// -10..110 mm, +-210 kPa gauge, and the amplifier's 1.6 N a volt, thesis (4.10).)
Calibration usual_calibration(const VariantConfig& variant);
/// Table [calibration]: each channel and continuous input by its name, { offset, gain }; of a channel that is watched by
/// its noise noise_v and bits too, of a continuous input NAME_limit_v.
Calibration read_calibration(TableReader& table, const VariantConfig& variant);

/// A RigIo as the control loop's plant. What the controller may take for the truth is what was measured.
class RigPlant final : public Plant {
 public:
  /// Opens the io.
  RigPlant(std::unique_ptr<RigIo> io, const Calibration& calibration, const VariantConfig& variant);
  ~RigPlant() override;

  Measurement read(double time_s) noexcept override;
  void write(const Command& command) noexcept override;
  RigIo& io() { return *io_; }

 private:
  /// Which channel shows a state, if one does.
  struct Shown {
    std::size_t state, channel;
  };
  std::unique_ptr<RigIo> io_;
  Calibration calibration_;
  std::vector<Shown> shown_;
  double tick_s_, last_time_s_ = -1.0;
  int stale_ticks_ = 0;
};

}  // namespace solenoid
