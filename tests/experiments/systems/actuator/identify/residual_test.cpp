// Identification of a force residual: the Gaussian process against closed forms and its own promises, samples of a
// simulated slide against the friction that was put in, the file byte for byte.
#include "experiments/systems/actuator/identify/residual.hpp"

#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/reader.hpp"
#include "experiments/systems/actuator/identify/residual_prediction.hpp"
#include "tests/experiments/systems/actuator/identify/moved_slide.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

GpData points(const std::vector<double>& z, const std::vector<double>& t) {
  GpData data;
  data.shares.resize(1);
  for (const double at : z) data.shares[0].push_back({at, 0});
  data.target = Eigen::Map<const Eigen::VectorXd>(t.data(), static_cast<Eigen::Index>(t.size()));
  data.linear.resize(data.target.size(), 0);
  return data;
}

TEST(GaussianProcess, OfOnePointIsTheClosedForm) {
  const double sigma = 1.7, length = 0.4, noise = 0.3, t = 2.2, k = sigma * sigma, s = k + noise * noise;
  const GaussianProcess process(points({0.5}, {t}), {{{sigma, length}}, noise});
  EXPECT_NEAR(process.log_likelihood(), -t * t / (2 * s) - std::log(2 * std::numbers::pi * s) / 2, 1e-12);
  for (const double z : {0.5, 0.6, 1.3, 9.0}) {
    const double c = k * std::exp(-std::pow((z - 0.5) / length, 2) / 2);
    const GpValue found = process.share(0, {z, 0});
    EXPECT_NEAR(found.mean, c * t / s, 1e-12);
    EXPECT_NEAR(found.variance, k - c * c / s, 1e-12);
  }
}

TEST(GaussianProcess, OfTwoPointsIsTheClosedForm) {
  const double sigma = 0.9, length = 0.7, noise = 0.2, a = 1.1, b = -0.4, apart = 0.5;
  const GaussianProcess process(points({0.0, apart}, {a, b}), {{{sigma, length}}, noise});
  const double k = sigma * sigma, c = k * std::exp(-std::pow(apart / length, 2) / 2), s = k + noise * noise,
               determinant = s * s - c * c;
  EXPECT_NEAR(process.log_likelihood(),
              -(s * (a * a + b * b) - 2 * c * a * b) / (2 * determinant) - std::log(determinant) / 2 -
                  std::log(2 * std::numbers::pi),
              1e-12);
  const double z = 0.2, ka = k * std::exp(-std::pow(z / length, 2) / 2),
               kb = k * std::exp(-std::pow((z - apart) / length, 2) / 2);
  const GpValue found = process.share(0, {z, 0});
  EXPECT_NEAR(found.mean, (ka * (s * a - c * b) + kb * (s * b - c * a)) / determinant, 1e-12);
  EXPECT_NEAR(found.variance, k - (ka * (s * ka - c * kb) + kb * (s * kb - c * ka)) / determinant, 1e-12);
}

TEST(GaussianProcess, OneBranchTellsTheOtherNothing) {
  const GaussianProcess process(points({0.5}, {2.0}), {{{1.5, 1.0}}, 0.1});
  EXPECT_EQ(process.share(0, {0.5, 1}).mean, 0.0);
  EXPECT_EQ(process.share(0, {0.5, 1}).variance, 1.5 * 1.5);
}

TEST(GaussianProcess, ALinearTermIsBayesianRegression) {
  // One weight of prior N(0, 1) and noise: mean sum x t/(noise^2 + sum x^2), variance noise^2/(noise^2 + sum x^2).
  GpData data = points({}, {});
  const std::vector<double> x = {0.3, -1.0, 2.0}, t = {0.5, -1.1, 2.3};
  data.shares.clear();
  data.target = Eigen::Map<const Eigen::VectorXd>(t.data(), 3);
  data.linear = Eigen::Map<const Eigen::VectorXd>(x.data(), 3);
  const double noise = 0.6, xx = data.linear.squaredNorm(), xt = data.linear.col(0).dot(data.target);
  const GaussianProcess process(data, {{}, noise});
  EXPECT_NEAR(process.weight(0).mean, xt / (noise * noise + xx), 1e-12);
  EXPECT_NEAR(process.weight(0).variance, noise * noise / (noise * noise + xx), 1e-12);
}

