#include "core/config/reader.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/base/result.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/slurm_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/study/fishing.hpp"
#include "experiments/study/sweep.hpp"
#include "experiments/systems/actuator/force_ratio/force_ratio.hpp"
#include "experiments/systems/actuator/health/health_study.hpp"
#include "experiments/systems/actuator/identify/coverage_study.hpp"
#include "experiments/systems/actuator/identify/residual_study.hpp"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <thread>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

struct FishingCommand {
  std::vector<int> intervals = {12, 24, 48, 96, 192, 384, 768, 1536};
  OutputOptions output;
};

int fishing(const FishingCommand& command) {
  for (const int count : command.intervals)
    if (fishing_model_steps % count != 0)
      throw ConfigError(
          fmt::format("--intervals: {} does not divide {} (allowed: its divisors)", count, fishing_model_steps));
  const InterruptGuard guard;
  const FishingStudy study = study_fishing(
      command.intervals, [](const std::string& what) { fmt::print(stderr, "fishing: {}\n", what); },
      InterruptGuard::raised);
  command.output.write(result_of(study), !InterruptGuard::raised());
  return InterruptGuard::raised() ? interrupted : success;
}

void add_fishing(CLI::App& study, int& exit_code) {
  auto options = std::make_shared<FishingCommand>();
  CLI::App* command = study.add_subcommand("fishing", "Lotka-Volterra fishing: relaxed, rounded, two switches");
  command->add_option("--intervals", options->intervals, "grids, coarse to fine: divisors of 1536")
      ->delimiter(',')
      ->check(CLI::Range(1, fishing_model_steps));
  add_output_options(*command, options->output);
  add_figure_options(*command, options->output);
  command->callback([options, &exit_code] { exit_code = fishing(*options); });
}

struct CoverageCommand {
  CoverageSettings settings;
  std::string twin_file;
  OutputOptions output;
};

int coverage(CoverageCommand& command) {
  if (!command.twin_file.empty()) command.settings.twin = read_twin_file(command.twin_file);
  if (command.settings.jobs == 0)
    command.settings.jobs = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const InterruptGuard guard;
  const CoverageStudy study = study_coverage(
      command.settings,
      [&](int done) { fmt::print(stderr, "identification: {} of {} seeds\n", done, command.settings.seeds); },
      InterruptGuard::raised);
  command.output.write(result_of(study), !study.interrupted);
  return study.interrupted ? interrupted : study.failed > 0 ? failure : success;
}

void add_identification(CLI::App& study, int& exit_code) {
  auto options = std::make_shared<CoverageCommand>();
  CLI::App* command = study.add_subcommand(
      "identification", "identified values against the truth of a twin that has the model's equations, seed by seed");
  command->add_option("--seeds", options->settings.seeds, "so many, counting up from 1; default 100")
      ->check(CLI::Range(1, 100000));
  command
      ->add_option("--twin", options->twin_file,
                   "TOML of another twin (docs/reference/twin.md); default: the study's own")
      ->type_name(value_kind::toml);
  options->settings.jobs = 0;
  add_jobs_option(*command, options->settings.jobs);
  add_output_options(*command, options->output);
  add_figure_options(*command, options->output);
  command->callback([options, &exit_code] { exit_code = coverage(*options); });
}

struct HealthCommand {
  HealthStudySettings settings;
  OutputOptions output;
};

int valve_health(HealthCommand command) {
  if (command.settings.jobs == 0)
    command.settings.jobs = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const InterruptGuard guard;
  const HealthStudy study = study_valve_health(
      command.settings, [](const std::string& what) { fmt::print(stderr, "valve-health: {}\n", what); },
      InterruptGuard::raised);
  command.output.write(result_of(study), !study.interrupted);
  return study.interrupted ? interrupted : study.failed > 0 ? failure : success;
}

