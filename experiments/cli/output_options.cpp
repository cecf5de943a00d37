#include "experiments/cli/output_options.hpp"

#include "experiments/base/files.hpp"
#include "experiments/base/result.hpp"
#include "experiments/cli/value_kinds.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

/// The plot as the text of an SVG file; nothing without one.
std::string drawn(const Result& result) {
  if (!result.plot) return "";
  const TemporaryFolder folder;
  const std::string path = (folder.path() / "plot.svg").string();
  draw(*result.plot, path);
  return read_whole_file(path).value_or("");
}

}  // namespace

void OutputOptions::write(const Result& result, bool finished) const {
  write_standard_output(format == "json"       ? result.json()
                        : format == "csv"      ? result.csv()
                        : format == "markdown" ? result.markdown()
                                               : result.text(colour_wanted()));
  if (finished) write_files(result);
}

void OutputOptions::write_files(const Result& result) const {
  if (!svg.empty() && result.plot) draw(*result.plot, svg, FigureFormat::svg);
  if (!png.empty() && result.plot) draw(*result.plot, png, FigureFormat::png);
  if (!html.empty()) write_file_atomically(html, result.html(drawn(result)));
}

void add_output_options(CLI::App& command, OutputOptions& options, const std::vector<std::string>& formats) {
  options.format = formats.front();
  command
      .add_option("--format", options.format,
                  fmt::format("{}; on standard output; default {}", fmt::join(formats, ", "), formats.front()))
      ->check(CLI::IsMember(formats));
  command.add_option("--html", options.html, "write tables and plot as a page into this file too")
      ->type_name(value_kind::html);
}

void add_figure_options(CLI::App& command, OutputOptions& options, const std::string& drawn) {
  const auto ending = [](const std::string& end) {
    return [end](const std::string& path) {
      return path.ends_with(end) ? std::string() : "'" + path + "' (allowed: a file ending in " + end + ")";
    };
  };
  command.add_option("--svg", options.svg, "write " + drawn + " to this SVG file")
      ->type_name(value_kind::svg)
      ->check(ending(".svg"));
  command.add_option("--png", options.png, "write " + drawn + " to this PNG file")
      ->type_name(value_kind::png)
      ->check(ending(".png"));
}

void add_jobs_option(CLI::App& command, int& jobs) {
  command.add_option("--jobs", jobs, "worker processes; default: one a core")->check(CLI::Range(1, 1024));
}

void add_against_option(CLI::App& command, std::string& baseline, const std::string& more) {
  command
      .add_option("--against", baseline,
                  "the variant that the others are compared with, task by task; default: the best ranked" + more)
      ->type_name(value_kind::variant)
      ->check([](const std::string& text) { return text.empty() ? "empty (allowed: a variant)" : std::string(); });
}

void add_out_option(CLI::App& command, std::string& out, const std::string& kept) {
  command.add_option("--out", out, kept + "; one that is there already is resumed")
      ->type_name(value_kind::folder)
      ->check([](const std::string& text) { return text.empty() ? "empty (allowed: a folder)" : std::string(); });
}

}  // namespace solenoid
