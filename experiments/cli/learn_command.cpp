#include "core/config/reader.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/base/result.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/learn/judge.hpp"
#include "experiments/learn/learn.hpp"

#include <cstdio>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

void tell_progress(const std::string& line) {
  fmt::print(stderr, "{}\n", line);
  std::fflush(stderr);
}

struct TeachArguments {
  LearnTask task;
  std::string activation = "relu";
  std::uint64_t seed = 1;
  OutputOptions output;
};

void draw_losses(const Result& result, const std::string& folder) {
  try {
    draw(*result.plot, folder + "/loss.svg");
  } catch (const ConfigError& error) {
    fmt::print(stderr, "solenoid: no picture: {}\n", error.what());
  }
}

int teach(TeachArguments arguments) {
  LearnTask& task = arguments.task;
  const InterruptGuard guard;
  task.interrupted = InterruptGuard::raised;
  task.tell = tell_progress;
  task.samples.seed = task.training.seed = arguments.seed;
  task.training.activation = arguments.activation == "relu" ? Activation::relu : Activation::tanh;
  if (task.out.empty())
    task.out = fmt::format("results/learn-{}-{}", task.samples.taught == Taught::modes ? "policy" : "cost",
                           compact_timestamp());
  const std::optional<LearnResult> learned = learn(task);
  if (!learned) return interrupted;
  const Result result = result_of(*learned);
  arguments.output.write(result);
  draw_losses(result, task.out);
  if (!learned->trained.interrupted) return success;
  fmt::print(stderr, "solenoid: interrupted after {} epochs; the network is the best so far\n",
             learned->trained.epochs.size());
  return interrupted;
}

void add_teaching(CLI::App& command, TeachArguments& a) {
  LearnTask& t = a.task;
  command.add_option("--variant", t.variant, "the teacher, whose problems are solved to the end; default nine_robust")
      ->type_name(value_kind::variant);
  command
      .add_option("--campaign", t.campaign,
                  "file or shipped campaign; scenarios named held_out... judge, the others teach; default learning")
      ->type_name(value_kind::campaign);
  command.add_option("--states", t.states, "problems to record, and a quarter of it to judge; default 100000")
      ->check(CLI::Range(10, 10000000));
  command
      .add_option("--perturbed", t.samples.perturbed, "copies of each problem at states beside its own; default 0.5")
      ->check(CLI::Range(0.0, 100.0));
  command.add_option("--seed", a.seed, "of samples, first weights and order; default 1")
      ->check(CLI::Range(0, 1000000000));
  command.add_option("--epochs", t.training.epochs, "default 50")->check(CLI::Range(1, 100000));
  command.add_option("--hidden", t.training.hidden, "widths of hidden layers; default 48,32")
      ->delimiter(',')
      ->check(CLI::Range(1, mlp_limits::width));
  command.add_option("--activation", a.activation, "relu or tanh; default relu")
      ->check(CLI::IsMember({"relu", "tanh"}));
  command.add_option("--batch", t.training.batch, "samples a step; default 256")->check(CLI::Range(1, 1000000));
  command.add_option("--rate", t.training.rate, "of Adam's first step; it falls to 0; default 0.002")
      ->check(CLI::Range(1e-8, 1.0));
  command
      .add_option("--out", t.out,
                  "folder; what is there of an earlier network is replaced; default a new one in results")
      ->type_name(value_kind::folder)
      ->check([](const std::string& text) { return text.empty() ? "empty (allowed: a folder)" : std::string(); });
  add_output_options(command, a.output, {"table", "json"});
}

void add_policy(CLI::App& learn, int& exit_code) {
  const auto a = std::make_shared<TeachArguments>();
  CLI::App* command = learn.add_subcommand("policy", "teach a network the modes of optimal plans");
  command
      ->add_option("--emphasis", a->task.samples.emphasis,
                   "weight of problems whose optimum is not the warm start; default 4")
      ->check(CLI::Range(0.0, 1e6));
  add_teaching(*command, *a);
  command->callback([a, &exit_code] { exit_code = teach(*a); });
}

void add_cost(CLI::App& learn, int& exit_code) {
  const auto a = std::make_shared<TeachArguments>();
  a->task.samples.taught = Taught::cost;
  CLI::App* command =
      learn.add_subcommand("cost", "teach a network what the blocks behind the first ones cost at best");
  command->add_option("--searched-blocks", a->task.samples.searched_blocks, "first ones; default 2")
      ->check(CLI::Range(1, 31));
  command
      ->add_option("--ways", a->task.samples.ways,
                   "sequences of the first ones that a state is followed along; default 4")
      ->check(CLI::Range(1, 1000));
  add_teaching(*command, *a);
  command->callback([a, &exit_code] { exit_code = teach(*a); });
}

struct JudgeArguments {
  JudgeTask task;
  OutputOptions output;
};

int judge_and_print(JudgeArguments arguments) {
  const InterruptGuard guard;
  arguments.task.interrupted = InterruptGuard::raised;
  arguments.task.tell = tell_progress;
  const std::optional<JudgeResult> result = judge(arguments.task);
  if (!result) return interrupted;
  arguments.output.write(result_of(*result));
  return success;
}

void add_evaluate(CLI::App& learn, int& exit_code) {
  const auto a = std::make_shared<JudgeArguments>();
  JudgeTask& t = a->task;
  CLI::App* command = learn.add_subcommand(
      "evaluate", "judge a taught variant beside its teacher, on plants that it was not taught on");
  command->add_option("variant", t.variant, "with --network the teacher; default nine_policy")
      ->type_name(value_kind::variant);
  command->add_option("--network", t.network, "a network's file in place of the variant's own")
      ->type_name(value_kind::toml);
  command
      ->add_option("--campaign", t.campaign,
                   "file or shipped campaign; its scenarios named held_out...; default learning")
      ->type_name(value_kind::campaign);
  command->add_option("--states", t.states, "problems to record; default 20000")->check(CLI::Range(1, 10000000));
  command->add_option("--searched-blocks", t.searched_blocks, "before a learned cost of --network; default 2")
      ->check(CLI::Range(1, 31));
  command->add_option("--passes", t.passes, "over the problems, of each the least time; default 5")
      ->check(CLI::Range(1, 1000));
  add_output_options(*command, a->output);
  command->callback([a, &exit_code] { exit_code = judge_and_print(*a); });
}

}  // namespace

void add_learn(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("learn", "teach networks what the search finds, and judge them");
  command->require_subcommand(1);
  add_policy(*command, exit_code);
  add_cost(*command, exit_code);
  add_evaluate(*command, exit_code);
}

}  // namespace solenoid
