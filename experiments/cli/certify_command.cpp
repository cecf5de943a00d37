#include "experiments/base/interrupt.hpp"
#include "experiments/base/result.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/profile/certify.hpp"

#include <chrono>
#include <cstdio>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

namespace solenoid {
namespace {

struct CertifyArguments {
  CertifyTask task;
  OutputOptions output;
};

/// A moving line on a terminal; otherwise one every few seconds.
class CertifyProgress {
 public:
  explicit CertifyProgress(std::size_t states) : states_(states) {}

  void show(std::size_t done) {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < std::chrono::milliseconds(terminal_ ? 200 : 5000)) return;
    last_ = now;
    fmt::print(stderr, "{}certify: {} of {} problems{}", terminal_ ? "\r\033[K" : "", done, states_,
               terminal_ ? "" : "\n");
    std::fflush(stderr);
  }
  void close() const {
    if (terminal_) fmt::print(stderr, "\r\033[K");
    std::fflush(stderr);
  }

 private:
  bool terminal_ = isatty(STDERR_FILENO) != 0;
  std::size_t states_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

int certify_and_print(CertifyArguments arguments) {
  const InterruptGuard guard;
  CertifyProgress progress(arguments.task.states);
  arguments.task.interrupted = InterruptGuard::raised;
  arguments.task.progress = [&](std::size_t done) { progress.show(done); };
  const Certificate found = certify(arguments.task);
  progress.close();
  if (!found.complete() && found.solves.empty()) return interrupted;
  arguments.output.write(result_of(found), found.complete());
  if (found.broken())
    fmt::print(stderr, "solenoid: {}: {} solves beyond the bound, {} plans worse than holding, {} wrong bounds\n",
               found.variant.name, found.exceeded(), found.deadline.worse_than_hold, found.deadline.wrong_bounds);
  if (!found.complete()) {
    fmt::print(stderr, "solenoid: interrupted after {} problems\n", found.solves.size());
    return interrupted;
  }
  return found.broken() ? failure : success;
}

}  // namespace

void add_certify(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CertifyArguments>();
  CertifyTask& task = options->task;
  CLI::App* command = app.add_subcommand("certify", "the most that one solve can cost, whatever it is asked");
  command->add_option("variant", task.variant, "one of `list variants`, or of --campaign")
      ->type_name(value_kind::variant)
      ->required();
  command
      ->add_option("--campaign", task.campaign,
                   "take variant and motions from this; default: the system's own in real time")
      ->type_name(value_kind::campaign);
  command->add_option("--states", task.states, "random problems to solve; default 5000")
      ->check(CLI::Range(1, 100000000));
  command->add_option("--seed", task.seed, "of the random problems; default 1");
  command
      ->add_option("--deadline-ms", task.deadline_ms,
                   "in place of the variant's; default for those without: the period")
      ->check(CLI::Range(0.0001, 60000.0));
  command->add_option("--jobs", task.jobs, "worker processes; default 1: they disturb each other's times")
      ->check(CLI::Range(1, 1024));
  command->add_option("--core", task.core, "core to run on; default: the last this process may use")
      ->check(CLI::Range(0, 1023));
  add_output_options(*command, options->output);
  command->callback([options, &exit_code] { exit_code = certify_and_print(*options); });
}

}  // namespace solenoid
