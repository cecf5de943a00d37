#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace solenoid {

/// What stands between the layers of a perceptron.
enum class Activation { relu, tanh };

/// One input of a perceptron, made of one feature f of whoever evaluates it:
///
///     x = (g - mean) * scale,    g = f, or with a knee f / (knee + |f|): fine around 0, bounded far away
struct MlpInput {
  int column = 0;  ///< which feature
  float knee = 0.0f;
  float mean = 0.0f, scale = 1.0f;
  bool operator==(const MlpInput&) const = default;
};

/// outputs = weights inputs + biases.
struct MlpLayer {
  int inputs = 0, outputs = 0;
  std::vector<float> weights;  ///< outputs x inputs, output-major
  std::vector<float> biases;   ///< outputs
  bool operator==(const MlpLayer&) const = default;
};

/// A perceptron as data, as its file has it.
struct MlpData {
  std::string kind;    ///< what its outputs are, for whoever uses it
  std::string layout;  ///< what its features are of: it fits nothing else
  int features = 0;    ///< that are given to it
  Activation activation = Activation::relu;
  std::vector<int> labels{};  ///< what outputs stand for, in the user's own numbers
  double log_floor = 0.0;     ///< above 0: an output y stands for exp(y) - log_floor
  std::vector<MlpInput> inputs;
  std::vector<MlpLayer> layers;  ///< at least one; the last has no activation
  bool operator==(const MlpData&) const = default;
};

/// What a perceptron may have at most: every reader allocates no more.
namespace mlp_limits {
inline constexpr int width = 1024;       ///< features, inputs, outputs of a layer
inline constexpr int layers = 8;         ///< with the last
inline constexpr int weights = 200'000;  ///< of all layers
inline constexpr int labels = 4096;      ///< what outputs stand for
}  // namespace mlp_limits

/// A small multilayer perceptron: fully connected layers, a linear head.
///
///     a_0 = inputs,   a_l = act(W_l a_(l-1) + b_l),   outputs = W_L a_(L-1) + b_L
///
/// Sums run over the inputs in their order, without contraction: with rectifiers the same on every machine, whatever its
/// registers; a hyperbolic tangent is the C library's.
class Mlp {
 public:
  /// Throws std::invalid_argument, naming what does not fit together.
  explicit Mlp(MlpData data);

  const MlpData& data() const { return data_; }  ///< what it was made of
  /// How many features it takes.
  std::size_t features() const { return static_cast<std::size_t>(data_.features); }
  /// How many outputs it gives.
  std::size_t outputs() const { return static_cast<std::size_t>(data_.layers.back().outputs); }
  /// shapes   features: features()    outputs: outputs()
  /// No allocation, no exception; several threads may.
  void evaluate(std::span<const float> features, std::span<float> outputs) const noexcept;

 private:
  /// Weights of a layer, `panel` outputs together: [panel][input][output of the panel], filled up with zeros.
  struct Packed {
    int inputs = 0, outputs = 0, panels = 0;
    std::vector<float> weights, biases;
  };
  static Packed pack(const MlpLayer& layer);

  MlpData data_;
  std::vector<Packed> packed_;
};

/// The perceptron as a text in TOML, which read_mlp() reads as the same to the last bit.
std::string mlp_text(const MlpData& data);

/// Reads such a text. Throws ConfigError with `name`, line, key and what is allowed.
MlpData read_mlp(const std::string& text, const std::string& name);

}  // namespace solenoid