void add_valve_health(CLI::App& study, int& exit_code) {
  auto options = std::make_shared<HealthCommand>();
  HealthStudySettings& s = options->settings;
  CLI::App* command = study.add_subcommand(
      "valve-health", "coils that fail, on plants nobody is told of: found how soon, taken for which, error after");
  command->add_option("--plants", s.plants, "of each row, with hidden mismatches; default 200")
      ->check(CLI::Range(1, 100000));
  command->add_option("--healthy-hours", s.healthy_hours, "of sound plants, for false alarms; default 0.1")
      ->check(CLI::Range(0.0, 1000.0));
  command->add_flag("--every-kind", s.every_kind, "valves that leak and slow ones too");
  command
      ->add_option("--valves", s.variants,
                   "health_two_way, health_pcm_2, or a variant with valve_health; default these two")
      ->delimiter(',');
  s.jobs = 0;
  add_jobs_option(*command, s.jobs);
  add_output_options(*command, options->output);
  command->callback([options, &exit_code] { exit_code = valve_health(*options); });
}

struct ResidualCommand {
  ResidualStudySettings settings;
  OutputOptions output;
};

int residual(ResidualCommand command) {
  if (command.settings.jobs == 0)
    command.settings.jobs = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  const InterruptGuard guard;
  const ResidualStudy study = study_residual(
      command.settings, [](const std::string& what) { fmt::print(stderr, "residual: {}\n", what); },
      InterruptGuard::raised);
  command.output.write(result_of(study), !study.interrupted);
  return study.interrupted ? interrupted : study.failed > 0 ? failure : success;
}

void add_residual(CLI::App& study, int& exit_code) {
  auto options = std::make_shared<ResidualCommand>();
  ResidualStudySettings& s = options->settings;
  CLI::App* command = study.add_subcommand(
      "residual", "nine_robust without and with identified residuals, on plants nobody is told of");
  command->add_option("--plants", s.plants, "of each of two motions, training plants and others; default 6")
      ->check(CLI::Range(1, 100));
  s.jobs = 0;
  add_jobs_option(*command, s.jobs);
  add_output_options(*command, options->output);
  command->callback([options, &exit_code] { exit_code = residual(*options); });
}

struct SweepCommand {
  std::string name, file;
  CampaignOptions run;
  OutputOptions output;
  SlurmOptions slurm;
};

/// Has a cluster do a study's runs; its tables are the finishing job's, which finds them done.
int sweep_on_slurm(SweepCommand command) {
  const Study study = read_study(command.file);
  std::string& out = command.run.out;
  if (out.empty()) out = new_results_folder(study.campaign.name);
  SlurmSettings& settings = command.slurm.settings;
  settings.cores = std::max(command.run.jobs, 1);
  const std::string folder = std::filesystem::absolute(out).string();
  settings.finish = {"study", command.name};
  if (command.name == "sweep") settings.finish.push_back(std::filesystem::absolute(command.file).string());
  const auto add = [&](const std::string& option, const std::string& value) {
    if (value.empty()) return;
    settings.finish.push_back(option);
    settings.finish.push_back(value);
  };
  const auto absolute = [](const std::string& file) {
    return file.empty() ? file : std::filesystem::absolute(file).string();
  };
  add("--out", folder);
  add("--jobs", std::to_string(settings.cores));
  add("--format", command.output.format);
  add("--svg", absolute(command.output.svg));
  add("--png", absolute(command.output.png));
  add("--html", absolute(command.output.html));
  return submit_campaign(study.campaign, out, command.slurm);
}

/// A study that is data: its campaign is run into a folder, its tables are made of the records.
int sweep(const SweepCommand& command) {
  if (command.slurm.wanted) return sweep_on_slurm(command);
  const Study study = read_study(command.file);
  const CampaignResult result = run_campaign(study.campaign, command.run);
  command.output.write(result_of(study, study_rows(study, result.records())), !result.interrupted);
  fmt::print(stderr, "Results: {}\n", result.folder);
  if (result.interrupted) {
    fmt::print(stderr, "solenoid: interrupted with {} of {} runs finished; the same command with --out {} resumes\n",
               result.ended, study.campaign.runs.size(), result.folder);
    return interrupted;
  }
  return result.failed > 0 ? failure : success;
}

