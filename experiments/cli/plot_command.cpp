#include "core/config/reader.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/embedded.hpp"
#include "experiments/report/figure.hpp"
#include "experiments/shipped.hpp"

#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

struct PlotOptions {
  std::string campaign, variant, scenario, svg, png;
  std::uint64_t seed = 1;
};

TableReader open_campaign(const std::string& path) {
  if (!path.empty()) return TableReader::from_file(path);
  return TableReader::from_text(std::string(embedded_text("scenarios/default.toml")), "shipped default.toml");
}

/// The campaign's own variant of that name, or the shipped one.
VariantConfig find_variant(TableReader& campaign, const std::string& name) {
  if (campaign.has("variant")) {
    TableReader variants = campaign.table("variant");
    if (variants.has(name)) {
      TableReader table = variants.table(name);
      return read_variant(table, name);
    }
  }
  return shipped_variant(name);
}

ScenarioConfig find_scenario(TableReader& campaign, const std::string& name) {
  std::vector<std::string> names;
  for (TableReader& table : campaign.tables("scenario")) {
    names.push_back(table.text("name"));
    if (names.back() == name) return read_scenario(table);
  }
  throw ConfigError(
      fmt::format("{}: scenario '{}' is not known (allowed: {})", campaign.file(), name, fmt::join(names, ", ")));
}

void run_plot(const PlotOptions& options) {
  TableReader campaign = open_campaign(options.campaign);
  const VariantConfig variant = find_variant(campaign, options.variant);
  const ScenarioConfig scenario = find_scenario(campaign, options.scenario);
  const bool svg = !options.svg.empty();
  const std::string& path = svg ? options.svg : options.png;
  draw_figure(variant, scenario, options.seed, path, svg ? FigureFormat::svg : FigureFormat::png);
  fmt::print("{}\n", path);
}

}  // namespace

void add_plot(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("plot", "one run as five plots: position, error, valves, forces");
  const auto options = std::make_shared<PlotOptions>();
  command->add_option("campaign", options->campaign, "campaign file (default: the shipped one)");
  command->add_option("--variant", options->variant, "a variant of the campaign or a shipped one")->required();
  command->add_option("--scenario", options->scenario, "a scenario of the campaign")->required();
  command->add_option("--seed", options->seed, "seed of the sensor noise");
  CLI::Option_group* output = command->add_option_group("output");
  output->add_option("--svg", options->svg, "write this SVG file");
  output->add_option("--png", options->png, "write this PNG file");
  output->require_option(1);
  command->callback([options, &exit_code] {
    run_plot(*options);
    exit_code = success;
  });
}

}  // namespace solenoid
