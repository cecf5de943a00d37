// Critical values of one mean and of several against closed forms, and what resamples cannot tell.

#include "experiments/report/max_t.hpp"

#include "tests/experiments/normal_values.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <stdexcept>
#include <utility>

#include <gmock/gmock.h>

namespace solenoid {
namespace {

using test::normal_values;
using Values = std::vector<double>;

double average_of(const Values& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

Values less_mean(Values values) {
  const double mean = average_of(values);
  for (double& value : values) value -= mean;
  return values;
}

Values difference(const Values& a, const Values& b) {
  Values values(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) values[i] = a[i] - b[i];
  return less_mean(std::move(values));
}

std::vector<std::size_t> all_of(std::size_t count) {
  std::vector<std::size_t> list(count);
  std::iota(list.begin(), list.end(), std::size_t{0});
  return list;
}

TEST(MaxT, OfManyNormalValuesIsTheStudentisedRangeAndDunnetts) {
  constexpr std::size_t variants = 16, values = 500;
  std::mt19937_64 random(3);
  std::vector<Values> own;
  for (std::size_t v = 0; v < variants; ++v) own.push_back(normal_values(random, values));
  std::vector<Values> pairs;
  std::vector<std::size_t> with_first;
  for (std::size_t b = 1; b < variants; ++b)
    for (std::size_t a = 0; a < b; ++a) {
      if (a == 0) with_first.push_back(pairs.size());
      pairs.push_back(difference(own[a], own[b]));
    }
  const MaxT found(pairs);
  // Quantiles of infinitely many values: normal, Dunnett's of 15 against one, the studentised range of 16 over root 2.
  EXPECT_NEAR(found.critical(7), 1.960, 0.05);
  EXPECT_NEAR(found.family(with_first).critical(), 2.829, 0.06);
  EXPECT_NEAR(found.family(all_of(pairs.size())).critical(), 3.426, 0.08);
}

TEST(MaxT, OfOneMeanIsThatMeansAndIndependentMeansAreSidaks) {
  std::mt19937_64 random(4);
  std::vector<Values> means;
  means.reserve(20);
  for (int i = 0; i < 20; ++i) means.push_back(less_mean(normal_values(random, 400)));
  const MaxT found(means);
  const std::vector<std::size_t> one = {11};
  EXPECT_EQ(found.family(one).critical(), found.critical(11));
  EXPECT_NEAR(found.family(all_of(20)).critical(), 3.016, 0.08);  // normal quantile at (1 + 0.95^(1/20)) / 2
}

TEST(MaxT, AnIntervalExcludesWhatItsPValueDoes) {
  std::mt19937_64 random(5);
  std::vector<Values> means;
  means.reserve(8);
  for (int i = 0; i < 8; ++i) means.push_back(less_mean(normal_values(random, 12)));
  const MaxT::Family family = MaxT(means).family(all_of(8));
  double last = 1.0;
  for (double t = 0; t < 12; t += 0.01) {
    EXPECT_EQ(family.p(t) <= 0.05, t > family.critical()) << t;
    EXPECT_LE(family.p(t), last);
    last = family.p(t);
  }
  EXPECT_EQ(family.p(0), 1.0);
  EXPECT_GT(family.p(1e9), 0.0);
}

TEST(MaxT, AFamilyLeavesOutWhatWouldTakeItsCriticalValue) {
  // Of k values k - j are one: (1 - j / k)^k of the resamples have none of the others, and an infinite |t|.
  constexpr std::size_t k = 30;
  const auto differs_in = [](std::size_t first, std::size_t j) {
    Values values(k, 0.0);
    for (std::size_t i = 0; i < j; ++i) values[first + i] = 1.0 + static_cast<double>(i);
    return less_mean(std::move(values));
  };
  std::mt19937_64 random(6);
  std::vector<Values> means = {less_mean(normal_values(random, k)), differs_in(0, 1), differs_in(0, 2)};
  for (std::size_t i = 0; i < 9; ++i) means.push_back(differs_in(3 * i, 3));
  const MaxT found(means);
  EXPECT_TRUE(std::isinf(found.critical(1)));
  EXPECT_TRUE(std::isinf(found.critical(2)));
  EXPECT_TRUE(std::isfinite(found.critical(3))) << "0.9^30 = 4.2 %";
  EXPECT_TRUE(std::isinf(found.family(all_of(12)).critical()));

  std::vector<std::size_t> one = {0, 1, 2, 3};
  EXPECT_EQ(found.bounded_family(one).critical(), found.family(std::vector<std::size_t>{0, 3}).critical());
  EXPECT_THAT(one, testing::ElementsAre(0, 3));
  // One of them does no harm, all nine together do: 4.2 % each, mostly of other resamples.
  std::vector<std::size_t> many = all_of(12);
  EXPECT_EQ(found.bounded_family(many).critical(), found.critical(0));
  EXPECT_THAT(many, testing::ElementsAre(0));
  std::vector<std::size_t> none = {1, 2};
  found.bounded_family(none);
  EXPECT_TRUE(none.empty());
}

double normal_probability(double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); }

double normal_quantile(double probability) {
  double low = -10, high = 10;
  for (int i = 0; i < 60; ++i) (normal_probability(0.5 * (low + high)) < probability ? low : high) = 0.5 * (low + high);
  return low;
}

/// Whether the 95 % intervals of a mean by percentiles and by BCa (Efron and Tibshirani 1993, 13.3 and 14.3) have 0.
std::pair<bool, bool> percentiles_have_0(const Values& values, std::mt19937_64& random) {
  const std::size_t k = values.size();
  Values means(MaxT::resamples);
  for (double& mean : means) {
    Values drawn(k);
    for (double& value : drawn) value = values[random() % k];
    mean = average_of(drawn);
  }
  std::ranges::sort(means);
  const double mean = average_of(values), n = static_cast<double>(means.size());
  const auto below = static_cast<double>(std::ranges::lower_bound(means, mean) - means.begin());
  double squares = 0, cubes = 0;  // the mean without a value differs from the mean of these by (value - mean) / (1 - k)
  for (const double value : values) squares += std::pow(value - mean, 2), cubes += std::pow(value - mean, 3);
  const double bias = normal_quantile(below / n), acceleration = cubes / (6 * std::pow(squares, 1.5));
  const auto at = [&](double share) { return means[static_cast<std::size_t>(std::clamp(share * n, 0.0, n - 1))]; };
  const auto bca = [&](double share) {
    const double z = bias + normal_quantile(share);
    return at(normal_probability(bias + z / (1 - acceleration * z)));
  };
  return {at(0.025) <= 0 && 0 <= at(0.975), bca(0.025) <= 0 && 0 <= bca(0.975)};
}

TEST(MaxT, OfTenNormalValuesItCoversWhatPercentilesAndBcaDoNot) {
  constexpr int samples = 400;
  std::mt19937_64 random(14);
  int percentile = 0, bca = 0, studentised = 0;
  for (int sample = 0; sample < samples; ++sample) {
    const Values values = normal_values(random, 10);
    const auto [has, has_bca] = percentiles_have_0(values, random);
    percentile += has;
    bca += has_bca;
    const double mean = average_of(values);
    double squares = 0;
    for (const double value : values) squares += std::pow(value - mean, 2);
    studentised += std::abs(mean) <= MaxT({less_mean(values)}).critical(0) * std::sqrt(squares / 90);
  }
  // What max_t.hpp and reading-a-report.md say, to the per cent.
  EXPECT_NEAR(100.0 * percentile / samples, 88, 0.5);
  EXPECT_NEAR(100.0 * bca / samples, 87, 0.5);
  EXPECT_NEAR(100.0 * studentised / samples, 95, 0.5);
}

TEST(MaxT, WantsFiveValues) { EXPECT_THROW(MaxT({{-1.0, 0.0, 0.5, 0.5}}), std::invalid_argument); }

}  // namespace
}  // namespace solenoid
