#include "core/metrics/metrics.hpp"
#include "experiments/learn/learn.hpp"
#include "solvers/search/model_functions.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid {
namespace {

/// Cross-entropy of the softmax over each block's modes, summed over blocks, times the sample's weight.
Loss<float> cross_entropy(const TrainingSet& set) {
  return [&set, blocks = set.blocks, modes = set.patterns.size()](
             const Samples<float>& outputs, std::span<const std::size_t> samples, Samples<float>& by_outputs) {
    double sum = 0.0;
    std::vector<double> share(modes);
    for (std::size_t i = 0; i < samples.size(); ++i)
      for (std::size_t b = 0; b < blocks; ++b) {
        const float* scores = outputs.data() + i * blocks * modes + b * modes;
        const double highest = *std::max_element(scores, scores + modes);
        double all = 0.0;
        for (std::size_t m = 0; m < modes; ++m) all += share[m] = exponential(static_cast<double>(scores[m]) - highest);
        const auto wanted = static_cast<std::size_t>(set.modes[samples[i] * blocks + b]);
        const double weight = set.weights[samples[i]];
        sum += weight * (logarithm(all) + highest - static_cast<double>(scores[wanted]));
        if (by_outputs.size() == 0) continue;
        float* slope = by_outputs.data() + i * blocks * modes + b * modes;
        for (std::size_t m = 0; m < modes; ++m)
          slope[m] = static_cast<float>(weight * (share[m] / all - (m == wanted ? 1.0 : 0.0)));
      }
    return sum;
  };
}

/// Half the squared error of the scaled logarithm of the cost.
Loss<float> squared_error(const TrainingSet& set, const TaughtTargets& targets) {
  return
      [&set, targets](const Samples<float>& outputs, std::span<const std::size_t> samples, Samples<float>& by_outputs) {
        double sum = 0.0;
        for (std::size_t i = 0; i < samples.size(); ++i) {
          const double wanted = (logarithm(set.costs[samples[i]] + targets.floor) - targets.mean) / targets.deviation;
          const double error = static_cast<double>(outputs.data()[i]) - wanted;
          sum += 0.5 * error * error;
          if (by_outputs.size() > 0) by_outputs.data()[i] = static_cast<float>(error);
        }
        return sum;
      };
}

Loss<float> loss_of(const TrainingSet& set, const TaughtTargets& targets) {
  return set.costs.empty() ? cross_entropy(set) : squared_error(set, targets);
}

/// Which of a block's modes has the highest score; of equal ones the first.
std::size_t best_mode(const float* scores, std::size_t modes) {
  return static_cast<std::size_t>(std::max_element(scores, scores + modes) - scores);
}

void judge_modes(const TrainingSet& set, const Mlp& network, TaughtQuality& q) {
  std::vector<float> scores(network.outputs());
  const std::size_t modes = set.patterns.size();
  std::size_t first = 0, all = 0;
  for (std::size_t i = 0; i < set.size(); ++i) {
    network.evaluate({set.features.data() + i * network.features(), network.features()}, scores);
    std::size_t right = 0;
    for (std::size_t b = 0; b < set.blocks; ++b) {
      const bool same = best_mode(&scores[b * modes], modes) == static_cast<std::size_t>(set.modes[i * set.blocks + b]);
      right += same;
      first += same && b == 0;
    }
    all += right == set.blocks;
  }
  const auto count = static_cast<double>(std::max<std::size_t>(1, set.size()));
  q.first_block = static_cast<double>(first) / count;
  q.all_blocks = static_cast<double>(all) / count;
}

void judge_costs(const TrainingSet& set, const Mlp& network, TaughtQuality& q) {
  std::vector<double> errors, violations;
  const double floor = network.data().log_floor;
  for (std::size_t i = 0; i < set.size(); ++i) {
    float y = 0.0f;
    network.evaluate({set.features.data() + i * network.features(), network.features()}, std::span(&y, 1));
    const double cost = std::max(0.0, exponential(static_cast<double>(y)) - floor);
    const double error = (cost - set.costs[i]) / (set.costs[i] + floor);
    errors.push_back(std::abs(error));
    if (error > 0.0) violations.push_back(error);
  }
  q.violations = static_cast<double>(violations.size()) / static_cast<double>(std::max<std::size_t>(1, set.size()));
  const Percentiles e = percentiles(errors), v = percentiles(violations);
  q.error_p50 = e.p50, q.error_p90 = e.p90, q.error_max = e.max;
  q.violation_p50 = v.p50, q.violation_p90 = v.p90, q.violation_max = v.max;
}

}  // namespace

TaughtTargets targets_of(const TrainingSet& set) {
  TaughtTargets t;
  if (set.costs.empty()) return t;
  std::vector<double> sorted = set.costs;
  std::ranges::sort(sorted);
  t.floor = std::max(0.3 * sorted[sorted.size() / 2], 1e-30);
  const auto n = static_cast<double>(sorted.size());
  for (const double cost : set.costs) t.mean += logarithm(cost + t.floor) / n;
  double variance = 0.0;
  for (const double cost : set.costs) {
    const double apart = logarithm(cost + t.floor) - t.mean;
    variance += apart * apart / n;
  }
  t.deviation = variance > 0.0 ? std::sqrt(variance) : 1.0;
  return t;
}

Trained train_on(const TrainingSet& set, const TrainingSet& held_out, const std::vector<MlpInput>& inputs,
                 const TaughtTargets& targets, const TrainSettings& settings,
                 const std::function<bool(const Trained&)>& go_on) {
  const int outputs = set.costs.empty() ? static_cast<int>(set.blocks * set.patterns.size()) : 1;
  return train(inputs_of(set.features, inputs), loss_of(set, targets), inputs_of(held_out.features, inputs),
               loss_of(held_out, targets), outputs, settings, go_on);
}

MlpData network_of(const TrainingSet& set, const std::vector<MlpInput>& inputs, const TaughtTargets& targets,
                   const Trained& trained, Activation activation) {
  MlpData d;
  d.kind = set.costs.empty() ? "policy" : "cost";
  d.layout = set.layout;
  d.features = static_cast<int>(set.features.cols());
  d.activation = activation;
  if (set.costs.empty()) d.labels = set.patterns;
  d.inputs = inputs;
  d.layers = trained.layers;
  if (set.costs.empty()) return d;
  d.log_floor = targets.floor;
  MlpLayer& head = d.layers.back();  // whose outputs were trained at mean 0 and deviation 1
  for (float& w : head.weights) w = static_cast<float>(targets.deviation * static_cast<double>(w));
  for (float& b : head.biases) b = static_cast<float>(targets.deviation * static_cast<double>(b) + targets.mean);
  return d;
}

TaughtQuality quality_on(const TrainingSet& set, const Mlp& network) {
  TaughtQuality q;
  q.samples = set.size();
  if (set.costs.empty())
    judge_modes(set, network, q);
  else
    judge_costs(set, network, q);
  return q;
}

}  // namespace solenoid
