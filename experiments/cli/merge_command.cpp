#include "experiments/base/result.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/report/comparison.hpp"
#include "experiments/report/merge.hpp"

#include <cstdio>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

struct MergeArguments {
  std::string folder;
  std::string baseline;
  bool no_report = false;
  OutputOptions output;
};

int run_merge(const MergeArguments& options) {
  const Merged merged = merge(options.folder, !options.no_report, options.baseline);
  for (const std::string& problem : merged.problems) fmt::print(stderr, "solenoid: {}\n", problem);
  Result result = result_of(*merged.results.table(), options.baseline);
  const std::size_t all = merged.ok + merged.unstable + merged.failed + merged.missing;
  Json facts = {{"folder", options.folder}, {"runs", all},
                {"ok", merged.ok},          {"unstable", merged.unstable},
                {"failed", merged.failed},  {"missing", merged.missing}};
  facts.update(result.facts);
  result.facts = std::move(facts);
  if (std::string note = real_time_note(merged.results.campaign.variants); !note.empty()) result.notes.push_back(note);
  result.notes.push_back(fmt::format("{} of {} runs: {} ok, {} unstable, {} failed, {} missing.", all - merged.missing,
                                     all, merged.ok, merged.unstable, merged.failed, merged.missing));
  result.notes.push_back(merged.report.empty() ? "Results: " + options.folder : "Report: " + merged.report);
  options.output.write(result);
  if (!merged.no_report.empty()) fmt::print(stderr, "solenoid: no report: {}\n", merged.no_report);
  if (merged.missing > 0)
    fmt::print(stderr, "solenoid: {} runs are missing; do their shards again and merge again (solenoid status {})\n",
               merged.missing, options.folder);
  return merged.whole() ? success : failure;
}

}  // namespace

void add_merge(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<MergeArguments>();
  CLI::App* command = app.add_subcommand("merge", "make one result of a campaign's shards: ranking, runs.csv, report");
  command->add_option("folder", options->folder, "the folder that the shards were done into")
      ->type_name(value_kind::folder)
      ->required();
  command->add_flag("--no-report", options->no_report, "without report.html");
  add_against_option(*command, options->baseline);
  add_output_options(*command, options->output, {"table", "json"});
  command->callback([options, &exit_code] { exit_code = run_merge(*options); });
}

}  // namespace solenoid
