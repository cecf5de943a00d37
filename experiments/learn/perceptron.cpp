#include "experiments/learn/perceptron.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace solenoid {
namespace {

/// Eigen cuts its products by the caches it finds, and so its sums: these, whatever the machine has.
void fix_caches() {
  static const bool once = (Eigen::setCpuCacheSizes(32 * 1024, 512 * 1024, 2 * 1024 * 1024), true);
  static_cast<void>(once);
}

template <class S>
void activate(Activation activation, Samples<S>& values) {
  if (activation == Activation::relu)
    values = values.cwiseMax(S(0));
  else
    values = values.unaryExpr([](S v) { return std::tanh(v); });
}

/// Times the activation's slope, from its values.
template <class S>
void through_activation(Activation activation, const Samples<S>& values, Samples<S>& by_values) {
  if (activation == Activation::relu)
    by_values = (values.array() > S(0)).select(by_values, S(0));
  else
    by_values.array() *= S(1) - values.array().square();
}

std::vector<std::size_t> shuffled(std::size_t n, Draws& draws) {
  std::vector<std::size_t> order(n);
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (std::size_t i = n; i > 1; --i) std::swap(order[i - 1], order[draws.below(i)]);
  return order;
}

/// Mean loss over all samples, in batches.
double mean_loss(Perceptron<float>& network, const Samples<float>& inputs, const Loss<float>& loss) {
  constexpr Eigen::Index batch = 1024;
  double sum = 0.0;
  std::vector<std::size_t> rows;
  Samples<float> unused;
  for (Eigen::Index from = 0; from < inputs.rows(); from += batch) {
    const Eigen::Index count = std::min(batch, inputs.rows() - from);
    rows.resize(static_cast<std::size_t>(count));
    std::iota(rows.begin(), rows.end(), static_cast<std::size_t>(from));
    const Samples<float>& outputs = network.forward(inputs.middleRows(from, count));
    sum += loss(outputs, rows, unused);
  }
  return sum / static_cast<double>(std::max<Eigen::Index>(1, inputs.rows()));
}

/// A column's spread and median magnitude.
struct Spread {
  double mean = 0.0, deviation = 0.0, median = 0.0;
  bool many = false;  // more than two values
};

Spread spread_of(const Samples<float>& features, Eigen::Index column) {
  Spread s;
  const auto n = static_cast<double>(features.rows());
  std::vector<float> sizes;
  float first = features(0, column), second = first;
  for (Eigen::Index i = 0; i < features.rows(); ++i) {
    const float f = features(i, column);
    s.mean += f / n;
    sizes.push_back(std::abs(f));
    if (f != first && second == first) second = f;
    s.many = s.many || (f != first && f != second);
  }
  for (Eigen::Index i = 0; i < features.rows(); ++i)
    s.deviation += (features(i, column) - s.mean) * (features(i, column) - s.mean) / n;
  s.deviation = std::sqrt(s.deviation);
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
  s.median = sizes[sizes.size() / 2];
  return s;
}

bool told_before(const Samples<float>& features, Eigen::Index column) {
  for (Eigen::Index c = 0; c < column; ++c)
    if ((features.col(c).array() == features.col(column).array()).all()) return true;
  return false;
}

MlpInput scaled(MlpInput in, const Samples<float>& features) {
  const Samples<float> values = inputs_of(features, {in});
  const Spread s = spread_of(values, 0);
  in.mean = static_cast<float>(s.mean);
  in.scale = s.deviation > 0.0 ? static_cast<float>(1.0 / s.deviation) : 0.0f;
  return in;
}

}  // namespace

template <class S>
Perceptron<S>::Perceptron(const std::vector<int>& widths, Activation activation, std::uint64_t seed)
    : widths_(widths), activation_(activation), values_(widths.size()) {
  fix_caches();
  Eigen::Index size = 0;
  for (std::size_t l = 0; l + 1 < widths.size(); ++l) {
    begin_.push_back(size);
    size += Eigen::Index{widths[l] + 1} * widths[l + 1];
  }
  parameters_ = Eigen::VectorX<S>::Zero(size);
  Draws draws(seed);
  for (std::size_t l = 0; l + 1 < widths.size(); ++l) {
    const double most = std::sqrt(6.0 / widths[l]);
    for (Eigen::Index i = 0; i < Eigen::Index{widths[l]} * widths[l + 1]; ++i)
      parameters_[begin_[l] + i] = static_cast<S>(most * (2.0 * draws.uniform() - 1.0));
  }
}

template <class S>
auto Perceptron<S>::weights(std::size_t l) const -> Weights {
  return {parameters_.data() + begin_[l], widths_[l + 1], widths_[l]};
}

template <class S>
Eigen::Map<const Eigen::RowVectorX<S>> Perceptron<S>::biases(std::size_t l) const {
  return {parameters_.data() + begin_[l] + Eigen::Index{widths_[l]} * widths_[l + 1], widths_[l + 1]};
}

template <class S>
const Samples<S>& Perceptron<S>::forward(const Samples<S>& inputs) {
  values_[0] = inputs;
  for (std::size_t l = 0; l + 1 < widths_.size(); ++l) {
    values_[l + 1].noalias() = values_[l] * weights(l).transpose();
    values_[l + 1].rowwise() += biases(l);
    if (l + 2 < widths_.size()) activate(activation_, values_[l + 1]);
  }
  return values_.back();
}

