#include "experiments/systems/actuator/identify/residual.hpp"

#include "core/config/reader.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double bend_m_s = 0.01;        // below, the velocity's coordinate is all but linear
constexpr double slowest_m_s = 2e-3;     // of residual_samples(); from here to rest the force goes to zero in a line
constexpr std::size_t branch_knots = 6;  // of a direction of motion
constexpr double fade = 0.15;            // beyond the data, of their range, to zero
constexpr double kept_sample_s = 0.02;   // of residual_samples()
constexpr std::size_t fewest_kept = 60, fewest_each_way = 15, most_kept = 1200, most_for_search = 600;
constexpr double payload_sigma_kg = 0.3;
constexpr double least_gain = 3.0;  // in log likelihood, for a residual to be worth having
constexpr double least_trust = 0.05;
constexpr std::size_t fold = 5, fold_samples = 50;  // a second of residual_samples() in five is held out

using Samples = std::vector<ResidualSample>;

/// Samples of several logs in a row, and which log each is of: each has a payload of its own.
struct Pooled {
  Samples samples;
  std::vector<std::size_t> log;
  std::size_t logs = 0;
};

GpCoordinate velocity_coordinate(double v) { return {std::asinh(std::abs(v) / bend_m_s), v > 0 ? 1 : -1}; }
double velocity_at(double z) { return bend_m_s * std::sinh(z); }

GpData data_of(const Pooled& pooled, bool velocity) {
  const Samples& samples = pooled.samples;
  GpData data;
  const auto n = static_cast<Eigen::Index>(samples.size());
  data.target.resize(n);
  data.linear.setZero(n, static_cast<Eigen::Index>(pooled.logs));
  std::vector<GpCoordinate> v;
  for (Eigen::Index i = 0; i < n; ++i) {
    const ResidualSample& s = samples[static_cast<std::size_t>(i)];
    data.target[i] = s.force_n;
    data.linear(i, static_cast<Eigen::Index>(pooled.log[static_cast<std::size_t>(i)])) =
        payload_sigma_kg * s.per_payload;
    v.push_back(velocity_coordinate(s.velocity_m_s));
  }
  if (velocity) data.shares.push_back(std::move(v));
  return data;
}

/// Every so many of them, evenly.
std::vector<std::size_t> thinned(std::size_t n, std::size_t most) {
  const std::size_t every = (n + most - 1) / most;
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < n; i += every) chosen.push_back(i);
  return chosen;
}

/// Of the samples that the search looks at.
GpHyper found_for(const GpData& data) {
  GpHyper start{{}, 0.5};
  if (!data.shares.empty()) start.shares.push_back({1.0, 1.0});
  return most_likely(data.part(thinned(static_cast<std::size_t>(data.size()), most_for_search)), start);
}

/// Knots of one branch with what is found at them.
void add_knots(ResidualShare& share, const GaussianProcess& process, const std::vector<double>& at) {
  for (const double x : at) {
    const GpValue found = process.share(0, velocity_coordinate(x));
    const double trust = 1.0 - found.variance / (share.kernel.sigma * share.kernel.sigma);
    share.knots.push_back(x);
    share.found.push_back(found);
    share.trust.push_back(trust < least_trust ? 0.0 : trust);
  }
}
void add_zero(ResidualShare& share, double at) {
  share.knots.push_back(at);
  share.found.push_back({0.0, share.kernel.sigma * share.kernel.sigma});
  share.trust.push_back(0.0);
}
void make_hats(ResidualShare& share) {
  std::vector<double> values;
  for (std::size_t i = 0; i < share.knots.size(); ++i) values.push_back(share.found[i].mean * share.trust[i]);
  share.hats = HatSum(share.knots, values);
}

/// The greatest speed of a direction.
double fastest_of(const Samples& samples, int branch) {
  double fastest = 0.0;
  for (const ResidualSample& s : samples) fastest = std::max(fastest, branch * s.velocity_m_s);
  return fastest;
}

/// Knots of one direction from slow to fast.
std::vector<double> knots_of_branch(const Samples& samples, int branch) {
  std::vector<double> knots;
  const double first = velocity_coordinate(slowest_m_s).z, last = velocity_coordinate(fastest_of(samples, branch)).z;
  for (std::size_t i = 0; i < branch_knots; ++i)
    knots.push_back(velocity_at(first + (last - first) * static_cast<double>(i) / (branch_knots - 1.0)));
  return knots;
}

ResidualShare velocity_share(const Samples& samples, const GaussianProcess& process, const GpKernel& kernel) {
  ResidualShare share;
  share.kernel = kernel;
  std::vector<double> back = knots_of_branch(samples, -1);
  const std::vector<double> forth = knots_of_branch(samples, 1);
  std::ranges::reverse(back);
  for (double& v : back) v = -v;
  add_zero(share, (1.0 + fade) * back.front());
  add_knots(share, process, back);
  add_zero(share, 0.0);
  add_knots(share, process, forth);
  add_zero(share, (1.0 + fade) * forth.back());
  make_hats(share);
  return share;
}

