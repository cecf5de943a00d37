#include "experiments/learn/learn.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/result.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/learn/held_out.hpp"
#include "experiments/profile/record.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

using Column = Table::Column;

/// What the hidden layers of so many inputs and outputs may be.
void check_layers(const TrainSettings& settings, std::size_t inputs, std::size_t outputs) {
  constexpr std::size_t most_layers = mlp_limits::layers - 1;
  if (settings.hidden.size() > most_layers)
    throw ConfigError(fmt::format("--hidden: {} layers (allowed: at most {})", settings.hidden.size(), most_layers));
  std::size_t weights = 0, before = inputs;
  for (const int width : settings.hidden) {
    weights += before * static_cast<std::size_t>(width);
    before = static_cast<std::size_t>(width);
  }
  weights += before * outputs;
  if (weights > static_cast<std::size_t>(mlp_limits::weights))
    throw ConfigError(fmt::format("--hidden: at least {} weights (allowed: at most {})", weights, mlp_limits::weights));
}

/// What a cost is taught of: blocks behind the searched ones.
void check_searched(const LearnTask& task, const VariantConfig& v, int blocks) {
  if (blocks < 2)
    throw ConfigError(
        fmt::format("--variant: '{}' has one block, none is left behind those that are searched "
                    "(allowed: a variant of at least 2 blocks)",
                    v.name));
  if (task.samples.searched_blocks < 1 || task.samples.searched_blocks >= blocks)
    throw ConfigError(fmt::format("--searched-blocks: {} of the {} blocks of '{}' (allowed: 1 to {})",
                                  task.samples.searched_blocks, blocks, v.name, blocks - 1));
}

std::size_t outputs_of(const LearnTask& task, const AnyProblem& problem) {
  if (task.samples.taught == Taught::cost) return 1;
  return problem.horizon.blocks.size() * static_cast<std::size_t>(problem.modes.size());
}

/// What a network's inputs, layers and outputs may be at most, before anybody waits for it. How many inputs say
/// something is known of the samples alone: at least one.
void check_sizes(const LearnTask& task, const VariantConfig& v) {
  constexpr auto width = static_cast<std::size_t>(mlp_limits::width);
  const auto problem = system_of(v).problem(v);
  const std::size_t blocks = problem->horizon.blocks.size(), outputs = outputs_of(task, *problem),
                    features = system_of(v).tools(v).features(*problem)->size();
  if (task.samples.taught == Taught::cost) check_searched(task, v, static_cast<int>(blocks));
  if (outputs > width)
    throw ConfigError(fmt::format("--variant: '{}' has {} modes in {} blocks: {} scores (allowed: at most {})", v.name,
                                  problem->modes.size(), blocks, outputs, width));
  if (features > width)
    throw ConfigError(
        fmt::format("--variant: problems of '{}' have {} features (allowed: at most {})", v.name, features, width));
  check_layers(task.training, 1, outputs);
}

/// The inputs that samples have something to say by.
std::vector<MlpInput> inputs_to_teach(const LearnTask& task, const TrainingSet& set) {
  std::vector<MlpInput> inputs = choose_inputs(set.features);
  if (inputs.empty())
    throw ConfigError(
        fmt::format("--campaign: all {} samples of '{}' have the same features (allowed: scenarios in "
                    "which something moves)",
                    set.size(), task.campaign));
  if (inputs.size() > static_cast<std::size_t>(mlp_limits::width))
    throw ConfigError(fmt::format("--variant: features of '{}' are {} inputs (allowed: at most {})", task.variant,
                                  inputs.size(), mlp_limits::width));
  check_layers(task.training, inputs.size(), set.costs.empty() ? set.blocks * set.patterns.size() : 1);
  return inputs;
}

Json losses_json(const Trained& trained) {
  Json all = Json::array();
  for (const Epoch& e : trained.epochs) all.push_back({{"training", e.training}, {"held_out", e.held_out}});
  return all;
}

Json quality_json(const LearnResult& r) {
  const TaughtQuality& q = r.quality;
  if (r.task.samples.taught == Taught::modes)
    return {{"samples", q.samples}, {"first_block_share", q.first_block}, {"all_blocks_share", q.all_blocks}};
  return {{"samples", q.samples},
          {"relative_error_p50", q.error_p50},
          {"relative_error_p90", q.error_p90},
          {"relative_error_max", q.error_max},
          {"overestimated_share", q.violations},
          {"overestimate_p50", q.violation_p50},
          {"overestimate_p90", q.violation_p90},
          {"overestimate_max", q.violation_max}};
}

/// Everything that it takes to make the network again, and what came of it.
Json manifest(const LearnResult& r) {
  const LearnTask& t = r.task;
  return {
      {"kind", r.network.kind},
      {"network", fingerprint(mlp_text(r.network))},
      {"layout", r.network.layout},
      {"data",
       {{"variant", t.variant},
        {"campaign", t.campaign},
        {"states", t.states},
        {"perturbed", t.samples.perturbed},
        {"emphasis", t.samples.emphasis},
        {"searched_blocks", t.samples.taught == Taught::cost ? Json(t.samples.searched_blocks) : Json()},
        {"ways", t.samples.taught == Taught::cost ? Json(t.samples.ways) : Json()},
        {"seed", t.samples.seed},
        {"training", {{"scenarios", r.training_scenarios}, {"samples", r.training_samples}, {"hash", r.training_hash}}},
        {"held_out",
         {{"scenarios", r.held_out_scenarios}, {"samples", r.held_out_samples}, {"hash", r.held_out_hash}}}}},
      {"settings",
       {{"hidden", t.training.hidden},
        {"activation", t.training.activation == Activation::relu ? "relu" : "tanh"},
        {"epochs", t.training.epochs},
        {"batch", t.training.batch},
        {"rate", t.training.rate},
        {"seed", t.training.seed}}},
      {"interrupted", r.trained.interrupted},
      {"best_epoch", r.trained.best},
      {"losses", losses_json(r.trained)},
      {"held_out", quality_json(r)}};
}

