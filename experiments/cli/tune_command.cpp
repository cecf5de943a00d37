#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/result.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/slurm_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/cluster/slurm_runner.hpp"
#include "experiments/tune/tune_report.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

struct TuneArguments {
  TuneSettings settings;
  std::vector<std::string> free, limits;
  std::string objective = "rmse";
  OutputOptions output;
  SlurmOptions slurm;
};

/// Reads "air_g=2".
std::pair<std::string, double> parse_limit(const std::string& text) {
  const std::size_t equals = text.find('=');
  double value = 0.0;
  const char* end = text.data() + text.size();
  if (equals == std::string::npos || std::from_chars(text.data() + equals + 1, end, value).ptr != end || !(value > 0) ||
      !std::isfinite(value))
    throw ConfigError(fmt::format("--limit: '{}' is no limit (allowed: KEY=VALUE, above 0)", text));
  return {text.substr(0, equals), value};
}

int run_tuning(TuneArguments& options) {
  TuneSettings& settings = options.settings;
  for (const std::string& text : options.free) settings.free.push_back(parse_free_parameter(text));
  for (const std::string& text : options.limits) settings.limits.insert(parse_limit(text));
  settings.aim = options.objective == "step" ? TuneAim::step : TuneAim::rmse;
  if (settings.out.empty()) settings.out = new_tuning_folder(settings.variant);
  if (options.slurm.wanted) {
    options.slurm.settings.cores = std::max(settings.jobs, 1);
    create_folder(settings.out);
    settings.run = slurm_runner(settings.out, options.slurm.settings);
  }
  const InterruptGuard guard;
  const TuneResult result = tune(settings, [&](const TuneResult& so_far) {
    fmt::print(stderr, "{}\n", tune_progress(settings, so_far));
    std::fflush(stderr);
  });
  if (!result.steps.empty()) {
    options.output.write(result_of(settings, result));
    if (const std::string why = draw_history(result); !why.empty())
      fmt::print(stderr, "solenoid: no picture: {}\n", why);
  }
  if (!result.interrupted()) return success;
  fmt::print(stderr, "solenoid: interrupted after {} steps; the same command with --out {} resumes\n",
             result.steps.size(), result.folder);
  return interrupted;
}

}  // namespace

void add_tune(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<TuneArguments>();
  TuneSettings& s = options->settings;
  CLI::App* command =
      app.add_subcommand("tune", "search a variant's numbers on training plants, judge on held-out ones");
  command->add_option("variant", s.variant, "a variant of the campaign or a shipped one")
      ->type_name(value_kind::variant)
      ->required();
  command
      ->add_option(
          "--free", options->free,
          "a key of the variant and its range, repeatable: cost.switching=1e-9..1e-6:log, horizon.steps=20..100:whole, "
          "horizon.blocks.0=1..6:whole (the first block; steps follow)")
      ->required();
  command
      ->add_option("--campaign", s.campaign,
                   "file or shipped campaign; scenarios named held_out... judge, the others train; default tuning")
      ->type_name(value_kind::campaign);
  command
      ->add_option("--objective", options->objective,
                   "rmse: the system's own error; step: overshoot and steady-state error of step tests; default rmse")
      ->check(CLI::IsMember({"rmse", "step"}));
  command->add_option("--algorithm", s.algorithm, "of NLopt; default subplex")->check(CLI::IsMember(tune_algorithms()));
  command->add_option("--evaluations", s.evaluations, "at most; default 60")->check(CLI::Range(1, 100000));
  command->add_option("--patience", s.patience, "end after so many without a better one; default 25")
      ->check(CLI::Range(1, 100000));
  command->add_option(
      "--limit", options->limits,
      "KEY=VALUE of an effort that costs nothing, repeatable: switches_per_s=20, air_g=2; default: what "
      "the variant needs as it is");
  add_jobs_option(*command, s.jobs);
  add_out_option(*command, s.out, "folder");
  add_output_options(*command, options->output, {"table", "json"});
  add_slurm_options(*command, options->slurm, false);
  command->callback([options, command, &exit_code] {
    options->slurm.require_slurm(*command);
    exit_code = run_tuning(*options);
  });
}

}  // namespace solenoid
