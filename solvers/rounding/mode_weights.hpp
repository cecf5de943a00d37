#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace solenoid {

/// Relaxed mode choices on a grid: in interval k of length dt[k] mode m has the share a[k][m] of the time.
///
/// shapes   dt: K, any positive lengths in any unit    weight: K * modes, row k first
/// a row is nonnegative and sums to one (SOS1); normalise() makes it so
struct ModeWeights {
  int modes = 0;
  std::vector<double> dt;
  std::vector<double> weight;

  ModeWeights() = default;
  ModeWeights(int mode_count, std::vector<double> lengths)
      : modes(mode_count), dt(std::move(lengths)), weight(dt.size() * static_cast<std::size_t>(modes)) {}

  std::size_t intervals() const { return dt.size(); }
  double& at(std::size_t k, std::size_t m) { return weight[k * static_cast<std::size_t>(modes) + m]; }
  double at(std::size_t k, std::size_t m) const { return weight[k * static_cast<std::size_t>(modes) + m]; }
  double longest() const noexcept;
};

/// What a solver's tolerance has left: negative weights become zero, rows are scaled to sum one. False if a row holds
/// no positive finite sum; the weights are then not to be rounded.
bool normalise(ModeWeights& weights) noexcept;

/// Whether every row is nonnegative and sums to one within 1e-9, and every length is positive and finite.
bool is_normalised(const ModeWeights& weights) noexcept;

/// The independent judge of a rounding: how far the share of time that a mode has had is ever from what the weights
/// give it,
///
///     max over modes m and times t of | integral_0^t (a_m - omega_m) |                   [theory-rounding.md, eq. 1]
///
/// with omega_m = 1 while modes[k] = m. In the unit of dt. The integral is piecewise linear, so its extremes are at the
/// ends of intervals.
double integral_gap(const ModeWeights& weights, std::span<const int> modes) noexcept;

}  // namespace solenoid
