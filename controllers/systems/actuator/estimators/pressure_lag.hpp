#pragma once

#include "core/signal/bessel.hpp"

#include <array>
#include <cmath>

#include <Eigen/Core>

namespace solenoid {

/// The hardware Bessel filter of one pressure channel as a state: exact, all eight orders, in modal coordinates.
///
///     H(s) = 2 Re sum_i c_i (-p_i) / (s - p_i)
///     z_i+ = e_i z_i + b0_i P + b1_i P+,     P_filtered = 2 Re sum_i c_i z_i
///
/// exact for a pressure that moves linearly within a tick (first-order hold): e_i = exp(p_i dt). At rest z_i = P.
/// shapes   a lag holds (Re z_0, Im z_0, .., Re z_3, Im z_3); a row of anything linear in it is propagated the same
/// way, so one formula serves mean, covariance and sensitivities.
class PressureLag {
 public:
  static constexpr int size = 8, modes = 4;

  PressureLag(double cutoff_hz, double dt) {
    const auto unit = Bessel8::poles();
    const double per_delay = 2 * std::numbers::pi * cutoff_hz / Bessel8::delay_times_cutoff_rad;
    std::complex<double> product = 1.0;
    for (const auto& p : unit) product *= std::norm(p);
    for (std::size_t i = 0; i < modes; ++i) {
      std::complex<double> others = unit[i] - std::conj(unit[i]);
      for (std::size_t j = 0; j < modes; ++j)
        if (j != i) others *= (unit[i] - unit[j]) * (unit[i] - std::conj(unit[j]));
      const std::complex<double> p = unit[i] * per_delay, e = std::exp(p * dt);
      decay_[i] = e;
      late_[i] = -(e - 1.0 - p * dt) / (p * dt);
      early_[i] = -(e - 1.0) - late_[i];
      residue_[i] = 2.0 * product / others / -unit[i];
    }
  }

  /// Rows of a lag, `width` numbers each, from those of the pressure before (p0) and after (p1) a tick.
  template <int width>
  void advance(double* z, const double* p0, const double* p1) const {
    using Row = Eigen::Array<double, width, 1>;
    const Eigen::Map<const Row> before(p0), after(p1);
    for (std::size_t i = 0; i < modes; ++i) {
      Eigen::Map<Row> re(z + 2 * i * width), im(z + (2 * i + 1) * width);
      const Row turned = decay_[i].imag() * re + decay_[i].real() * im;
      re = decay_[i].real() * re - decay_[i].imag() * im + early_[i].real() * before + late_[i].real() * after;
      im = turned + early_[i].imag() * before + late_[i].imag() * after;
    }
  }

  /// The output's weights on the eight numbers of a lag.
  std::array<double, size> output() const {
    std::array<double, size> c{};
    for (std::size_t i = 0; i < modes; ++i) c[2 * i] = residue_[i].real(), c[2 * i + 1] = -residue_[i].imag();
    return c;
  }
  /// What a unit of pressure at the end of a tick adds to the eight numbers.
  std::array<double, size> late_gain() const { return pairs(late_); }
  /// What a unit of pressure before and after a tick, and so noise held over it, adds to the eight numbers.
  std::array<double, size> held_gain() const {
    auto both = pairs(late_);
    const auto early = pairs(early_);
    for (std::size_t i = 0; i < size; ++i) both[i] += early[i];
    return both;
  }

 private:
  using Modes = std::array<std::complex<double>, modes>;
  static std::array<double, size> pairs(const Modes& m) {
    std::array<double, size> flat{};
    for (std::size_t i = 0; i < modes; ++i) flat[2 * i] = m[i].real(), flat[2 * i + 1] = m[i].imag();
    return flat;
  }
  Modes decay_, early_, late_, residue_;
};

}  // namespace solenoid
