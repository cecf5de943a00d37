#pragma once

#include "solvers/learned/mlp.hpp"

#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include <Eigen/Core>

namespace solenoid {

/// Random numbers that are the same everywhere: the standard library's distributions are not.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : bits_(seed) {}
  /// In [0, 1).
  double uniform() { return static_cast<double>(bits_() >> 11) * 0x1p-53; }
  /// Of mean 0 and variance 1, from a sum of twelve: what tails it lacks nothing here needs.
  double normal() {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  }
  /// A whole number in [0, n).
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(uniform() * static_cast<double>(n)); }

 private:
  std::mt19937_64 bits_;
};

/// Rows are samples.
template <class S>
using Samples = Eigen::Matrix<S, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// A perceptron under training: what Mlp evaluates, with derivatives.
template <class S>
class Perceptron {
 public:
  /// Weights drawn uniformly with the variance 2 / inputs of a layer (He et al. 2015), biases 0.
  /// shapes   widths: inputs, hidden layers, outputs
  Perceptron(const std::vector<int>& widths, Activation activation, std::uint64_t seed);

  /// The outputs for a batch of inputs; kept for gradient().
  const Samples<S>& forward(const Samples<S>& inputs);
  /// The gradient of a loss by the weights and biases, from that by the outputs of the last forward(): as parameters()
  /// has them.
  Eigen::VectorX<S> gradient(const Samples<S>& by_outputs) const;

  /// All numbers in a row: of each layer weights, then biases.
  const Eigen::VectorX<S>& parameters() const { return parameters_; }
  /// The same, to be changed.
  Eigen::VectorX<S>& parameters() { return parameters_; }
  /// Layers of these parameters as Mlp has them.
  std::vector<MlpLayer> layers() const;

 private:
  using Weights = Eigen::Map<const Samples<S>>;
  Weights weights(std::size_t layer) const;
  Eigen::Map<const Eigen::RowVectorX<S>> biases(std::size_t layer) const;

  std::vector<int> widths_;
  Activation activation_;
  std::vector<Eigen::Index> begin_;  // of each layer's parameters
  Eigen::VectorX<S> parameters_;
  std::vector<Samples<S>> values_;  // of the inputs and of each layer
};

/// A sum of losses over a batch: outputs and the samples' numbers in, the gradient by the outputs out.
template <class S>
using Loss =
    std::function<double(const Samples<S>& outputs, std::span<const std::size_t> samples, Samples<S>& by_outputs)>;

/// Adam (Kingma and Ba 2015), with its usual decays.
template <class S>
class Adam {
 public:
  explicit Adam(Eigen::Index size) : mean_(Eigen::VectorX<S>::Zero(size)), square_(mean_) {}
  /// A step of this rate along a gradient.
  void step(const Eigen::VectorX<S>& gradient, double rate, Eigen::VectorX<S>& parameters);

 private:
  Eigen::VectorX<S> mean_, square_;
  double mean_left_ = 1.0, square_left_ = 1.0;
};

/// How a perceptron is trained.
struct TrainSettings {
  std::vector<int> hidden = {48, 32};
  Activation activation = Activation::relu;
  int epochs = 50, batch = 256;
  double rate = 2e-3;  ///< of the first step; it falls to 0 in a straight line
  std::uint64_t seed = 1;
};

/// An epoch as it went.
struct Epoch {
  double training = 0.0, held_out = 0.0;  ///< mean losses
};

/// A perceptron as trained, and how that went.
struct Trained {
  std::vector<MlpLayer> layers;  ///< of the epoch of the least loss on held-out samples
  std::vector<Epoch> epochs;
  std::size_t best = 0;  ///< which
  bool interrupted = false;
};

/// Trains on inputs that are scaled already; a loss counts samples by their rows. One thread, the same weights to the
/// last bit for the same numbers in.
Trained train(const Samples<float>& inputs, const Loss<float>& loss, const Samples<float>& held_out_inputs,
              const Loss<float>& held_out_loss, int outputs, const TrainSettings& settings,
              const std::function<bool(const Trained&)>& go_on);

/// Inputs of a perceptron from features: those that say something that no earlier one says, scaled to mean 0 and
/// variance 1; features of more than two values a second time, with their median magnitude for a knee.
std::vector<MlpInput> choose_inputs(const Samples<float>& features);

/// The inputs of these features, as Mlp makes them.
Samples<float> inputs_of(const Samples<float>& features, const std::vector<MlpInput>& inputs);

}  // namespace solenoid
