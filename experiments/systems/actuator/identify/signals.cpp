#include "experiments/systems/actuator/identify/signals.hpp"

#include "core/signal/bessel.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace solenoid {
namespace {

constexpr int substeps = 4;

/// Samples of the kernel, normalised so that constants, straight lines and parabolas come out exactly.
std::vector<double> kernel(double period_s, double width_s, int derivative) {
  const int half = static_cast<int>(std::ceil(4.5 * width_s / period_s));
  std::vector<double> k;
  double sum = 0, slope = 0, curve = 0, centre = 0;
  for (int i = -half; i <= half; ++i) {
    const double t = i * period_s, u = t / width_s, g = std::exp(-u * u / 2);
    k.push_back(derivative == 0 ? g : derivative == 1 ? -u * g : (u * u - 1) * g);
    sum += k.back();
    centre += g;
  }
  // A second derivative must not see a constant: take its mean away, weighted as the Gaussian.
  for (int i = -half; i <= half && derivative == 2; ++i) {
    const double u = i * period_s / width_s;
    k[static_cast<std::size_t>(i + half)] -= sum / centre * std::exp(-u * u / 2);
  }
  for (int i = -half; i <= half; ++i) {
    const double t = i * period_s, w = k[static_cast<std::size_t>(i + half)];
    slope -= w * t;
    curve += w * t * t / 2;
  }
  const double scale = derivative == 0 ? sum : derivative == 1 ? slope : curve;
  for (double& w : k) w /= scale;
  return k;
}

std::vector<double> convolved(const std::vector<double>& signal, const std::vector<double>& k) {
  const auto half = static_cast<std::ptrdiff_t>(k.size() / 2), n = static_cast<std::ptrdiff_t>(signal.size());
  std::vector<double> out(signal.size());
  for (std::ptrdiff_t t = 0; t < n; ++t) {
    double sum = 0;
    for (std::ptrdiff_t i = -half; i <= half; ++i)
      sum += k[static_cast<std::size_t>(i + half)] *
             signal[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(t - i, 0, n - 1))];
    out[static_cast<std::size_t>(t)] = sum;
  }
  return out;
}

/// Replaces [first, last) by its least-squares line.
void straighten(const std::vector<double>& signal, std::size_t first, std::size_t last, std::vector<double>& out) {
  const double n = static_cast<double>(last - first), middle = (n - 1) / 2;
  double mean = 0, slope = 0;
  for (std::size_t t = first; t < last; ++t) {
    mean += signal[t] / n;
    slope += signal[t] * (static_cast<double>(t - first) - middle) * 12 / (n * (n * n - 1));
  }
  for (std::size_t t = first; t < last; ++t) out[t] = mean + slope * (static_cast<double>(t - first) - middle);
}

}  // namespace

std::vector<double> quiet_position(const std::vector<double>& position_m, double period_s) {
  constexpr double width_s = 0.008, rest_m_s = 0.5e-3, shortest_s = 0.08, margin_s = 0.04;
  std::vector<double> k = kernel(period_s, width_s, 0);
  const auto half = static_cast<int>(k.size() / 2);
  double sum = 0;
  for (int i = -half; i <= half; ++i) {
    const double u = i * period_s / width_s;
    sum += k[static_cast<std::size_t>(i + half)] *= (3 - u * u) / 2;
  }
  for (double& w : k) w /= sum;
  std::vector<double> out = convolved(position_m, k);
  const std::vector<double> v = gaussian(position_m, period_s, 0.02, 1);
  const auto shortest = static_cast<std::size_t>(shortest_s / period_s);
  const auto margin = static_cast<std::size_t>(margin_s / period_s);
  for (std::size_t t = 0; t < v.size(); ++t) {
    const std::size_t first = t;
    while (t < v.size() && std::abs(v[t]) < rest_m_s) ++t;
    if (t - first > shortest + 2 * margin) straighten(position_m, first + margin, t - margin, out);
  }
  return out;
}

std::vector<double> gaussian(const std::vector<double>& signal, double period_s, double width_s, int derivative) {
  return convolved(signal, kernel(period_s, width_s, derivative));
}

double bessel_cutoff_hz(double delay_s) { return Bessel8::delay_times_cutoff_rad / (2 * std::numbers::pi * delay_s); }

std::vector<double> through_bessel(const std::vector<double>& signal, double period_s, double delay_s,
                                   Between between) {
  Bessel8 filter(bessel_cutoff_hz(delay_s), substeps / period_s);
  std::vector<double> out(signal.size());
  if (signal.empty()) return out;
  filter.reset(signal[0]);
  out[0] = signal[0];
  for (std::size_t t = 1; t < signal.size(); ++t)
    for (int i = 1; i <= substeps; ++i) {
      const double share = static_cast<double>(i) / substeps;
      const double straight = signal[t - 1] + share * (signal[t] - signal[t - 1]);
      // A held value jumps at the end of its period: the bilinear filter's trapezium takes the mean there.
      const double held = i < substeps ? signal[t - 1] : (signal[t - 1] + signal[t]) / 2;
      out[t] = filter.step(between == Between::held ? held : straight);
    }
  return out;
}

}  // namespace solenoid
