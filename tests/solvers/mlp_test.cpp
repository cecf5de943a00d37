#include "solvers/learned/mlp.hpp"

#include "core/config/reader.hpp"
#include "solvers/learned/best_sequences.hpp"
#include "tests/support/uniform.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <gmock/gmock.h>

namespace solenoid {
namespace {

using testing::HasSubstr;

/// Two features, one of them twice, two hidden values, one output.
MlpData by_hand() {
  MlpData d;
  d.kind = "sum";
  d.layout = "two numbers";
  d.features = 2;
  d.inputs = {{0, 0.0f, 1.0f, 2.0f}, {1, 0.0f, 0.0f, 1.0f}, {1, 3.0f, 0.25f, 4.0f}};
  d.layers = {{3, 2, {1.0f, 0.0f, 2.0f, -1.0f, 1.0f, 0.0f}, {0.5f, 0.0f}}, {2, 1, {3.0f, -5.0f}, {0.125f}}};
  return d;
}

float output_of(const MlpData& data, std::vector<float> features) {
  float y = 0.0f;
  Mlp(data).evaluate(features, std::span(&y, 1));
  return y;
}

MlpData random_network(std::mt19937_64& random, Activation activation) {
  const auto small = [&] { return static_cast<float>(uniform(random, -1, 1)); };
  MlpData d;
  d.kind = "random";
  d.layout = "any";
  d.activation = activation;
  d.features = 1 + static_cast<int>(random() % 40);
  d.log_floor = uniform(random, 0, 1e-9);
  for (std::size_t i = 0; i < random() % 9; ++i) d.labels.push_back(static_cast<int>(random() % 1000));
  int width = 1 + static_cast<int>(random() % 50);
  for (int i = 0; i < width; ++i)
    d.inputs.push_back({static_cast<int>(random() % static_cast<std::uint64_t>(d.features)),
                        i % 2 ? std::abs(small()) : 0.0f, small(), 1e3f * small()});
  for (std::size_t l = 0; l < 1 + random() % 3; ++l) {
    MlpLayer layer{width, 1 + static_cast<int>(random() % 40), {}, {}};
    for (int i = 0; i < layer.inputs * layer.outputs; ++i) layer.weights.push_back(small() * 1e-3f * small());
    for (int i = 0; i < layer.outputs; ++i) layer.biases.push_back(small());
    width = layer.outputs;
    d.layers.push_back(layer);
  }
  return d;
}

/// One output after the other, sums in the order of the inputs.
std::vector<float> naive(const MlpData& d, const std::vector<float>& features) {
  std::vector<float> a;
  for (const MlpInput& in : d.inputs) {
    const float f = features[static_cast<std::size_t>(in.column)];
    a.push_back(((in.knee > 0 ? f / (in.knee + std::abs(f)) : f) - in.mean) * in.scale);
  }
  for (std::size_t l = 0; l < d.layers.size(); ++l) {
    std::vector<float> next;
    for (std::size_t o = 0; o < static_cast<std::size_t>(d.layers[l].outputs); ++o) {
      float sum = d.layers[l].biases[o];
      for (std::size_t i = 0; i < a.size(); ++i) sum = sum + d.layers[l].weights[o * a.size() + i] * a[i];
      const bool last = l + 1 == d.layers.size();
      next.push_back(last ? sum : d.activation == Activation::tanh ? std::tanh(sum) : std::max(sum, 0.0f));
    }
    a = next;
  }
  return a;
}

TEST(Mlp, GivesWhatIsReckonedByHand) {
  // Inputs (3 - 1) 2 = 4, 1, (1 / (3 + 1) - 0.25) 4 = 0; hidden 4.5 and -3: 3 x 4.5 - 5 x 0 + 0.125 behind a rectifier.
  EXPECT_EQ(output_of(by_hand(), {3.0f, 1.0f}), 13.625f);
  MlpData smooth = by_hand();
  smooth.activation = Activation::tanh;
  EXPECT_NEAR(output_of(smooth, {3.0f, 1.0f}), 3 * std::tanh(4.5) + 5 * std::tanh(3.0) + 0.125, 1e-6);
}

TEST(Mlp, EqualsSumsTakenOneByOneToTheLastBit) {
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const MlpData d = random_network(random, trial % 2 ? Activation::tanh : Activation::relu);
    std::vector<float> features;
    for (int i = 0; i < d.features; ++i) features.push_back(static_cast<float>(uniform(random, -2, 2)));
    const Mlp network(d);
    std::vector<float> outputs(network.outputs());
    network.evaluate(features, outputs);
    EXPECT_EQ(outputs, naive(d, features));
  }
}

TEST(Mlp, IsTheSameToTheLastBitAfterItsText) {
  std::mt19937_64 random(4);
  for (int trial = 0; trial < 100; ++trial) {
    const MlpData d = random_network(random, trial % 2 ? Activation::tanh : Activation::relu);
    EXPECT_EQ(read_mlp(mlp_text(d), "net.toml"), d);
  }
  MlpData ugly = by_hand();
  ugly.layers[0].weights = {
      std::numeric_limits<float>::denorm_min(), -0.0f, 3.4e37f, 1.0f / 3.0f, 16777217.0f, -1e-20f};
  EXPECT_EQ(read_mlp(mlp_text(ugly), "net.toml"), ugly);
}

std::string refusal(const std::string& text) {
  try {
    read_mlp(text, "net.toml");
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

std::string with(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Mlp, ADamagedFileIsRefusedInWords) {
  const std::string text = mlp_text(by_hand());
  EXPECT_EQ(refusal(text), "accepted");
  for (std::size_t length = 0; length + 2 < text.size(); ++length)
    EXPECT_THAT(refusal(text.substr(0, length)), HasSubstr("net.toml")) << length;
  EXPECT_THAT(refusal(with(text, "format = 1", "format = 2")), HasSubstr("format"));
  EXPECT_THAT(refusal(with(text, "relu", "gelu")), HasSubstr("relu, tanh"));
  EXPECT_THAT(refusal(with(text, "0.125", "nan")), HasSubstr("biases"));
  EXPECT_THAT(refusal(with(text, "0.125", "1e39")), HasSubstr("biases"));
  EXPECT_THAT(refusal(with(text, "[3, -5]", "[3]")), HasSubstr("1 weights"));
  EXPECT_THAT(refusal(with(text, "outputs = 2", "outputs = 3")), HasSubstr("3 x 3"));
  EXPECT_THAT(refusal(with(text, "[0, 1, 1]", "[0, 1, 2]")), HasSubstr("feature 2, of 2"));
  EXPECT_THAT(refusal(with(text, "[0, 0, 3]", "[0, 0, -3]")), HasSubstr("knees"));
  EXPECT_THAT(refusal(with(text, "[0, 0, 3]", "[0, 0]")), HasSubstr("columns"));
  EXPECT_THAT(refusal(text + "more = 1\n"), HasSubstr("not known"));
  EXPECT_THAT(refusal(std::string(5'000'000, ' ')), HasSubstr("bytes"));
}

TEST(Mlp, WhatDoesNotFitTogetherIsRefused) {
  MlpData d = by_hand();
  d.layers.clear();
  EXPECT_THROW(Mlp{d}, std::invalid_argument);
  d = by_hand();
  d.layers[0].weights[0] = std::numeric_limits<float>::infinity();
  EXPECT_THROW(Mlp{d}, std::invalid_argument);
  d = by_hand();
  d.inputs.assign(2000, {});
  EXPECT_THROW(Mlp{d}, std::invalid_argument);
}

TEST(BestSequences, AreThoseOfAllThatHaveTheHighestSums) {
  std::mt19937_64 random(5);
  for (int trial = 0; trial < 200; ++trial) {
    const std::size_t blocks = 1 + random() % 4, modes = 1 + random() % 5, k = 1 + random() % 20;
    std::vector<float> scores;
    for (std::size_t i = 0; i < blocks * modes; ++i) scores.push_back(static_cast<float>(uniform(random, -3, 3)));
    const auto sum_of = [&](const ModeSequence& s) {
      float sum = 0.0f;
      for (std::size_t b = 0; b < blocks; ++b) sum += scores[b * modes + s[b]];
      return sum;
    };
    std::vector<float> all;
    ModeSequence s{};
    for (std::size_t n = 0;; ++n) {
      std::size_t rest = n;
      for (std::size_t b = 0; b < blocks; ++b, rest /= modes) s[b] = static_cast<std::uint16_t>(rest % modes);
      if (rest > 0) break;
      all.push_back(sum_of(s));
    }
    std::ranges::sort(all, std::greater());
    std::vector<ModeSequence> found(k);
    BestSequences best;
    const int count = best.find(scores, blocks, found);
    ASSERT_EQ(static_cast<std::size_t>(count), std::min(k, all.size()));
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      EXPECT_EQ(sum_of(found[i]), all[i]);
      for (std::size_t j = 0; j < i; ++j) EXPECT_NE(found[i], found[j]);
    }
  }
}

}  // namespace
}  // namespace solenoid
