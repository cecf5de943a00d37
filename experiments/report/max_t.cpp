#include "experiments/report/max_t.hpp"

#include "solvers/sampling/categorical.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <stdexcept>

#include <Eigen/Core>

namespace solenoid {
namespace {

constexpr Eigen::Index block = 250;  // resamples at once: their draws stay in the cache
static_assert(MaxT::resamples % block == 0);

/// How often each of `values` values is drawn in each of `block` resamples.
Eigen::MatrixXf counts_of(RandomBits& draws, Eigen::Index values) {
  Eigen::MatrixXf counts = Eigen::MatrixXf::Zero(values, block);
  for (Eigen::Index b = 0; b < block; ++b)
    for (Eigen::Index i = 0; i < values; ++i) counts(draws.below(static_cast<std::uint32_t>(values)), b) += 1.0f;
  return counts;
}

/// |t| of sums of drawn values and of their squares; these are centred and of length 1.
float t_of(float sum, float squares, float values) {
  const float spread = squares - sum * sum / values;
  if (spread > 1e-6f * squares) return std::abs(sum) / std::sqrt(spread * values / (values - 1));
  return std::abs(sum) > 1e-6f ? std::numeric_limits<float>::infinity() : 0.0f;
}

/// Place of the least number that 95 % of the resamples, and it, do not exceed.
constexpr std::size_t place = (19 * (MaxT::resamples + 1) + 19) / 20 - 1;

}  // namespace

MaxT::MaxT(const std::vector<std::vector<double>>& centred)
    : t_(centred.size(), std::vector<float>(resamples)), unbounded_(centred.size()) {
  std::map<std::size_t, std::vector<std::size_t>> of_size;
  for (std::size_t mean = 0; mean < centred.size(); ++mean) of_size[centred[mean].size()].push_back(mean);
  for (const auto& [size, means] : of_size) {
    if (size < least_values) throw std::invalid_argument("too few values to resample");
    const auto values = static_cast<Eigen::Index>(size), columns = static_cast<Eigen::Index>(means.size());
    Eigen::MatrixXf both(2 * columns, values);  // values, and their squares below
    for (Eigen::Index c = 0; c < columns; ++c) {
      const auto own = Eigen::Map<const Eigen::RowVectorXd>(centred[means[static_cast<std::size_t>(c)]].data(), values);
      both.row(c) = own.normalized().cast<float>();
      both.row(columns + c) = both.row(c).cwiseAbs2();
    }
    RandomBits draws(20260522);
    for (Eigen::Index first = 0; first < static_cast<Eigen::Index>(resamples); first += block) {
      const Eigen::MatrixXf sums = both * counts_of(draws, values);
      for (Eigen::Index c = 0; c < columns; ++c)
        for (Eigen::Index b = 0; b < block; ++b)
          t_[means[static_cast<std::size_t>(c)]][static_cast<std::size_t>(first + b)] =
              t_of(sums(c, b), sums(columns + c, b), static_cast<float>(values));
    }
  }
  for (std::size_t mean = 0; mean < t_.size(); ++mean)
    unbounded_[mean] = static_cast<std::size_t>(std::ranges::count(t_[mean], std::numeric_limits<float>::infinity()));
}

double MaxT::critical(std::size_t mean) const {
  std::vector<float> t = t_[mean];
  const auto at = t.begin() + static_cast<std::ptrdiff_t>(place);
  std::ranges::nth_element(t, at);
  return static_cast<double>(*at);
}

MaxT::Family::Family(std::vector<float> largest) : largest_(std::move(largest)) { std::ranges::sort(largest_); }

double MaxT::Family::critical() const { return static_cast<double>(largest_[place]); }

double MaxT::Family::p(double t) const {
  const auto below = std::ranges::lower_bound(largest_, t, {}, [](float own) { return static_cast<double>(own); });
  return static_cast<double>(1 + (largest_.end() - below)) / static_cast<double>(1 + largest_.size());
}

MaxT::Family MaxT::family(std::span<const std::size_t> means) const {
  std::vector<float> largest(resamples, 0.0f);
  for (const std::size_t mean : means)
    for (std::size_t b = 0; b < resamples; ++b) largest[b] = std::max(largest[b], t_[mean][b]);
  return Family(std::move(largest));
}

MaxT::Family MaxT::bounded_family(std::vector<std::size_t>& means) const {
  for (std::size_t most = resamples - 1 - place;; most /= 2) {
    std::erase_if(means, [&](std::size_t mean) { return unbounded_[mean] > most; });
    Family found = family(means);
    if (std::isfinite(found.critical())) return found;  // at the latest of those without any
  }
}

}  // namespace solenoid
