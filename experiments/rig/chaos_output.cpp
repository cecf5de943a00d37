#include "experiments/base/result.hpp"
#include "experiments/rig/chaos.hpp"

#include <fmt/format.h>

namespace solenoid {

Result result_of(const ChaosOutcome& outcome) {
  using Column = Table::Column;
  Table strikes{.name = "strikes", .columns = {Column("what", "what was done", "<"), Column("times", "times")}};
  for (const auto& [what, times] : outcome.strikes) strikes.add({what, times});
  Table exits{
      .name = "exits",
      .columns = {Column("command", "command", "<"), Column("exit_code", "exit code"), Column("times", "times")}};
  for (const auto& [command, codes] : outcome.exits)
    for (const auto& [code, times] : codes) exits.add({command, code, times});
  Result result{.facts = {{"campaigns", outcome.campaigns},
                          {"results", outcome.results},
                          {"traces", outcome.traces},
                          {"damaged", outcome.redone},
                          {"runs", outcome.runs},
                          {"logs", outcome.logs},
                          {"ticks", outcome.ticks},
                          {"node_reports", outcome.reports},
                          {"worst_safe_ms", outcome.worst_safe_ms},
                          {"left_out", outcome.left_out},
                          {"findings", outcome.findings}},
                .tables = {strikes, exits}};
  result.notes.push_back(
      fmt::format("{} campaigns whole after all, {} results and {} traces equal to the undisturbed ones but for those "
                  "below; {} runs in real "
                  "time, {} logs of {} ticks read, {} reports of nodes, outputs safe at the latest {:.1f} ms after the "
                  "last command",
                  outcome.campaigns, outcome.results, outcome.traces, outcome.runs, outcome.logs, outcome.ticks,
                  outcome.reports, outcome.worst_safe_ms));
  for (const std::string& what : outcome.left_out) result.notes.push_back("left out: " + what);
  for (const std::string& what : outcome.findings) result.notes.push_back("FOUND " + what);
  if (outcome.findings.empty()) result.notes.emplace_back("nothing found");
  return result;
}

}  // namespace solenoid