TEST(GaussianProcess, SearchFindsTheNoiseThatWasPutIn) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  std::vector<double> z, t;
  for (int i = 0; i < 300; ++i) {
    z.push_back(0.02 * i);
    t.push_back(std::sin(2 * z.back()) + 0.25 * normal(random));
  }
  const GpData data = points(z, t);
  const GpHyper start{{{1.0, 1.0}}, 1.0}, found = most_likely(data, start);
  EXPECT_NEAR(found.noise, 0.25, 0.03);
  EXPECT_GT(GaussianProcess(data, found).log_likelihood(), GaussianProcess(data, start).log_likelihood());
}

/// The friction that the samples below have beside the model's: Stribeck's, and more of Coulomb's and the viscous one.
double true_residual(double v) {
  const double sign = v > 0 ? 1.0 : -1.0;
  return -sign * (0.8 + 0.9 * std::exp(-std::pow(v / 0.015, 2))) - 6.0 * v;
}

std::vector<ResidualSample> drawn_samples(std::uint64_t seed, double noise_n, double payload_kg) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<ResidualSample> samples;
  for (int i = 0; i < 500; ++i) {
    const double phase = 0.02 * i * 2.1;
    ResidualSample s;
    s.position_m = 0.05 + 0.03 * std::sin(phase);
    s.velocity_m_s = 0.15 * std::cos(phase);
    if (std::abs(s.velocity_m_s) < 2e-3) continue;
    s.per_payload = -60.0 * std::sin(s.position_m / 0.0375) + 20.0 * std::sin(phase);
    s.force_n = true_residual(s.velocity_m_s) + payload_kg * s.per_payload + noise_n * normal(random);
    samples.push_back(s);
  }
  return samples;
}

TEST(Residual, BandCoversTheForceThatWasPutIn) {
  int inside = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const ResidualFinding found = identify_residual({drawn_samples(seed, 0.5, 0.12)});
    EXPECT_NEAR(found.payload_kg[0].mean, 0.12, 4 * std::sqrt(found.payload_kg[0].variance));
    EXPECT_NEAR(found.noise_n, 0.5, 0.12);
    for (std::size_t i = 0; i < found.velocity.knots.size(); ++i) {
      if (found.velocity.trust[i] == 0.0) continue;
      const double error = found.velocity.found[i].mean - true_residual(found.velocity.knots[i]);
      inside += std::abs(error) <= 1.96 * std::sqrt(found.velocity.found[i].variance);
      ++all;
    }
  }
  ASSERT_GT(all, 200);
  EXPECT_GT(inside, 0.85 * all);  // of 95 %: knots of one fit err together
}

TEST(Residual, EachLogHasAPayloadOfItsOwn) {
  const ResidualFinding found = identify_residual({drawn_samples(1, 0.3, 0.0), drawn_samples(2, 0.3, 0.25)});
  ASSERT_EQ(found.payload_kg.size(), 2u);
  for (const std::size_t l : {0u, 1u})
    EXPECT_NEAR(found.payload_kg[l].mean, l ? 0.25 : 0.0, 4 * std::sqrt(found.payload_kg[l].variance));
  EXPECT_NEAR(found.noise_n, 0.3, 0.08);
}

TEST(Residual, ExplainsHeldOutSecondsDownToTheNoise) {
  const ResidualFinding found = identify_residual({drawn_samples(5, 0.4, 0.1)});
  ASSERT_TRUE(found.held_out);
  ASSERT_GT(found.held_out->samples, 50u);
  EXPECT_NEAR(found.held_out->with_n, 0.4, 0.1);
  EXPECT_GT(found.held_out->without_n, 2 * found.held_out->with_n);
  EXPECT_GT(found.held_out->inside_95, 0.88);
}

