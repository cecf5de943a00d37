#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/read_log.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/rig/log/tick_fields.hpp"
#include "experiments/rig/replay_run.hpp"

#include <algorithm>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

struct ReplayArguments {
  std::string log, variant, csv, format = "table";
};

std::string text_of(const ReplayResult& r, const SystemDescription& system, const std::string& variant, bool same) {
  std::string text = fmt::format("{} ticks through {}\n", r.ticks, variant);
  text += fmt::format("commands    {} with other {}", r.switch_differences, system.switches_key);
  for (std::size_t i = 0; i < system.continuous.size(); ++i)
    text += fmt::format(", {} with another {} ({:.3g} {} RMS apart)", r.continuous_differences[i],
                        system.continuous[i].label, r.continuous_difference_rms[i], system.continuous[i].unit);
  if (r.first_difference_s >= 0) text += fmt::format("; the first at {:.3f} s", r.first_difference_s);
  text += "\n";
  if (same && r.unproven > 0)
    text += fmt::format("            {} solves of the log were cut by their deadline\n", r.unproven);
  const auto line = [](const char* name, const Percentiles& p) {
    return fmt::format("{:<12}p50 {:.1f}  p99 {:.1f}  p99.9 {:.1f}  max {:.1f} us\n", name, p.p50, p.p99, p.p999,
                       p.max);
  };
  return text + line("solve", r.solve_us) + line("tick", r.step_us);
}

std::string json_of(const ReplayResult& r, const SystemDescription& system, const std::string& variant) {
  const auto times = [](const Percentiles& p) {
    return nlohmann::ordered_json{{"p50", p.p50}, {"p90", p.p90}, {"p99", p.p99}, {"p999", p.p999}, {"max", p.max}};
  };
  nlohmann::ordered_json json = {{"system", system.name},
                                 {"variant", variant},
                                 {"ticks", r.ticks},
                                 {system.switch_noun + "_differences", r.switch_differences}};
  for (std::size_t i = 0; i < system.continuous.size(); ++i) {
    const std::string unit = unit_in_keys(system.continuous[i].unit);
    json[system.continuous[i].name + "_differences"] = r.continuous_differences[i];
    json[fmt::format("{}_difference_rms_{}", system.continuous[i].name, unit)] = r.continuous_difference_rms[i];
  }
  json["unproven"] = r.unproven;
  json["solve_us"] = times(r.solve_us);
  json["tick_us"] = times(r.step_us);
  return json.dump(1) + "\n";
}

int replay(const ReplayArguments& options) {
  const InterruptGuard guard;
  const RecordedRun run = read_log(options.log);
  const RecordedTask task = recorded_task(run);
  const bool same = options.variant.empty();
  const ReplayResult result =
      same ? replay_same(run, task, InterruptGuard::raised)
           : replay_other(run, task, shipped_variant(options.variant), {}, InterruptGuard::raised);
  if (result.interrupted) return interrupted;
  const std::string name = same ? task.variant.name : options.variant;
  if (!options.csv.empty()) write_file_atomically(options.csv, TickFormat(*run.system).csv_text(result.decided));
  write_standard_output(options.format == "json" ? json_of(result, *run.system, name)
                                                 : text_of(result, *run.system, name, same));
  return same && result.first_difference_s >= 0 && result.unproven == 0 ? failure : success;
}

}  // namespace

void add_replay(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ReplayArguments>();
  CLI::App* command = app.add_subcommand("replay", "a run's recorded measurements through a controller again");
  command->add_option("log", options->log, "an .mcap file of `run`")->type_name(value_kind::log)->required();
  command->add_option("--variant", options->variant, "another variant; default: the log's own, which must agree")
      ->type_name(value_kind::variant);
  command->add_option("--csv", options->csv, "write the ticks with the replay's decisions to this file")
      ->type_name(value_kind::csv);
  command->add_option("--format", options->format, "table or json, on standard output; default table")
      ->check(CLI::IsMember({"table", "json"}));
  command->callback([options, &exit_code] { exit_code = replay(*options); });
}

}  // namespace solenoid
