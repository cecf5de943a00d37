#pragma once

#include "experiments/base/plot.hpp"

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace solenoid {

struct Result;

/// Where a command's result goes and in which format.
struct OutputOptions {
  std::string format = "table", svg, png, html;

  /// To standard output in the format; `finished`: and into the files named. Throws OutputError, ConfigError without
  /// gnuplot.
  void write(const Result& result, bool finished = true) const;
  /// Into the files alone.
  void write_files(const Result& result) const;
};

/// --format of `formats`, whose first is the default, and --html.
void add_output_options(CLI::App& command, OutputOptions& options,
                        const std::vector<std::string>& formats = {"table", "json", "csv"});

/// --svg and --png: `drawn` is what they draw.
void add_figure_options(CLI::App& command, OutputOptions& options, const std::string& drawn = "the plot");

/// --jobs: worker processes, one a core unless it is given.
void add_jobs_option(CLI::App& command, int& jobs);

/// --against: the variant that the others are compared with.
void add_against_option(CLI::App& command, std::string& baseline, const std::string& more = "");

/// --out: a folder that an interrupted command resumes.
void add_out_option(CLI::App& command, std::string& out, const std::string& kept = "results folder");

}  // namespace solenoid
