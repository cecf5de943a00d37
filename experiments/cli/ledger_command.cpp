#include "controllers/networks.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/result.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/ledger/ledger.hpp"
#include "experiments/profile/profiling.hpp"

#include <cstdio>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

namespace solenoid {
namespace {

struct LedgerCommand {
  LedgerOptions options;
  std::string instances;
  OutputOptions output;
  std::vector<std::string> variants = {"nine_state", "nine_state_4", "nine_robust"};
};

void take_in(const char* option, const std::optional<std::string>& network) {
  try {
    if (network) take_in_network_file(*network);
  } catch (const ConfigError& wrong) {
    throw ConfigError(fmt::format("{}: {}", option, wrong.what()));
  }
}

int ledger(LedgerCommand command) {
  const InterruptGuard guard;
  take_in("--policy", command.options.policy_network);
  take_in("--cost", command.options.cost_network);
  InstanceSet set = instances_from(command.instances);
  select_variants(command.variants, set);
  const bool terminal = isatty(STDERR_FILENO) != 0;
  command.options.stop = InterruptGuard::raised;
  command.options.progress = [&](const std::string& variant, std::size_t done, std::size_t of) {
    if (terminal) fmt::print(stderr, "\r\033[Kledger: {}, {} of {} states", variant, done, of);
    if (terminal && done == of) fmt::print(stderr, "\r\033[K");
    if (!terminal && done == of) fmt::print(stderr, "ledger: {}, {} states\n", variant, of);
    std::fflush(stderr);
  };
  const auto kept = keep_ledger(set, command.options);
  command.output.write(result_of(kept), !InterruptGuard::raised());
  if (InterruptGuard::raised()) return interrupted;
  for (const LedgerOfVariant& variant : kept)
    if (!variant.violations.empty()) return failure;
  return success;
}

}  // namespace

void add_ledger(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<LedgerCommand>();
  CLI::App* command =
      app.add_subcommand("ledger", "optimality gaps of every kind of solver on the same recorded problems");
  command->add_option("--instances", options->instances, "this file of problems; default: the shipped ones")
      ->type_name(value_kind::file);
  command
      ->add_option("--variant", options->variants,
                   "problems of these variants; default nine_state,nine_state_4,nine_robust")
      ->type_name(value_kind::variant)
      ->delimiter(',');
  command->add_option("--states", options->options.states, "recorded states a variant; default 200")
      ->check(CLI::Range(1, 100000));
  command->add_option("--bonmin", options->options.bonmin_states, "of these, how many Bonmin gets; default 20")
      ->check(CLI::Range(0, 100000));
  command->add_option("--bonmin-limit-s", options->options.bonmin_limit_s, "its time on each; default 5")
      ->check(CLI::Range(1e-3, 86400.0));
  command
      ->add_option("--policy", options->options.policy_network,
                   "network that proposes modes; a shipped one or a file; default nine_policy, where it fits a variant")
      ->type_name(value_kind::file);
  command
      ->add_option("--cost", options->options.cost_network,
                   "network that says what the blocks behind the first two cost; default nine_tail, where it fits")
      ->type_name(value_kind::file);
  add_output_options(*command, options->output);
  command->callback([options, &exit_code] { exit_code = ledger(*options); });
}

}  // namespace solenoid
