#include "experiments/campaign/sampling.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

namespace solenoid::test {
namespace {

std::vector<std::vector<double>> all_points(const Sampler& sampler) {
  std::vector<std::vector<double>> points(sampler.points());
  for (std::size_t k = 0; k < points.size(); ++k) points[k] = sampler.at(k);
  return points;
}

double correlation(const std::vector<double>& x, const std::vector<double>& y) {
  double sum = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += (x[i] - 0.5) * (y[i] - 0.5);
  return 12.0 * sum / static_cast<double>(x.size());
}

std::vector<double> coordinate(const Sampler& sampler, std::size_t dimension) {
  std::vector<double> values;
  for (std::size_t k = 0; k < sampler.points(); ++k) values.push_back(sampler.at(k)[dimension]);
  return values;
}

TEST(Sobol, HasThePublishedPoints) {
  // As the program of Joe and Kuo prints them, and of the last two dimensions as SciPy 1.10 has them.
  const double published[16][4] = {
      {0, 0, 0, 0},
      {0.5, 0.5, 0.5, 0.5},
      {0.75, 0.25, 0.25, 0.25},
      {0.25, 0.75, 0.75, 0.75},
      {0.375, 0.375, 0.625, 0.875},
      {0.875, 0.875, 0.125, 0.375},
      {0.625, 0.125, 0.875, 0.625},
      {0.125, 0.625, 0.375, 0.125},
      {0.1875, 0.3125, 0.9375, 0.4375},
      {0.6875, 0.8125, 0.4375, 0.9375},
      {0.9375, 0.0625, 0.6875, 0.1875},
      {0.4375, 0.5625, 0.1875, 0.6875},
      {0.3125, 0.1875, 0.3125, 0.5625},
      {0.8125, 0.6875, 0.8125, 0.0625},
      {0.5625, 0.4375, 0.0625, 0.8125},
      {0.0625, 0.9375, 0.5625, 0.3125},
  };
  const auto directions = sobol_directions(7);
  for (std::size_t k = 0; k < 16; ++k)
    for (std::size_t d = 0; d < 4; ++d)
      EXPECT_EQ(sobol_digits(&directions[32 * d], k) * 0x1p-32, published[k][d]) << k << ", " << d;
  const double later[7] = {0.2197265625, 0.0966796875, 0.5185546875, 0.6767578125,
                           0.2802734375, 0.9072265625, 0.0458984375};
  for (std::size_t d = 0; d < 7; ++d) EXPECT_EQ(sobol_digits(&directions[32 * d], 1000) * 0x1p-32, later[d]) << d;
}

TEST(Sobol, EveryPrefixHasAPointInEachSliceOfEachDimension) {
  for (const std::uint64_t seed : {1, 2, 77}) {
    const auto points = all_points({Sampling::sobol, seed, 9, 4096});
    for (std::size_t n = 1; n <= 4096; n *= 2)
      for (std::size_t d = 0; d < 9; ++d) {
        std::set<int> slices;
        for (std::size_t k = 0; k < n; ++k)
          slices.insert(static_cast<int>(std::floor(static_cast<double>(n) * points[k][d])));
        EXPECT_EQ(slices.size(), n) << "seed " << seed << ", dimension " << d;
        EXPECT_EQ(*slices.rbegin(), static_cast<int>(n) - 1);
      }
  }
}

TEST(Sobol, EveryPrefixIsANetInTheFirstTwoDimensions) {
  for (const std::uint64_t seed : {1, 5}) {
    const auto points = all_points({Sampling::sobol, seed, 2, 1024});
    for (int m = 0; m <= 10; ++m)
      for (int across = 0; across <= m; ++across) {  // boxes of 2^-across by 2^-(m - across)
        std::set<std::pair<int, int>> boxes;
        for (std::size_t k = 0; k < std::size_t{1} << m; ++k)
          boxes.emplace(static_cast<int>(std::ldexp(points[k][0], across)),
                        static_cast<int>(std::ldexp(points[k][1], m - across)));
        EXPECT_EQ(boxes.size(), std::size_t{1} << m) << "2^" << m << ", 2^" << across << " across";
      }
  }
}

TEST(Sobol, AMemberDoesNotDependOnHowManyThereAre) {
  const Sampler few(Sampling::sobol, 3, 7, 10), many(Sampling::sobol, 3, 7, Sampler::most_points);
  for (std::size_t k = 0; k < 10; ++k) EXPECT_EQ(few.at(k), many.at(k));
}

TEST(Sobol, IsScrambledAnewForEachSeedAndDimension) {
  // The same point under 4000 seeds is uniform: mean and variance, and no two places alike.
  constexpr std::uint64_t seeds = 4000;
  for (const std::size_t point : {std::size_t{0}, std::size_t{1}, std::size_t{12345}})
    for (const std::size_t dimension : {std::size_t{0}, std::size_t{6}}) {
      double sum = 0.0, squares = 0.0;
      std::set<double> places;
      for (std::uint64_t seed = 0; seed < seeds; ++seed) {
        const double x = Sampler(Sampling::sobol, seed, 7, 20000).at(point)[dimension];
        sum += x, squares += x * x;
        places.insert(x);
      }
      const double mean = sum / seeds;
      EXPECT_NEAR(mean, 0.5, 4 * std::sqrt(1.0 / 12 / seeds));
      EXPECT_NEAR(squares / seeds - mean * mean, 1.0 / 12, 4 * std::sqrt(1.0 / 180 / seeds));
      EXPECT_GT(places.size(), seeds - 5);
    }
}

TEST(LatinHypercube, HasOneMemberInEachSlice) {
  for (const std::size_t n : {1, 2, 3, 7, 997, 1000, 65537}) {
    const Sampler sampler(Sampling::latin_hypercube, 11, 3, n);
    for (std::size_t d = 0; d < 3; ++d) {
      std::vector<int> members(n, 0);
      for (const double x : coordinate(sampler, d)) {
        ASSERT_GE(x, 0.0);
        ASSERT_LT(x, 1.0);
        ++members[static_cast<std::size_t>(x * static_cast<double>(n))];
      }
      EXPECT_EQ(std::ranges::count(members, 1), static_cast<std::ptrdiff_t>(n)) << n << ", dimension " << d;
    }
  }
}

TEST(LatinHypercube, NoRoundingCarriesAPointIntoAnotherSlice) {
  constexpr std::size_t n = Sampler::most_points;
  const Sampler sampler(Sampling::latin_hypercube, 1, 1, n);
  std::vector<bool> taken(n, false);
  for (std::size_t k = 0; k < n; ++k) {
    const auto slice = static_cast<std::size_t>(sampler.at(k)[0] * static_cast<double>(n));
    ASSERT_LT(slice, n);
    ASSERT_FALSE(taken[slice]) << k;
    taken[slice] = true;
  }
}

TEST(LatinHypercube, EveryOrderOfAFewIsAsLikely) {
  std::map<std::vector<std::size_t>, int> orders;
  constexpr int keys = 24000;
  std::mt19937_64 random(1);
  for (int i = 0; i < keys; ++i) {
    const std::uint64_t key = random();
    std::vector<std::size_t> order;
    for (std::size_t k = 0; k < 4; ++k) order.push_back(permuted(k, 4, key));
    ++orders[order];
  }
  ASSERT_EQ(orders.size(), 24u);
  double chi2 = 0.0;
  for (const auto& [order, count] : orders) chi2 += (count - keys / 24.0) * (count - keys / 24.0) / (keys / 24.0);
  EXPECT_LT(chi2, 50.0) << "23 degrees of freedom: one in a thousand is above 49.7";
}

TEST(Sampler, APointAloneIsThePointOfTheWhole) {
  for (const Sampling method : {Sampling::shuffled, Sampling::sobol, Sampling::latin_hypercube}) {
    const auto points = all_points(Sampler(method, 9, 4, 500));
    const Sampler other(method, 9, 4, 500);
    for (const std::size_t k : {499, 0, 123}) EXPECT_EQ(other.at(k), points[k]);  // in another order
  }
}

TEST(Sampler, SeedsAndDimensionsHaveNothingInCommon) {
  constexpr std::size_t n = 4096;
  const double most = 4 / std::sqrt(static_cast<double>(n));  // of independent numbers: four standard deviations
  for (const Sampling method : {Sampling::sobol, Sampling::latin_hypercube}) {
    const Sampler one(method, 1, 5, n), next(method, 2, 5, n);
    for (std::size_t a = 0; a < 5; ++a) {
      EXPECT_LT(std::abs(correlation(coordinate(one, a), coordinate(next, a))), most) << "dimension " << a;
      for (std::size_t b = 0; b < a; ++b)
        EXPECT_LT(std::abs(correlation(coordinate(one, a), coordinate(one, b))), most) << a << ", " << b;
    }
  }
}

TEST(Sampler, IntegratesASmoothFunctionBetterThanRandomPoints) {
  constexpr std::size_t n = 4096, dimensions = 7;
  constexpr std::uint64_t seeds = 16;
  // Its integral is 1.
  const auto f = [](const std::vector<double>& x) {
    double product = 1.0;
    for (const double share : x) product *= 1.0 + 0.5 * (std::exp(share) - (std::numbers::e - 1.0));
    return product;
  };
  const auto rms = [&](const std::function<std::vector<std::vector<double>>(std::uint64_t)>& draw) {
    double squares = 0.0;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      double sum = 0.0;
      for (const auto& point : draw(seed)) sum += f(point);
      squares += (sum / n - 1.0) * (sum / n - 1.0);
    }
    return std::sqrt(squares / seeds);
  };
  const double at_random = rms([&](std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::vector<std::vector<double>> points(n, std::vector<double>(dimensions));
    for (auto& point : points)
      for (double& x : point) x = static_cast<double>(random() >> 11) * 0x1p-53;
    return points;
  });
  const double sobol = rms([&](std::uint64_t seed) { return all_points({Sampling::sobol, seed, dimensions, n}); });
  const double hypercube = rms([&](std::uint64_t seed) {
    return all_points({Sampling::latin_hypercube, seed, dimensions, n});
  });
  RecordProperty("random", std::to_string(at_random));
  RecordProperty("sobol", std::to_string(sobol));
  RecordProperty("latin_hypercube", std::to_string(hypercube));
  EXPECT_LT(sobol, at_random / 20);
  EXPECT_LT(hypercube, at_random / 2);
}

TEST(Sampler, RefusesWhatItHasNot) {
  EXPECT_THROW(Sampler(Sampling::shuffled, 1, 1, 1000), std::invalid_argument);
  EXPECT_NO_THROW(Sampler(Sampling::shuffled, 1, 1, 999));
  EXPECT_THROW(Sampler(Sampling::sobol, 1, 1, Sampler::most_points + 1), std::invalid_argument);
  EXPECT_TRUE(Sampler(Sampling::sobol, 1, 0, 10).at(3).empty()) << "of a system that draws nothing";
  EXPECT_THROW(Sampler(Sampling::sobol, 1, 4000, 10), std::invalid_argument);
  EXPECT_THROW(Sampler(Sampling::latin_hypercube, 1, 1, 0), std::invalid_argument);
}

}  // namespace
}  // namespace solenoid::test