void add_sweep(CLI::App& study, int& exit_code, const std::string& name, const std::string& help) {
  auto options = std::make_shared<SweepCommand>();
  options->name = name;
  options->file = "studies/" + name + ".toml";  // the shipped one; no folder of results has its name
  CLI::App* command = study.add_subcommand(name, help);
  if (name == "sweep")
    command->add_option("file", options->file, "a study (docs/how-to/studies.md)")
        ->type_name(value_kind::toml)
        ->required();
  add_out_option(*command, options->run.out);
  add_jobs_option(*command, options->run.jobs);
  add_output_options(*command, options->output);
  add_figure_options(*command, options->output);
  add_slurm_options(*command, options->slurm, true);
  command->callback([options, command, &exit_code] {
    options->slurm.require_slurm(*command);
    exit_code = sweep(*options);
  });
}

struct ForceRatioCommand {
  RatioSettings settings;
  OutputOptions output;
};

int force_ratio(ForceRatioCommand command) {
  RatioSettings& settings = command.settings;
  if (settings.out.empty()) settings.out = "results/force-ratio-" + compact_timestamp();
  const InterruptGuard guard;
  const RatioStudy study =
      study_force_ratio(settings, [](const std::string& what) { fmt::print(stderr, "force-ratio: {}\n", what); });
  command.output.write(result_of(study), !study.interrupted);
  if (!study.interrupted) return success;
  fmt::print(stderr, "solenoid: interrupted after {} ratios; the same command with --out {} resumes\n",
             study.ratios.size(), study.folder);
  return interrupted;
}

void add_force_ratio(CLI::App& study, int& exit_code) {
  auto options = std::make_shared<ForceRatioCommand>();
  RatioSettings& s = options->settings;
  CLI::App* command = study.add_subcommand(
      "force-ratio", "cylinder only to motor only at equal capability: error, energy, mass, price");
  command
      ->add_option("--shares", s.shares,
                   "the motor's share of the capability; default 0,0.025,0.05,0.104,0.2,0.4,0.7,1")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 1.0));
  command->add_option("--evaluations", s.evaluations, "of each ratio's tuning, for each of its laws; default 12")
      ->check(CLI::Range(1, 10000));
  command->add_option("--plants", s.plants, "hidden mismatches a motion to tune on, as many held out; default 2")
      ->check(CLI::Range(1, 999));
  command->add_option("--judged", s.judged, "others, a motion, that the figures come from; default 10")
      ->check(CLI::Range(1, 999));
  command->add_option("--assumptions", s.assumptions, "a TOML file of what differs from tasks/force_ratio.toml")
      ->type_name(value_kind::toml);
  command->add_flag("--quick", s.quick, "motions of a second: tries the command, gives no figure");
  add_jobs_option(*command, s.jobs);
  add_out_option(*command, s.out, "folder");
  add_output_options(*command, options->output);
  add_figure_options(*command, options->output, "the fronts");
  command->callback([options, &exit_code] { exit_code = force_ratio(*options); });
}

}  // namespace

void add_study(CLI::App& app, int& exit_code) {
  CLI::App* study = app.add_subcommand("study", "studies: one command and one page of docs/ each");
  study->require_subcommand(1);
  add_fishing(*study, exit_code);
  add_sweep(*study, exit_code, "sweep", "a study of your own: one number of some variants varied");
  add_sweep(*study, exit_code, "horizon",
            "Table 5-2's trade of overshoot against steady-state error, its knee, and better");
  add_sweep(*study, exit_code, "valves", "three, four, seven and nine valve states: error, switches, air, holding");
  add_sweep(*study, exit_code, "forgetting", "the integral's forgetting factor: error and oscillation");
  add_sweep(*study, exit_code, "inverter_horizon",
            "the inverter's distortion against its switching frequency, by horizon");
  add_force_ratio(*study, exit_code);
  add_identification(*study, exit_code);
  add_valve_health(*study, exit_code);
  add_residual(*study, exit_code);
}

}  // namespace solenoid
