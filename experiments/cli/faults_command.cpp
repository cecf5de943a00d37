#include "experiments/base/files.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/rig/fault_table.hpp"

#include <algorithm>
#include <filesystem>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

struct Options {
  std::string format = "table", variant = "nine_state";
  bool simulated_only = false;
};

std::string json_of(const std::vector<FaultOutcome>& simulated, const std::vector<ProcessOutcome>& processes) {
  using Json = nlohmann::ordered_json;
  Json json = {{"simulated", Json::array()}, {"processes", Json::array()}};
  const auto outputs = [](const Command& c) { return Json{{"coils", c.coils}, {"motor_n", c.motor_force_n}}; };
  for (const FaultOutcome& f : simulated)
    json["simulated"].push_back({{"fault", f.fault},
                                 {"moving", f.moving},
                                 {"noticed_ms", f.detected_ms},
                                 {"acted_ms", f.acted_ms},
                                 {"worst_rung", to_string(f.worst)},
                                 {"last_rung", to_string(f.last)},
                                 {"final_outputs", outputs(f.final_command)},
                                 {"largest_error_mm", f.largest_error_mm},
                                 {"in_range", f.in_range},
                                 {"safe_causes", to_string(f.causes)},
                                 {"note", f.note}});
  for (const ProcessOutcome& p : processes)
    json["processes"].push_back({{"fault", p.name},
                                 {"exit_code", p.exit_code},
                                 {"node_safe_after_ms", p.safe_after_ms},
                                 {"longest_silence_ms", p.longest_silence_ms},
                                 {"final_outputs", outputs(p.final_outputs)},
                                 {"refused", p.refused},
                                 {"log_ticks", p.log_ticks},
                                 {"log_closed", p.log_closed},
                                 {"safe_causes", p.causes}});
  return json.dump(1) + "\n";
}

std::vector<ProcessOutcome> in_a_folder(const std::string& variant) {
  const TemporaryFolder folder;
  return process_faults(std::filesystem::read_symlink("/proc/self/exe").string(), folder.path().string(), variant);
}

int faults(const Options& options) {
  const auto simulated = simulated_faults(options.variant);
  const auto processes = options.simulated_only ? std::vector<ProcessOutcome>{} : in_a_folder(options.variant);
  write_standard_output(options.format == "json" ? json_of(simulated, processes)
                                                 : fault_table_text(simulated, processes));
  const bool good = std::all_of(simulated.begin(), simulated.end(), [](const auto& f) { return f.in_range; }) &&
                    std::all_of(processes.begin(), processes.end(), [](const auto& p) { return p.refused == 0; });
  return good ? success : failure;
}

}  // namespace

void add_faults(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("faults", "provokes every fault of sensors, solver, processes; what they lead to");
  command->add_option("--variant", options->variant, "a shipped variant that is real time; default nine_state");
  command->add_option("--format", options->format, "table or json, on standard output")
      ->check(CLI::IsMember({"table", "json"}));
  command->add_flag("--simulated-only", options->simulated_only, "leave out the faults of processes (about a minute)");
  command->footer("Exit code 1 if any command out of range left the controller.");
  command->callback([options, &exit_code] { exit_code = faults(*options); });
}

}  // namespace solenoid
