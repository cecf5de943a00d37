#include "experiments/learn/learn.hpp"

#include "controllers/networks.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/gap.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/learn/judge.hpp"
#include "experiments/profile/shipped_instances.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <cmath>
#include <filesystem>
#include <limits>
#include <numeric>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Half the squared distance to what is wanted.
double squared_distance(const Samples<double>& outputs, const Samples<double>& wanted) {
  return 0.5 * (outputs - wanted).squaredNorm();
}

TEST(Perceptron, ItsGradientIsThatOfFiniteDifferences) {
  for (const Activation activation : {Activation::relu, Activation::tanh})
    for (const std::vector<int>& widths : {std::vector<int>{3, 2}, {4, 5, 3}, {2, 7, 6, 1}}) {
      Perceptron<double> network(widths, activation, 7);
      Draws draws(8);
      Samples<double> inputs(5, widths.front()), wanted(5, widths.back());
      for (double& v : inputs.reshaped()) v = draws.normal();
      for (double& v : wanted.reshaped()) v = draws.normal();
      for (double& v : network.parameters()) v += 0.1 * draws.normal();  // biases too, and off the rectifiers' kinks
      const Eigen::VectorXd slope = network.gradient(network.forward(inputs) - wanted);
      for (Eigen::Index i = 0; i < slope.size(); ++i) {
        const double at = network.parameters()[i], step = 1e-6;
        network.parameters()[i] = at + step;
        const double above = squared_distance(network.forward(inputs), wanted);
        network.parameters()[i] = at - step;
        const double below = squared_distance(network.forward(inputs), wanted);
        network.parameters()[i] = at;
        EXPECT_NEAR(slope[i], (above - below) / (2 * step), 1e-7 * (1 + std::abs(slope[i])));
      }
    }
}

TEST(Perceptron, GivesWhatMlpGivesOfItsLayers) {
  Perceptron<float> network({6, 9, 4}, Activation::relu, 3);
  Draws draws(4);
  Samples<float> features(20, 6);
  for (float& v : features.reshaped()) v = static_cast<float>(draws.normal());
  MlpData d{"any", "any", 6, Activation::relu, {}, 0.0, choose_inputs(features), network.layers()};
  ASSERT_EQ(d.inputs.size(), 12u);  // each feature as it is and with a knee
  Perceptron<float> twice({12, 9, 4}, Activation::relu, 3);
  d.layers = twice.layers();
  const Samples<float> outputs = twice.forward(inputs_of(features, d.inputs));
  const Mlp mlp(d);
  std::vector<float> one(4);
  for (Eigen::Index i = 0; i < 20; ++i) {
    mlp.evaluate({features.data() + i * 6, 6}, one);
    for (Eigen::Index k = 0; k < 4; ++k) EXPECT_NEAR(one[static_cast<std::size_t>(k)], outputs(i, k), 1e-4f);
  }
}

TEST(ChosenInputs, AreScaledAndLeaveOutWhatSaysNothingNew) {
  Draws draws(5);
  Samples<float> features(500, 4);
  for (Eigen::Index i = 0; i < 500; ++i) {
    const auto x = static_cast<float>(3.0 + 2.0 * draws.normal());
    features.row(i) << x, 7.0f, (i % 2 ? 1.0f : 0.0f), x;  // the second is constant, the last the first's double
  }
  const std::vector<MlpInput> inputs = choose_inputs(features);
  ASSERT_EQ(inputs.size(), 3u);  // the first in two ways; of two values there is one way
  EXPECT_EQ(inputs[0].column, 0);
  EXPECT_EQ(inputs[0].knee, 0.0f);
  EXPECT_GT(inputs[1].knee, 1.0f);
  EXPECT_EQ(inputs[2].column, 2);
  const Samples<float> values = inputs_of(features, inputs);
  for (Eigen::Index k = 0; k < values.cols(); ++k) {
    EXPECT_NEAR(values.col(k).mean(), 0.0f, 1e-4f);
    EXPECT_NEAR(values.col(k).squaredNorm() / 500.0f, 1.0f, 1e-3f);
  }
}

/// Modes that a plane through the features tells apart.
TrainingSet tellable(std::uint64_t seed, Eigen::Index samples) {
  TrainingSet set;
  Draws draws(seed);
  set.layout = "two numbers";
  set.patterns = {4, 9};
  set.blocks = 2;
  set.features.resize(samples, 2);
  for (float& v : set.features.reshaped()) v = static_cast<float>(draws.normal());
  for (Eigen::Index i = 0; i < samples; ++i) {
    set.modes.push_back(set.features(i, 0) + set.features(i, 1) > 0.0f ? 1 : 0);
    set.modes.push_back(set.features(i, 0) > set.features(i, 1) ? 1 : 0);
    set.weights.push_back(1.0f);
  }
  return set;
}