std::string loss_csv(const Trained& trained) {
  std::string csv = "epoch,training,held_out\n";
  for (std::size_t i = 0; i < trained.epochs.size(); ++i)
    csv += fmt::format("{},{},{}\n", i + 1, trained.epochs[i].training, trained.epochs[i].held_out);
  return csv;
}

Plot loss_plot(const Trained& trained) {
  std::string data;
  for (std::size_t i = 0; i < trained.epochs.size(); ++i)
    data += fmt::format("{} {} {}\n", i + 1, trained.epochs[i].training, trained.epochs[i].held_out);
  return {.width = 960,
          .height = 480,
          .settings = "set xlabel 'epoch'\nset ylabel 'mean loss'\nset logscale y\n",
          .panels = {{"",
                      data,
                      {{fmt::format("using 1:2 with lines lw 2 lc rgb '{}'", plot_colour(0)), "training"},
                       {fmt::format("using 1:3 with lines lw 2 lc rgb '{}'", plot_colour(1)), "held out"}}}}};
}

}  // namespace

VariantConfig teacher_of(VariantConfig v) {
  if (v.is_feedback_law())
    throw ConfigError(
        fmt::format("variant '{}' is a law and plans nothing (allowed: a variant with a solver)", v.name));
  v.solver = "branch_and_bound";
  v.learned = {};
  v.deadline_ms.reset();
  return v;
}

std::optional<LearnResult> learn(const LearnTask& task) {
  LearnResult r;
  r.task = task;
  const SplitCampaign split = split_campaign(task.campaign, task.variant);
  check_sizes(task, split.training.variants.front());
  if (!task.out.empty()) create_folder(task.out);
  const auto samples_of = [&](const Campaign& campaign, std::size_t states) {
    const InstanceSet set = record_instances(campaign, states, task.interrupted);
    return training_set(set, set.variants.front(), task.samples, task.interrupted);
  };
  task.tell("learn: recording the teacher's closed loops, training plants");
  const TrainingSet set = samples_of(split.training, task.states);
  task.tell("learn: held-out plants");
  const TrainingSet held_out = samples_of(split.held_out, std::max<std::size_t>(1, task.states / 4));
  if (task.interrupted()) return std::nullopt;
  if (set.size() < 2 || held_out.size() == 0)
    throw ConfigError(fmt::format("--states: {} make {} samples to teach and {} to judge (allowed: more states)",
                                  task.states, set.size(), held_out.size()));
  r.training_samples = set.size(), r.held_out_samples = held_out.size();
  r.training_hash = set.hash, r.held_out_hash = held_out.hash;
  r.training_scenarios = split.training_names, r.held_out_scenarios = split.held_out_names;
  const std::vector<MlpInput> inputs = inputs_to_teach(task, set);
  const TaughtTargets targets = targets_of(set);
  r.trained = train_on(set, held_out, inputs, targets, task.training, [&](const Trained& t) {
    task.tell(fmt::format("learn: epoch {} of {}: loss {:.4g}, held out {:.4g}", t.epochs.size(), task.training.epochs,
                          t.epochs.back().training, t.epochs.back().held_out));
    return !task.interrupted();
  });
  r.network = network_of(set, inputs, targets, r.trained, task.training.activation);
  r.quality = quality_on(held_out, Mlp(r.network));
  if (!task.out.empty()) {
    write_file_atomically(task.out + "/network.toml", mlp_text(r.network));
    write_file_atomically(task.out + "/manifest.json", manifest(r).dump(2) + "\n");
    write_file_atomically(task.out + "/loss.csv", loss_csv(r.trained));
  }
  return r;
}

Result result_of(const LearnResult& r) {
  const TaughtQuality& q = r.quality;
  Table table{.title = fmt::format("'{}' taught on {} samples, judged on {} of plants that it was not taught on",
                                   r.network.kind, r.training_samples, r.held_out_samples)};
  if (r.task.samples.taught == Taught::modes) {
    table.columns = {Column("", "first block as the optimum's %", ".1f%"), Column("", "every block %", ".1f%")};
    table.add({q.first_block, q.all_blocks});
  } else {
    table.columns = {Column("", "error p50 %", ".2f%"), Column("", "p90", ".2f%"),
                     Column("", "max", ".3g"),          Column("", "overestimated %", ".1f%"),
                     Column("", "by p50 %", ".2f%"),    Column("", "p90", ".2f%"),
                     Column("", "max", ".3g")};
    table.add({q.error_p50, q.error_p90, q.error_max, q.violations, q.violation_p50, q.violation_p90, q.violation_max});
  }
  Result result{.facts = manifest(r), .tables = {table}, .plot = loss_plot(r.trained)};
  if (!r.task.out.empty())
    result.notes = {fmt::format("Network: {0}/network.toml; how it was made: {0}/manifest.json", r.task.out)};
  return result;
}

}  // namespace solenoid
