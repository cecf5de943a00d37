#pragma once

#include "experiments/rig/node/hardware.hpp"
#include "experiments/rig/node/packet.hpp"

#include <array>
#include <cstdint>

namespace solenoid {

/// A converter's input: microvolts = offset + counts * scale / 2^16.
struct NodeInput {
  std::int32_t offset_microvolts = 0;
  std::int32_t scale = 1 << 16;  ///< microvolts of 2^16 counts

  /// Of the mean of some conversions, to the nearest microvolt.
  std::int32_t microvolts(std::int64_t sum_of_counts, std::uint32_t conversions) const noexcept;
};

/// How a node samples.
struct SamplerSettings {
  std::uint32_t period_us = 1000;  ///< of its samples
  std::uint32_t conversions = 8;   ///< averaged for one, evenly over the period; at most most_conversions
};

/// The inputs, oversampled: conversions of all channels evenly in time, and of the newest N of them the mean,
///
///     y = 1/N sum_{i < N} u(t - i T/N),    |H(f)| = |sin(pi f T) / (N sin(pi f T/N))|,    delay (N - 1) T / 2N
///
/// whose time is the mean of theirs: so a sample says to the microsecond when it was measured, whenever it is asked for.
/// A board that comes too late to convert has fewer in its mean, none of them older than 3 T/2 before the newest. With
/// N = 1 nothing is converted until a sample is asked for, and then at once.
class Sampler {
 public:
  static constexpr std::uint32_t most_conversions = 16;

  /// Sums of each channel's counts over so many conversions, and the mean of their times.
  struct Sample {
    std::uint64_t time_us = 0;
    std::uint32_t conversions = 1;
    std::array<std::int64_t, most_node_channels> sums{};
  };

  Sampler(const SamplerSettings& settings, std::size_t channels) noexcept;

  /// Converts if it is time; conversions that were missed are not made up for.
  void poll(NodeHardware& board, std::uint64_t now_us) noexcept;
  /// The newest sample.
  Sample newest(NodeHardware& board, std::uint64_t now_us) noexcept;
  /// Forgets the conversions so far: what comes next has nothing to do with them.
  void forget() noexcept { taken_ = 0; }
  /// When the next conversion is due [us]; never, if there is one a sample.
  std::uint64_t due_us() const noexcept { return conversions_ > 1 ? due_us_ : ~std::uint64_t{0}; }

 private:
  void convert(NodeHardware& board, std::uint64_t now_us) noexcept;

  std::uint32_t conversions_, spacing_us_;
  std::size_t channels_;
  std::uint64_t due_us_ = 0;
  std::uint32_t taken_ = 0;  // so many of the ring are there, up to the newest
  std::uint32_t newest_ = 0;
  std::array<std::array<std::int32_t, most_node_channels>, most_conversions> counts_{};
  std::array<std::uint64_t, most_conversions> times_us_{};
};

}  // namespace solenoid