/// What the held-out samples say of a fit to the others; nothing where there are none.
std::optional<HeldOutForce> judged(const GpData& data, const GpData& bare, const GpHyper& hyper,
                                   const GpHyper& bare_hyper, const std::vector<std::size_t>& kept,
                                   const std::vector<std::size_t>& held) {
  if (held.empty() || kept.empty()) return std::nullopt;
  const GaussianProcess with(data.part(kept), hyper), without(bare.part(kept), bare_hyper);
  double squares_with = 0.0, squares_without = 0.0, inside = 0.0;
  for (const std::size_t at : held) {
    const auto i = static_cast<Eigen::Index>(at);
    const GpValue a = with.predicted(data, i), b = without.predicted(bare, i);
    const double error = data.target[i] - a.mean;
    squares_with += error * error;
    squares_without += (data.target[i] - b.mean) * (data.target[i] - b.mean);
    inside += std::abs(error) <= 1.96 * std::sqrt(a.variance) ? 1.0 : 0.0;
  }
  const auto n = static_cast<double>(held.size());
  return HeldOutForce{held.size(), std::sqrt(squares_without / n), std::sqrt(squares_with / n), inside / n};
}

/// Enough motion, and to and fro.
void require_motion(const std::vector<Samples>& logs) {
  Samples all;
  for (const Samples& log : logs) all.insert(all.end(), log.begin(), log.end());
  const auto seconds = [](std::size_t samples) { return kept_sample_s * static_cast<double>(samples); };
  if (all.size() < fewest_kept)
    throw ConfigError(
        fmt::format("the slide moves for {:.1f} s in these logs (allowed: {:.1f} s and more, faster than "
                    "2 mm/s)",
                    seconds(all.size()), seconds(fewest_kept)));
  for (const int branch : {-1, 1}) {
    const auto n = static_cast<std::size_t>(
        std::ranges::count_if(all, [branch](const ResidualSample& s) { return branch * s.velocity_m_s > 0.0; }));
    if (n < fewest_each_way || fastest_of(all, branch) < 2 * slowest_m_s)
      throw ConfigError(
          fmt::format("the slide moves {} for {:.2f} s in these logs, and motion one way does not tell friction from "
                      "gravity and payload (allowed: motion to and fro, {:.1f} s and more each way, faster than "
                      "{:.0f} mm/s)",
                      branch > 0 ? "forth" : "back", seconds(n), seconds(fewest_each_way), 2e3 * slowest_m_s));
  }
}

void take_ranges(const Samples& samples, ResidualFinding& found) {
  const auto [slow, fast] = std::ranges::minmax(samples, {}, &ResidualSample::velocity_m_s);
  const auto [low, high] = std::ranges::minmax(samples, {}, &ResidualSample::position_m);
  found.velocity_range_m_s = {slow.velocity_m_s, fast.velocity_m_s};
  found.position_range_m = {low.position_m, high.position_m};
}

}  // namespace

ForceResidual ResidualFinding::residual() const { return {velocity.hats, {}}; }

ResidualFinding identify_residual(const std::vector<std::vector<ResidualSample>>& logs) {
  require_motion(logs);
  Pooled pooled;
  pooled.logs = logs.size();
  Samples& samples = pooled.samples;
  std::vector<std::size_t> kept, held;
  std::size_t total = 0;
  for (const Samples& log : logs) total += log.size();
  for (std::size_t l = 0; l < logs.size(); ++l)
    for (const std::size_t i : thinned(logs[l].size(), std::max<std::size_t>(1, most_kept * logs[l].size() / total))) {
      (i / fold_samples % fold == fold - 1 ? held : kept).push_back(samples.size());
      samples.push_back(logs[l][i]);
      pooled.log.push_back(l);
    }
  const GpData bare = data_of(pooled, false), data = data_of(pooled, true);
  const GpHyper bare_hyper = found_for(bare), hyper = found_for(data);
  const GaussianProcess process(data, hyper);
  ResidualFinding found;
  found.samples = samples.size();
  found.without_residual = GaussianProcess(bare, bare_hyper).log_likelihood();
  found.log_likelihood = process.log_likelihood();
  if (found.log_likelihood < found.without_residual + least_gain)
    throw ConfigError(
        fmt::format("nothing to learn: the force that is left is as likely noise (log likelihood {:.1f}, "
                    "with a residual {:.1f})",
                    found.without_residual, found.log_likelihood));
  found.held_out = judged(data, bare, hyper, bare_hyper, kept, held);
  take_ranges(samples, found);
  found.noise_n = hyper.noise;
  for (std::size_t l = 0; l < logs.size(); ++l) {
    const GpValue payload = process.weight(static_cast<Eigen::Index>(l));
    found.payload_kg.push_back(
        {payload_sigma_kg * payload.mean, payload_sigma_kg * payload_sigma_kg * payload.variance});
  }
  found.velocity = velocity_share(samples, process, hyper.shares[0]);
  found.drawn = samples;
  for (std::size_t i = 0; i < samples.size(); ++i)
    found.drawn[i].force_n -= found.payload_kg[pooled.log[i]].mean * samples[i].per_payload;
  return found;
}

}  // namespace solenoid
