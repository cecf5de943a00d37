#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace solenoid {

/// States a system may have at most, and so on below: records of a tick are arrays of these lengths, so that a tick allocates nothing and
/// loop, recorder, log and metrics are compiled once for every system. Entries beyond a system's own stay zero.
inline constexpr std::size_t max_states = 12;
/// Measured channels.
inline constexpr std::size_t max_channels = 6;
/// Continuous inputs.
inline constexpr std::size_t max_continuous = 4;
/// Axes: what a task gives a desired motion.
inline constexpr std::size_t max_axes = 4;
/// What an estimator believes beyond the state.
inline constexpr std::size_t max_beliefs = 8;

/// Values of a system's states, in the order of its description.
using StateValues = std::array<double, max_states>;
/// Of its measured channels.
using ChannelValues = std::array<double, max_channels>;
/// Of its continuous inputs.
using ContinuousValues = std::array<double, max_continuous>;
/// Of its axes: what a task gives a desired motion.
using AxisValues = std::array<double, max_axes>;

/// The first `size` of a record's values, as a model has them.
template <std::size_t size, std::size_t capacity>
constexpr std::array<double, size> first(const std::array<double, capacity>& values) noexcept {
  static_assert(size <= capacity);
  std::array<double, size> own{};
  std::copy_n(values.begin(), size, own.begin());
  return own;
}

/// A model's values as a record has them.
template <std::size_t capacity, std::size_t size>
constexpr std::array<double, capacity> padded(const std::array<double, size>& own) noexcept {
  static_assert(size <= capacity);
  std::array<double, capacity> values{};
  std::copy_n(own.begin(), size, values.begin());
  return values;
}

}  // namespace solenoid
