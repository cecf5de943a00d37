#include "experiments/campaign/campaign.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/report/run_figure.hpp"

#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

struct PlotOptions {
  std::string campaign = "default", variant, scenario, svg, png;
  std::uint64_t seed = 1;
};

void run_plot(const PlotOptions& options) {
  const Campaign campaign = read_campaign(options.campaign, {{options.variant}, {options.scenario}});
  const bool svg = !options.svg.empty();
  const std::string& path = svg ? options.svg : options.png;
  draw_figure(campaign.variants.front(), campaign.scenarios.front(), options.seed, path,
              svg ? FigureFormat::svg : FigureFormat::png);
  fmt::print("{}\n", path);
}

}  // namespace

void add_plot(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("plot", "one run as five plots: position, error, valves, forces");
  const auto options = std::make_shared<PlotOptions>();
  command->add_option("campaign", options->campaign, "campaign file, or a shipped campaign's name; default: default")
      ->type_name(value_kind::campaign);
  command->add_option("--variant", options->variant, "a variant of the campaign or a shipped one")
      ->type_name(value_kind::variant)
      ->required();
  command->add_option("--scenario", options->scenario, "a scenario of the campaign")
      ->type_name(value_kind::scenario)
      ->required();
  command->add_option("--seed", options->seed, "seed of the sensor noise; default 1");
  CLI::Option_group* output = command->add_option_group("output");
  output->add_option("--svg", options->svg, "write this SVG file")->type_name(value_kind::svg);
  output->add_option("--png", options->png, "write this PNG file")->type_name(value_kind::png);
  output->require_option(1);
  command->callback([options, &exit_code] {
    run_plot(*options);
    exit_code = success;
  });
}

}  // namespace solenoid
