#include "experiments/systems/actuator/identify/noise.hpp"

#include "core/signal/bessel.hpp"
#include "experiments/systems/actuator/identify/statistics.hpp"
#include "experiments/systems/actuator/twin/twin_sensing.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double noise_memory_s = 0.06;  // of filtered noise, and more

/// Smallest difference between values that occur; 0 if they are all the same.
double converter_step(std::vector<double> values) {
  std::ranges::sort(values);
  double least = 0;
  for (std::size_t i = 1; i < values.size(); ++i) {
    const double gap = values[i] - values[i - 1];
    if (gap > 1e-12 * std::abs(values[i]) && (least == 0 || gap < least)) least = gap;
  }
  return least;
}

Estimate deviation(const std::vector<double>& x, const char* name, const char* unit, double period_s, double memory) {
  const double mean = mean_of(x), step = converter_step(x);
  std::vector<double> square;
  for (const double v : x) square.push_back((v - mean) * (v - mean));
  const double power = std::max(mean_of(square) - step * step / 12, 0.0), sigma = std::sqrt(power);
  const int lags = static_cast<int>(memory / period_s);
  // Of the square root: half the relative error of the mean square.
  const double error = std::sqrt(variance_of_mean(square, lags)) / (2 * std::max(sigma, 1e-300));
  return make_estimate(name, unit, sigma, error, newey_west_freedom(x.size(), lags),
                       fmt::format("{} samples at rest, converter step {:.3g} {}", x.size(), step, unit));
}

}  // namespace

Findings estimate_noise(const Record& r) {
  Findings found;
  for (const Span& span : r.spans) {
    // The pressures of chambers that have just been opened settle first.
    const std::size_t first = span.first + static_cast<std::size_t>(0.5 / r.period_s);
    if (span.label != "rest" || span.last < first + 1000) continue;
    const auto part = [&](const std::vector<double>& v) {
      return std::vector<double>(v.begin() + static_cast<std::ptrdiff_t>(first),
                                 v.begin() + static_cast<std::ptrdiff_t>(span.last));
    };
    found.estimates = {deviation(part(r.position_m), "position_noise_m", "m", r.period_s, 0.005),
                       deviation(part(r.pressure_a_pa), "pressure_a_noise_pa", "Pa", r.period_s, noise_memory_s),
                       deviation(part(r.pressure_b_pa), "pressure_b_noise_pa", "Pa", r.period_s, noise_memory_s)};
    ResidualPlot plot{"noise", "pressure of chamber A at rest", "time [s]", "pressure [kPa]", {}, true};
    const std::vector<double> a = part(r.pressure_a_pa);
    const double mean = mean_of(a);
    for (std::size_t i = 0; i < std::min<std::size_t>(a.size(), 1500); ++i)
      plot.points.push_back({static_cast<double>(i) * r.period_s, 1e-3 * a[i], 1e-3 * mean});
    found.plots.push_back(plot);
    return found;
  }
  return {{}, {}, {"noise: no span labelled 'rest' of more than 1.5 s; nothing estimated"}};
}

double filtered_pressure_sigma_pa(const SensingEffects& s) {
  constexpr double dt = SensingChain::interval_s;
  constexpr int length = 4000;  // of the impulse response: 0.4 s
  std::vector<double> h(length, 0.0);
  if (s.bessel_hz > 0) {
    Bessel8 filter(s.bessel_hz, 1 / dt);
    filter.reset(0.0);
    for (int i = 0; i < length; ++i) h[static_cast<std::size_t>(i)] = filter.step(i == 0 ? 1.0 : 0.0);
  } else {
    h[0] = 1.0;
  }
  // Spikes of `width` intervals and random sign: a renewal process, correlated within a spike only.
  const int width = std::max(1, static_cast<int>(std::lround(s.spike_duration_s / dt)));
  const double begins = s.spike_rate_hz * dt, cycle = width + (1 - begins) / std::max(begins, 1e-300);
  double power = 0;
  for (int lag = 0; lag < width; ++lag) {
    double overlap = 0;
    for (std::size_t i = 0; i + static_cast<std::size_t>(lag) < h.size(); ++i)
      overlap += h[i] * h[i + static_cast<std::size_t>(lag)];
    double covariance = s.spike_pa * s.spike_pa * (width - lag) / cycle;
    if (lag == 0) covariance += s.pressure_sigma_pa * s.pressure_sigma_pa;
    power += (lag == 0 ? 1 : 2) * covariance * overlap;
  }
  return std::sqrt(power);
}

}  // namespace solenoid
