#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/report/campaign_figures.hpp"
#include "experiments/report/page.hpp"
#include "experiments/report/results.hpp"

#include <algorithm>
#include <cstdio>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

struct ReportArguments {
  std::string folder, out, figure = "pareto", svg, png;
  bool overview_only = false;
};

/// Names the runs that the report lacks; the exit code.
int tell_left_out(const Results& results) {
  constexpr std::size_t most = 10;
  for (std::size_t i = 0; i < std::min(most, results.left_out.size()); ++i)
    std::fprintf(stderr, "solenoid: left out: %s\n", results.left_out[i].reason.c_str());
  if (results.left_out.size() > most) std::fprintf(stderr, "solenoid: and %zu more\n", results.left_out.size() - most);
  if (results.unchecked > 0)
    std::fprintf(stderr,
                 "solenoid: %d of the runs have no checksum, as a version before wrote them: taken as they are\n",
                 results.unchecked);
  return results.left_out.empty() ? success : failure;
}

int report(const ReportArguments& options) {
  Results results = read_results(options.folder);
  const std::string& drawing = options.svg.empty() ? options.png : options.svg;
  if (!drawing.empty()) {
    draw_report_figure(results, options.figure, drawing, options.svg.empty() ? FigureFormat::png : FigureFormat::svg);
    write_standard_output(drawing + "\n");
    if (options.out.empty()) return tell_left_out(results);
  }
  const std::string path = options.out.empty() ? options.folder + "/report.html" : options.out;
  write_file_atomically(path, report_of(results, !options.overview_only));
  write_standard_output(path + "\n");
  return tell_left_out(results);
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
      "what --svg or --png draws: pareto (default), profile, solve_time, or a run's ID, SCENARIO--VARIANT--sSEED");
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