template <class S>
Eigen::VectorX<S> Perceptron<S>::gradient(const Samples<S>& by_outputs) const {
  Eigen::VectorX<S> all(parameters_.size());
  Samples<S> by_values = by_outputs;
  for (std::size_t l = widths_.size() - 1; l-- > 0;) {
    const Eigen::Index in = widths_[l], out = widths_[l + 1];
    Eigen::Map<Samples<S>>(all.data() + begin_[l], out, in).noalias() = by_values.transpose() * values_[l];
    Eigen::Map<Eigen::RowVectorX<S>>(all.data() + begin_[l] + in * out, out) = by_values.colwise().sum();
    if (l == 0) break;
    by_values = (by_values * weights(l)).eval();
    through_activation(activation_, values_[l], by_values);
  }
  return all;
}

template <class S>
std::vector<MlpLayer> Perceptron<S>::layers() const {
  std::vector<MlpLayer> all;
  for (std::size_t l = 0; l + 1 < widths_.size(); ++l) {
    MlpLayer layer{widths_[l], widths_[l + 1], {}, {}};
    const S* at = parameters_.data() + begin_[l];
    const std::size_t count = static_cast<std::size_t>(widths_[l]) * static_cast<std::size_t>(widths_[l + 1]);
    for (std::size_t i = 0; i < count; ++i) layer.weights.push_back(static_cast<float>(at[i]));
    for (std::size_t i = 0; i < static_cast<std::size_t>(widths_[l + 1]); ++i)
      layer.biases.push_back(static_cast<float>(at[count + i]));
    all.push_back(std::move(layer));
  }
  return all;
}

template <class S>
void Adam<S>::step(const Eigen::VectorX<S>& gradient, double rate, Eigen::VectorX<S>& parameters) {
  constexpr double keep_mean = 0.9, keep_square = 0.999, least = 1e-8;
  mean_left_ *= keep_mean;
  square_left_ *= keep_square;
  mean_ += S(1.0 - keep_mean) * (gradient - mean_);
  square_.array() += S(1.0 - keep_square) * (gradient.array().square() - square_.array());
  const S of_mean = S(rate / (1.0 - mean_left_)), of_square = S(1.0 / (1.0 - square_left_));
  parameters.array() -= of_mean * mean_.array() / ((of_square * square_.array()).sqrt() + S(least));
}

template class Perceptron<float>;
template class Perceptron<double>;
template class Adam<float>;
template class Adam<double>;

Trained train(const Samples<float>& inputs, const Loss<float>& loss, const Samples<float>& held_out_inputs,
              const Loss<float>& held_out_loss, int outputs, const TrainSettings& settings,
              const std::function<bool(const Trained&)>& go_on) {
  std::vector<int> widths = {static_cast<int>(inputs.cols())};
  widths.insert(widths.end(), settings.hidden.begin(), settings.hidden.end());
  widths.push_back(outputs);
  Perceptron<float> network(widths, settings.activation, settings.seed);
  Adam<float> adam(network.parameters().size());
  Draws draws(settings.seed + 1);
  const auto rows = static_cast<std::size_t>(inputs.rows()), batch = static_cast<std::size_t>(settings.batch);
  const std::size_t batches = (rows + batch - 1) / batch;
  const double steps = static_cast<double>(batches) * settings.epochs;
  double done = 0.0;
  Trained trained{network.layers(), {}, 0, false};
  Samples<float> some, by_outputs;
  for (int epoch = 0; epoch < settings.epochs && !trained.interrupted; ++epoch) {
    const std::vector<std::size_t> order = shuffled(rows, draws);
    double sum = 0.0;
    for (std::size_t from = 0; from < rows; from += batch, done += 1.0) {
      const std::span<const std::size_t> chosen = std::span(order).subspan(from, std::min(batch, rows - from));
      some.resize(static_cast<Eigen::Index>(chosen.size()), inputs.cols());
      for (std::size_t i = 0; i < chosen.size(); ++i)
        some.row(static_cast<Eigen::Index>(i)) = inputs.row(static_cast<Eigen::Index>(chosen[i]));
      const Samples<float>& given = network.forward(some);
      by_outputs.setZero(given.rows(), given.cols());
      sum += loss(given, chosen, by_outputs);
      by_outputs *= 1.0f / static_cast<float>(chosen.size());
      adam.step(network.gradient(by_outputs), settings.rate * (1.0 - done / steps), network.parameters());
    }
    trained.epochs.push_back({sum / static_cast<double>(rows), mean_loss(network, held_out_inputs, held_out_loss)});
    if (trained.epochs.back().held_out <= trained.epochs[trained.best].held_out) {
      trained.best = trained.epochs.size() - 1;
      trained.layers = network.layers();
    }
    trained.interrupted = !go_on(trained);
  }
  return trained;
}

std::vector<MlpInput> choose_inputs(const Samples<float>& features) {
  std::vector<MlpInput> inputs;
  for (Eigen::Index c = 0; c < features.cols(); ++c) {
    const Spread s = spread_of(features, c);
    if (s.deviation <= 1e-6 * std::abs(s.mean) || told_before(features, c)) continue;
    inputs.push_back(scaled({static_cast<int>(c)}, features));
    if (s.many && s.median > 0.0)
      inputs.push_back(scaled({static_cast<int>(c), static_cast<float>(s.median)}, features));
  }
  return inputs;
}

Samples<float> inputs_of(const Samples<float>& features, const std::vector<MlpInput>& inputs) {
  Samples<float> all(features.rows(), static_cast<Eigen::Index>(inputs.size()));
  for (Eigen::Index i = 0; i < features.rows(); ++i)
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      const MlpInput& in = inputs[k];
      const float f = features(i, in.column), g = in.knee > 0.0f ? f / (in.knee + std::abs(f)) : f;
      all(i, static_cast<Eigen::Index>(k)) = (g - in.mean) * in.scale;
    }
  return all;
}

}  // namespace solenoid
