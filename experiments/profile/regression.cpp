#include "experiments/profile/regression.hpp"

#include "core/config/reader.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr int resamples = 1000;
constexpr std::size_t lower_rank = 25, upper_rank = 974;  // the middle 95 % of them

double geometric_mean_ratio(const std::vector<double>& now, const std::vector<double>& then,
                            const std::vector<std::size_t>& chosen) {
  double sum = 0;
  for (const std::size_t i : chosen) sum += std::log(now[i] / then[i]);
  return std::exp(sum / static_cast<double>(chosen.size()));
}

double p99_of(const std::vector<double>& times, const std::vector<std::size_t>& chosen) {
  std::vector<double> sample;
  sample.reserve(chosen.size());
  for (const std::size_t i : chosen) sample.push_back(times[i]);
  const std::size_t rank = (99 * sample.size() + 99) / 100 - 1;
  std::nth_element(sample.begin(), sample.begin() + static_cast<std::ptrdiff_t>(rank), sample.end());
  return sample[rank];
}

/// Percentile bootstrap: the same resampled instances on both sides. A seed of its own keeps the verdict repeatable.
template <class Statistic>
RatioInterval bootstrap(std::size_t instances, const Statistic& statistic) {
  std::vector<std::size_t> chosen(instances);
  for (std::size_t i = 0; i < instances; ++i) chosen[i] = i;
  RatioInterval interval;
  interval.ratio = statistic(chosen);
  std::mt19937_64 random(20110131);
  std::uniform_int_distribution<std::size_t> draw(0, instances - 1);
  std::vector<double> all;
  for (int r = 0; r < resamples; ++r) {
    for (std::size_t& i : chosen) i = draw(random);
    all.push_back(statistic(chosen));
  }
  std::sort(all.begin(), all.end());
  interval.low = all[lower_rank];
  interval.high = all[upper_rank];
  return interval;
}

VariantChange change_of(const VariantProfile& now, const VariantProfile& then, double threshold) {
  VariantChange c;
  c.name = now.name;
  const std::size_t n = now.solve_us.size();
  c.typical =
      bootstrap(n, [&](const auto& chosen) { return geometric_mean_ratio(now.solve_us, then.solve_us, chosen); });
  c.tail =
      bootstrap(n, [&](const auto& chosen) { return p99_of(now.solve_us, chosen) / p99_of(then.solve_us, chosen); });
  c.slower = c.typical.low > threshold || c.tail.low > threshold;
  return c;
}

}  // namespace

bool ProfileChange::slower() const {
  return std::any_of(variants.begin(), variants.end(), [](const VariantChange& c) { return c.slower; });
}

ProfileChange compare_profiles(const Profile& now, const Profile& then, const std::string& then_name,
                               double threshold) {
  ProfileChange change;
  const auto find = [](const Profile& in, const std::string& name) {
    return std::find_if(in.variants.begin(), in.variants.end(), [&](auto& v) { return v.name == name; });
  };
  for (const VariantProfile& v : now.variants) {
    const auto old = find(then, v.name);
    if (old == then.variants.end()) {
      change.only_now.push_back(v.name);
      continue;
    }
    if (old->fingerprint != v.fingerprint || old->solve_us.size() != v.solve_us.size() || v.solve_us.empty())
      throw ConfigError(
          fmt::format("{}: variant '{}': a profile of other instances (allowed: one of the same instance "
                      "file, or of a campaign that records the same)",
                      then_name, v.name));
    change.variants.push_back(change_of(v, *old, threshold));
  }
  for (const VariantProfile& v : then.variants)
    if (find(now, v.name) == now.variants.end()) change.only_then.push_back(v.name);
  if (change.variants.empty())
    throw ConfigError(fmt::format("{}: no variant in common (allowed: a profile with at least one)", then_name));
  return change;
}

}  // namespace solenoid