MlpData taught(
    const TrainingSet& set, const TrainingSet& held_out, const TrainSettings& settings,
    const std::function<bool(const Trained&)>& go_on = [](const Trained&) { return true; }) {
  const std::vector<MlpInput> inputs = choose_inputs(set.features);
  const TaughtTargets targets = targets_of(set);
  const Trained trained = train_on(set, held_out, inputs, targets, settings, go_on);
  return network_of(set, inputs, targets, trained, settings.activation);
}

const TrainSettings quick{.hidden = {12}, .epochs = 20, .batch = 32, .rate = 1e-2};

TEST(Training, FindsModesThatAPlaneTellsApartAndIsTheSameToTheByte) {
  const TrainingSet set = tellable(1, 2000), held_out = tellable(2, 500);
  const MlpData network = taught(set, held_out, quick);
  EXPECT_GT(quality_on(held_out, Mlp(network)).all_blocks, 0.95);
  EXPECT_EQ(mlp_text(taught(set, held_out, quick)), mlp_text(network));
  TrainSettings other = quick;
  other.seed = 2;
  EXPECT_NE(mlp_text(taught(set, held_out, other)), mlp_text(network));
}

TEST(Training, FindsACostAndSaysHowOftenItIsTooHigh) {
  const auto costs_of = [](std::uint64_t seed, Eigen::Index samples) {
    TrainingSet set = tellable(seed, samples);
    set.modes.clear();
    for (Eigen::Index i = 0; i < samples; ++i)
      set.costs.push_back(1e-6 * std::exp(2.0 * static_cast<double>(set.features(i, 0))));
    return set;
  };
  const TrainingSet set = costs_of(1, 4000), held_out = costs_of(2, 500);
  const Mlp network(taught(set, held_out, quick));
  const TaughtQuality q = quality_on(held_out, network);
  EXPECT_LT(q.error_p50, 0.05);
  EXPECT_GT(q.violations, 0.05);
  EXPECT_LT(q.violations, 0.95);
  EXPECT_LE(q.violation_max, q.error_max);
  EXPECT_LE(q.violation_p50, q.violation_p90);
}

TEST(Training, InterruptedItKeepsTheBestSoFar) {
  const TrainingSet set = tellable(1, 300), held_out = tellable(2, 100);
  const std::vector<MlpInput> inputs = choose_inputs(set.features);
  const Trained t =
      train_on(set, held_out, inputs, {}, quick, [](const Trained& so_far) { return so_far.epochs.size() < 3; });
  EXPECT_TRUE(t.interrupted);
  ASSERT_EQ(t.epochs.size(), 3u);
  for (const Epoch& e : t.epochs) EXPECT_LE(t.epochs[t.best].held_out, e.held_out);
  EXPECT_NO_THROW(Mlp(network_of(set, inputs, {}, t, Activation::relu)));
}

constexpr const char* small_campaign = R"(
[[scenario]]
name = "taught"
trajectory = { kind = "cycloidal", move_s = 0.4, dwell_s = 0.1 }
duration_s = 0.5
[[scenario]]
name = "held_out"
trajectory = { kind = "cycloidal", move_s = 0.5, dwell_s = 0.1 }
duration_s = 0.5
)";

