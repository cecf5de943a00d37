#pragma once

#include "controllers/variant.hpp"
#include "experiments/learn/training_set.hpp"

#include <functional>
#include <optional>
#include <string>

namespace solenoid {

struct Result;

/// What is taught, on what, how, and where to.
struct LearnTask {
  std::string variant = "nine_robust";  ///< whose problems, solved to the end by branch and bound, are the teacher
  std::string campaign = "learning";    ///< scenarios named held_out... judge, the others teach
  std::size_t states = 100000;          ///< problems recorded in the teacher's closed loops; a quarter of it to judge
  SampleSettings samples;
  TrainSettings training;
  std::string out;  ///< folder
  std::function<bool()> interrupted = [] { return false; };
  std::function<void(const std::string&)> tell = [](const std::string&) {};  ///< how far it is
};

/// How good a network is on samples that it was not taught.
struct TaughtQuality {
  std::size_t samples = 0;
  /// Of modes: shares of samples whose first block, whose every block is that of the optimum.
  double first_block = 0.0, all_blocks = 0.0;
  /// Of costs: the error relative to the true cost plus the floor; share of samples whose cost is overestimated (there
  /// the learned cost is no lower bound), and by how much.
  double error_p50 = 0.0, error_p90 = 0.0, error_max = 0.0;
  double violations = 0.0, violation_p50 = 0.0, violation_p90 = 0.0, violation_max = 0.0;
};

/// What came of it.
struct LearnResult {
  LearnTask task;
  MlpData network;
  Trained trained;
  std::size_t training_samples = 0, held_out_samples = 0;
  std::string training_hash, held_out_hash;
  std::vector<std::string> training_scenarios, held_out_scenarios;
  TaughtQuality quality;
};

/// Records the teacher's closed loops, makes samples of them, trains, and writes network.toml, manifest.json and
/// loss.csv into the folder. Nothing if it was interrupted before there was a network; interrupted later, it is the
/// best so far. The same task gives the same network to the last bit. Throws ConfigError naming option or key, and
/// OutputError.
std::optional<LearnResult> learn(const LearnTask& task);

/// How good a network is on samples.
TaughtQuality quality_on(const TrainingSet& set, const Mlp& network);

/// The network of samples whose layers have been trained: of costs with the scale and floor that they were trained
/// with.
struct TaughtTargets {
  double floor = 0.0, mean = 0.0, deviation = 1.0;  ///< of the logarithms of costs
};
/// For the costs of a set.
TaughtTargets targets_of(const TrainingSet& set);
/// Trains on one set, judged by another; of the same layout.
Trained train_on(const TrainingSet& set, const TrainingSet& held_out, const std::vector<MlpInput>& inputs,
                 const TaughtTargets& targets, const TrainSettings& settings,
                 const std::function<bool(const Trained&)>& go_on);
/// As data.
MlpData network_of(const TrainingSet& set, const std::vector<MlpInput>& inputs, const TaughtTargets& targets,
                   const Trained& trained, Activation activation);

/// Names of the variant's problems, its teacher: branch and bound to the end without a network or a deadline.
VariantConfig teacher_of(VariantConfig variant);

/// For a person and as JSON, with the losses drawn.
Result result_of(const LearnResult& result);

}  // namespace solenoid
