#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/report/campaign_figures.hpp"
#include "experiments/report/page.hpp"

#include <cstdio>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

struct ReportArguments {
  std::string folder, out, figure = "pareto", svg, png;
  bool overview_only = false;
};

int report(const ReportArguments& options) {
  const std::string& drawing = options.svg.empty() ? options.png : options.svg;
  if (!drawing.empty()) {
    draw_report_figure(read_results(options.folder), options.figure, drawing,
                       options.svg.empty() ? FigureFormat::png : FigureFormat::svg);
    write_standard_output(drawing + "\n");
    if (options.out.empty()) return success;
  }
  const std::string path = options.out.empty() ? options.folder + "/report.html" : options.out;
  write_file_atomically(path, report_of_folder(options.folder, !options.overview_only));
  write_standard_output(path + "\n");
  return success;
}

}  // namespace

void add_report(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ReportArguments>();
  CLI::App* command = app.add_subcommand("report", "results as one HTML file, or a figure of them");
  command->add_option("folder", options->folder, "results folder of `compare` or `run`")
      ->type_name(value_kind::folder)
      ->required();
  command->add_option("-o,--out", options->out, "the HTML file; default FOLDER/report.html")
      ->type_name(value_kind::html);
  command->add_flag("--overview-only", options->overview_only, "without every tick of every run: a smaller file");
  command->add_option(
      "--figure", options->figure,
      "what --svg or --png draws: pareto (default), solve_time, or a run's ID as in FOLDER/runs/ID.json");
  CLI::Option* svg = command->add_option("--svg", options->svg, "draw a figure into this SVG file, in place of a page")
                         ->type_name(value_kind::svg);
  command->add_option("--png", options->png, "the same as PNG")->type_name(value_kind::png)->excludes(svg);
  command->callback([options, command, &exit_code] {
    if (command->count("--figure") > 0 && options->svg.empty() && options->png.empty())
      throw ConfigError("--figure: nothing to draw it into (allowed: with --svg FILE or --png FILE)");
    exit_code = report(*options);
  });
}

}  // namespace solenoid