TEST(Residual, IsZeroWhereThereWereNoData) {
  const ResidualFinding found = identify_residual({drawn_samples(6, 0.4, 0.1)});
  const ForceResidual g = found.residual();
  for (const double v : {0.3, -0.3, 1.0, -5.0}) EXPECT_EQ(g.force(0.05, v), 0.0);
  EXPECT_FALSE(g.covers(0.05, 0.3));
  EXPECT_TRUE(g.covers(0.05, 0.1));
  for (const double v : {-0.14, -0.05, -0.01, 0.01, 0.05, 0.14})
    EXPECT_NEAR(g.force(0.05, v), true_residual(v), 0.35) << v;
  EXPECT_NEAR(g.force(0.05, 0.0), 0.0, 1e-9);
}

TEST(Residual, SaysSoWhereThereIsNothingToLearn) {
  std::vector<ResidualSample> noise = drawn_samples(7, 0.0, 0.0);
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  for (ResidualSample& s : noise) s.force_n = 0.5 * normal(random);
  const auto refusal = [](const std::vector<ResidualSample>& samples) -> std::string {
    try {
      identify_residual({samples});
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(refusal(noise), HasSubstr("nothing to learn"));
  EXPECT_THAT(refusal({noise.begin(), noise.begin() + 30}), HasSubstr("allowed: 1.2 s"));
}

TEST(Residual, MotionOneWayIsRefused) {
  for (const int way : {-1, 1}) {
    std::vector<ResidualSample> samples = drawn_samples(7, 0.4, 0.1);
    std::erase_if(samples, [way](const ResidualSample& s) { return s.velocity_m_s * way < 0; });
    ASSERT_GT(samples.size(), 200u);
    try {
      identify_residual({samples});
      ADD_FAILURE() << "accepted";
    } catch (const ConfigError& error) {
      EXPECT_THAT(error.what(), HasSubstr(way > 0 ? "moves back for 0.00 s" : "moves forth for 0.00 s"));
      EXPECT_THAT(error.what(), HasSubstr("allowed: motion to and fro"));
    }
  }
}

TEST(Residual, SaysNothingOfHeldOutSamplesWhereThereAreNone) {
  std::vector<ResidualSample> samples = drawn_samples(5, 0.4, 0.1);
  samples.resize(190);
  const ResidualFinding found = identify_residual({samples});
  EXPECT_FALSE(found.held_out);
  EXPECT_THAT(residual_file(found, {"a.mcap", "01ab", "x"}), Not(HasSubstr("held_out")));
}

TEST(Residual, FileNamesLogsOfAnyName) {
  const ResidualFinding found = identify_residual({drawn_samples(8, 0.5, 0.1)});
  for (const std::string name : {"a\"b.mcap", "back\\slash.csv", "two\nlines.csv", "it's.csv"}) {
    TableReader table = TableReader::from_text(residual_file(found, {name, "01ab", "x"}), "residual.toml");
    EXPECT_EQ(table.table("identified").text("logs"), name);
    EXPECT_FALSE(read_force_residual(table).empty());
  }
}

/// The blocks of a plot's data as gnuplot counts its index: two empty lines and more are between them.
std::vector<std::string> blocks_of(const std::string& data) {
  std::vector<std::string> blocks;
  std::istringstream lines(data);
  std::string line;
  int empty = 2;
  while (std::getline(lines, line)) {
    if (line.empty()) {
      ++empty;
      continue;
    }
    if (empty >= 2) blocks.emplace_back();
    blocks.back() += line + "\n";
    empty = 0;
  }
  return blocks;
}

TEST(Residual, PlotHasTheHatsInItsThirdBlockHoweverManyKnotsAreNotTrusted) {
  ResidualFinding found = identify_residual({drawn_samples(8, 0.5, 0.1)});
  const std::vector<std::string> whole = blocks_of(residual_plot(found).panels[0].data);
  ASSERT_EQ(whole.size(), 3u);
  for (const std::size_t i : {3u, 4u, 5u}) found.velocity.trust[i] = 0.0;
  const std::vector<std::string> gapped = blocks_of(residual_plot(found).panels[0].data);
  ASSERT_EQ(gapped.size(), 3u);
  EXPECT_EQ(gapped[2], whole[2]);
  EXPECT_EQ(std::ranges::count(gapped[1], '\n') + 3, std::ranges::count(whole[1], '\n'));
}

TEST(Residual, FileIsTheSameByteForByteAndReadsBack) {
  const auto text = [] {
    return residual_file(identify_residual({drawn_samples(8, 0.5, 0.1)}), {"a.mcap", "01ab", "x"});
  };
  const std::string once = text();
  EXPECT_EQ(once, text());
  TableReader table = TableReader::from_text(once, "residual.toml");
  const ForceResidual read = read_force_residual(table),
                      made = identify_residual({drawn_samples(8, 0.5, 0.1)}).residual();
  for (double v = -0.3; v <= 0.3; v += 0.007) EXPECT_NEAR(read.force(0.05, v), made.force(0.05, v), 1e-4);
}

TEST(ResidualSamples, OfASimulatedSlideAreTheFrictionThatTheModelLeavesOut) {
  ActuatorParameters believed = named_parameters("inferred");
  believed.viscous_friction = 20.0;
  believed.plane = Plane::horizontal;
  ForceResidual put_in;
  put_in.velocity = HatSum(std::vector{-0.4, -0.3, -0.02, -0.002, 0.0, 0.002, 0.02, 0.3, 0.4},
                           std::vector{0.0, 2.5, 0.9, 1.3, 0.0, -1.3, -0.9, -2.5, 0.0});
  const Record record = test::moved_slide(believed, put_in, 2e-5);
  const std::vector<ResidualSample> samples = residual_samples(record, believed, 0.0);
  ASSERT_GT(samples.size(), 300u);
  const ResidualFinding found = identify_residual({samples});
  // Told from inertia alone on the bench: what smoothing leaves of friction's jump at reversals, where acceleration is
  // greatest, is some 2 N/(m/s2) of mass, a tenth of the equivalent mass.
  EXPECT_NEAR(found.payload_kg[0].mean, 0.0, 0.03);
  for (const double v : {-0.05, -0.03, 0.03, 0.05})
    EXPECT_NEAR(found.residual().force(0.05, v), put_in.force(0.05, v), 0.2) << v;
  const std::vector<ResidualSample> none = residual_samples(test::moved_slide(believed, {}, 2e-5), believed, 0.0);
  double sum = 0.0;
  for (const ResidualSample& s : none) sum += s.force_n;
  EXPECT_NEAR(sum / static_cast<double>(none.size()), 0.0, 0.05);
}

TEST(ResidualPrediction, IsBetterWithTheForceThatIsThere) {
  VariantConfig v = new_variant();
  v.estimator = "payload_ekf";
  actuator(v).nominal = named_parameters("inferred");
  actuator(v).nominal.plane = Plane::horizontal;
  actuator(v).estimation.pressure_filter_hz = 0.0;
  ForceResidual put_in;
  put_in.velocity =
      HatSum(std::vector{-0.4, -0.3, -0.002, 0.0, 0.002, 0.3, 0.4}, std::vector{0.0, 3.0, 1.5, 0.0, -1.5, -3.0, 0.0});
  const PredictionError found = prediction_error({test::moved_slide(actuator(v).nominal, put_in, 2e-5)}, v, put_in);
  EXPECT_GT(found.predictions, 1000u);
  EXPECT_LT(found.with_m, 0.7 * found.without_m);
  EXPECT_EQ(found.outside, 0.0);
}

}  // namespace
}  // namespace solenoid
