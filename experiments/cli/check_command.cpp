#include "controllers/factory.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/result.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/check/checks.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/rig/calibration.hpp"
#include "experiments/rig/plants.hpp"
#include "experiments/rig/preflight.hpp"
#include "experiments/rig/wire_check.hpp"

#include <algorithm>
#include <cstdio>
#include <iterator>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

/// What each variant's valves are in whole steps, where that is not what was asked. Throws ConfigError for a variant of
/// which no controller can be made: what reading cannot see, its solver says when it is prepared.
std::string check_variants(const std::string& path, const Campaign& campaign) {
  std::string notes;
  for (const VariantConfig& v : campaign.variants) {
    for (const std::string& note : rounded_times(system_of(v).modes(v), v.timing.tick_s))
      notes += fmt::format("; variant '{}': {}", v.name, note);
    try {
      make_controller(told(v, campaign.scenarios.front()), campaign.scenarios.front().trajectory);
    } catch (const std::invalid_argument& error) {
      throw ConfigError(fmt::format("{}: variant '{}': {}", path, v.name, error.what()));
    }
  }
  return notes;
}

Check check_campaign(const std::string& path) {
  const Campaign campaign = read_campaign(path);
  return {
      "campaign", path, "ok",
      fmt::format("{} variants, {} scenarios, {} seeds: {} runs{}", campaign.variants.size(), campaign.scenarios.size(),
                  campaign.seeds.size(), campaign.runs.size(), check_variants(path, campaign))};
}

Result result_of(const std::vector<Check>& checks) {
  Table table{
      .name = "checks",
      .columns = {
          {"group", "group", "<"}, {"name", "name", "<"}, {"result", "result", "<"}, {"detail", "detail", "<"}}};
  for (const Check& c : checks) table.add({c.group, c.name, c.result, c.detail});
  return {.tables = {table}};
}

constexpr double wire_watch_s = 3.0;

struct CheckArguments {
  std::vector<std::string> files;
  std::string rig_file, variant = "nine_state";
  OutputOptions output;
  PlantChoice plant;
};

/// The rig as it stands, outputs safe: what `run` looks at before it moves anything.
std::vector<Check> check_plant(const CheckArguments& options) {
  PlantChoice choice = options.plant;
  const Campaign task = read_real_time_task("", options.variant, "");
  const VariantConfig variant = told(task.variants.front(), task.scenarios.front());
  const SystemDescription& system = task.system->description();
  choice.rig = options.rig_file.empty() ? usual_rig(variant) : read_rig_file(options.rig_file, variant);
  expect_noise(choice, task.scenarios.front());
  const OpenedPlant opened = open_plant(choice, variant, task.scenarios.front(), 1);
  const LadderSettings& ladder = choice.rig.ladder;
  const Preflight found = preflight(*opened.plant, system, ladder.plausibility, variant.timing.tick_s);
  const double tick_us = 1e6 * variant.timing.tick_s;
  std::vector<Check> checks = {
      {"plant", "I/O latency", found.read_us.p99 > tick_us ? "failed" : "ok",
       fmt::format("read p50 {:.0f} us, p99 {:.0f} us, max {:.0f} us of the tick's {:.0f}; {} of 100 missed",
                   found.read_us.p50, found.read_us.p99, found.read_us.max, tick_us, found.missed)},
      {"plant", "sensors", found.good() ? "ok" : "failed",
       found.good() ? "plausible" : to_string(found.faults, system)}};
  for (std::size_t a = 0; a < system.axes.size() && !ladder.limits.empty(); ++a) {
    const Axis& axis = system.axes[a];
    const ChannelLimits& limits = ladder.limits[axis.channel];
    checks.push_back(
        {"plant", axis.signal.name, found.at[a] >= limits.low && found.at[a] <= limits.high ? "ok" : "failed",
         fmt::format("{:.2f} {}, calibrated; limits {:.1f} to {:.1f} {}", axis.shown_scale * found.at[a],
                     axis.shown_unit, axis.shown_scale * limits.low, axis.shown_scale * limits.high, axis.shown_unit)});
  }
  if (opened.rig)
    if (const auto wire = watch_wire(*opened.rig, wire_watch_s, variant.timing.tick_s))
      for (const WireFinding& f : wire_checks(*wire, variant.timing.tick_s))
        checks.push_back({"wire", f.name, f.good ? "ok" : "failed", f.detail});
  return checks;
}

/// Files first: one that is refused ends the command, after every other has been looked at.
int check(const CheckArguments& options) {
  std::vector<Check> checks;
  bool refused = false;
  for (const std::string& file : options.files) {
    try {
      checks.push_back(check_campaign(file));
    } catch (const ConfigError& error) {
      std::fprintf(stderr, "solenoid: %s\n", error.what());
      refused = true;
    }
  }
  if (refused) return bad_input;
  for (auto* look : {check_installation, check_machine, check_model})
    for (Check& c : look()) checks.push_back(std::move(c));
  if (!options.plant.kind.empty()) std::ranges::move(check_plant(options), std::back_inserter(checks));
  options.output.write(result_of(checks));
  return std::any_of(checks.begin(), checks.end(), [](const Check& c) { return c.result == "failed"; }) ? failure
                                                                                                        : success;
}

}  // namespace

void add_check(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CheckArguments>();
  options->plant.kind.clear();
  CLI::App* command = app.add_subcommand("check", "campaign files, the installation, the machine, the model, a plant");
  command->add_option("campaigns", options->files, "campaign files to validate")->type_name(value_kind::campaign);
  add_output_options(*command, options->output, {"table", "json"});
  command->add_option("--plant", options->plant.kind, "look at this plant too, outputs safe: sim, emulator or comedi")
      ->check(CLI::IsMember({"sim", "emulator", "comedi"}));
  command->add_option("--variant", options->variant, "a shipped variant: whose plant it is; default nine_state")
      ->type_name(value_kind::variant);
  command->add_option("--node", options->plant.address,
                      "ADDRESS:PORT of the UDP I/O node; default the rig file's, or 127.0.0.1:47811");
  command->add_option("--key", options->plant.key_file, "file of the key that the node has too (docs/reference/rig.md)")
      ->type_name(value_kind::file);
  command->add_option("--rig", options->rig_file, "TOML of calibration, wiring and limits (docs/reference/rig.md)")
      ->type_name(value_kind::toml);
  command->callback([options, &exit_code] { exit_code = check(*options); });
}

}  // namespace solenoid
