#include "controllers/factory.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "core/systems/actuator/valves.hpp"
#include "experiments/base/result.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/check/checks.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/rig/calibration.hpp"
#include "experiments/rig/plants.hpp"
#include "experiments/rig/preflight.hpp"

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

struct CheckArguments {
  std::vector<std::string> files;
  std::string rig_file;
  OutputOptions output;
  PlantChoice plant;
};

/// The rig as it stands, outputs safe: what `run` looks at before it moves anything.
std::vector<Check> check_plant(const CheckArguments& options) {
  PlantChoice choice = options.plant;
  const Campaign campaign = read_campaign("rig");
  const VariantConfig variant = told(campaign.variants.front(), campaign.scenarios.front());
  choice.rig = options.rig_file.empty() ? usual_rig(variant) : read_rig_file(options.rig_file, variant);
  const OpenedPlant opened = open_plant(choice, variant, campaign.scenarios.front(), 1);
  const Preflight found =
      preflight(*opened.plant, {}, actuator_description(), choice.rig.ladder.plausibility, variant.timing.tick_s);
  const ChannelLimits& limits = choice.rig.ladder.limits[position_channel];
  const bool inside = found.at[0] >= limits.low && found.at[0] <= limits.high;
  const bool late = found.read_us.p99 > 1e6 * variant.timing.tick_s;
  return {{"plant", "I/O latency", late ? "failed" : "ok",
           fmt::format("read p50 {:.0f} us, p99 {:.0f} us, max {:.0f} us of the tick's 1000; {} of 100 missed",
                       found.read_us.p50, found.read_us.p99, found.read_us.max, found.missed)},
          {"plant", "sensors", found.good() ? "ok" : "failed",
           found.good() ? "plausible for 0.1 s" : to_string(found.faults, actuator_description())},
          {"plant", "position", inside ? "ok" : "failed",
           fmt::format("{:.2f} mm, calibrated; limits {:.1f} to {:.1f} mm", 1e3 * found.at[0], 1e3 * limits.low,
                       1e3 * limits.high)}};
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
  command->add_option("--node", options->plant.address, "ADDRESS:PORT of the UDP I/O node; default 127.0.0.1:47811");
  command->add_option("--rig", options->rig_file, "TOML of calibration, wiring and limits (docs/reference/rig.md)")
      ->type_name(value_kind::toml);
  command->callback([options, &exit_code] { exit_code = check(*options); });
}

}  // namespace solenoid