TEST(Learning, TheCommandTeachesBothKindsTheSameEachTimeAndTheProgramRunsThem) {
  const test::Folder folder;
  folder.write("c.toml", small_campaign);
  const std::string common = " --campaign c.toml --states 100 --epochs 3 --hidden 8 --format json --out ";
  for (const std::string kind : {"policy", "cost"}) {
    for (const std::string out : {"a", "b"}) {
      const test::ProgramRun run = run_program(folder, fmt::format("learn {0}{1}{0}{2}", kind, common, out));
      ASSERT_EQ(run.exit_code, 0) << run.err;
      EXPECT_EQ(nlohmann::json::parse(run.out)["kind"], kind);
    }
    EXPECT_EQ(test::text_of(folder / (kind + "a/network.toml")), test::text_of(folder / (kind + "b/network.toml")));
    EXPECT_EQ(test::text_of(folder / (kind + "a/manifest.json")), test::text_of(folder / (kind + "b/manifest.json")));
    const test::ProgramRun judged = run_program(
        folder, "learn evaluate nine_robust --campaign c.toml --states 50 --passes 1 --format json --network " + kind +
                    "a/network.toml");
    ASSERT_EQ(judged.exit_code, 0) << judged.err;
    const nlohmann::json found = nlohmann::json::parse(judged.out);
    EXPECT_EQ(found["solvers"][0]["optimal_share"], 1.0);
    for (const auto& solver : found["solvers"]) EXPECT_GE(solver["cost_ratio"], 1.0 - 1e-12);
  }
  folder.write("run.toml", std::string(small_campaign) + R"(
[variant.mine]
valves = "two_way"
solver = "policy"
learned = { network = "policya/network.toml" }
horizon = { steps = 40, blocks = [1, 1, 2, 4] }
motor = "in_prediction"
)");
  const test::ProgramRun run = run_program(folder, "compare run.toml --variant mine --jobs 1 --format json --out r");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const test::ProgramRun again =
      run_program(folder, "compare r/resolved.toml --variant mine --jobs 1 --format json --out r2");
  ASSERT_EQ(again.exit_code, 0) << again.err;  // the network is carried along
}

TEST(Judging, AGapIsOfTheOptimumAndNoneWithinRounding) {
  EXPECT_DOUBLE_EQ(gap_above(1.5, 1.0), 0.5);
  EXPECT_DOUBLE_EQ(gap_above(0.5, 1.0), -0.5);  // no optimum, and to be seen
  EXPECT_EQ(gap_above(1.0 + 1e-15, 1.0), 0.0);
  EXPECT_EQ(gap_above(1.0 - 1e-15, 1.0), 0.0);
  EXPECT_EQ(gap_above(0.0, 0.0), 0.0);  // at rest
  EXPECT_EQ(gap_above(1e-300, 0.0), std::numeric_limits<double>::infinity());
  EXPECT_EQ(gap_above(std::numeric_limits<double>::infinity(), 1.0), std::numeric_limits<double>::infinity());
}

TEST(Learning, WhatCannotBeTaughtIsRefusedInWords) {
  const test::Folder folder;
  folder.write("c.toml", small_campaign);
  folder.write("one_block.toml", std::string(small_campaign) + R"(
[variant.one]
valves = "two_way"
motor = "in_prediction"
solver = "branch_and_bound"
horizon = { steps = 20, blocks = [4] }
)");
  folder.write("rest.toml", R"(
[[scenario]]
name = "taught"
system = "thrusters"
trajectory = {}
duration_s = 2.0
[[scenario]]
name = "held_out"
system = "thrusters"
trajectory = {}
duration_s = 2.0
)");
  folder.write("alone.toml", "[[scenario]]\nname = \"taught\"\ntrajectory = { kind = \"step\" }\n");
  const auto refusal = [&](const std::string& arguments) { return test::refusal_of(folder, "learn " + arguments); };
  EXPECT_THAT(refusal("policy --campaign alone.toml"), HasSubstr("0 to judge"));
  EXPECT_THAT(refusal("policy --campaign c.toml --variant sliding_three_mode"), HasSubstr("is a law"));
  EXPECT_THAT(refusal("cost --campaign c.toml --searched-blocks 4"), HasSubstr("allowed: 1 to 3"));
  EXPECT_THAT(refusal("evaluate nine_robust --campaign c.toml"), HasSubstr("no learned.network"));
  EXPECT_THAT(refusal("evaluate nine_robust --campaign c.toml --network none.toml"),
              HasSubstr("--network: none.toml cannot be read"));
  EXPECT_THAT(refusal("cost --campaign one_block.toml --variant one"), HasSubstr("--variant: 'one' has one block"));
  EXPECT_THAT(refusal("policy --campaign rest.toml --variant flyer_single --states 20 --perturbed 0 --out rest"),
              HasSubstr("--campaign: all "));
  for (const char* kind : {"policy", "cost"}) {
    const std::string from = std::string(kind) + " --campaign c.toml --out none";
    const std::string layers = refusal(from + " --hidden 8,8,8,8,8,8,8,8,8");
    EXPECT_THAT(layers, HasSubstr("--hidden: 9 layers (allowed: at most 7)"));
    EXPECT_THAT(layers, Not(HasSubstr("recording")));  // before anything runs
    EXPECT_THAT(refusal(from + " --hidden 1024,1024"), HasSubstr("--hidden: at least 10"));
    EXPECT_THAT(refusal(from + " --variant servo_robust"), HasSubstr("variant 'servo_robust': the solver"));
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "none"));
}

}  // namespace
}  // namespace solenoid
