#include "experiments/campaign/run_campaign.hpp"

#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/base/processes.hpp"
#include "experiments/base/progress.hpp"
#include "experiments/campaign/results_folder.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/campaign/trace.hpp"
#include "experiments/plugin/python_rows.hpp"

#include <cstdio>
#include <filesystem>
#include <numeric>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using Records = std::vector<std::optional<RunRecord>>;

/// What a worker does; its text is a line with the run's record, then its trace if that is kept.
std::string simulate_run(const Campaign& campaign, const CampaignRun& run, bool traced) {
  const VariantConfig& variant = campaign.variants[run.variant];
  const ScenarioConfig& scenario = campaign.scenarios[run.scenario];
  const RunResult result = simulate(variant, scenario, run.seed);
  return to_json(record_of(campaign, run, result.metrics)).dump() + "\n" +
         (traced ? encode_trace(make_trace(variant, scenario, result.ticks)) : std::string());
}

RunRecord record_of(const Campaign& campaign, const CampaignRun& run, const Outcome& outcome) {
  if (!outcome.done) return failed_record(campaign, run, outcome.text);
  return record_from_json(nlohmann::ordered_json::parse(outcome.text.substr(0, outcome.text.find('\n'))), run.id);
}

std::string_view trace_of(const Outcome& outcome) {
  return outcome.done ? std::string_view(outcome.text).substr(outcome.text.find('\n') + 1) : std::string_view();
}

/// One line for results that are there and cannot be believed.
void tell_distrusted(const std::vector<std::string>& problems) {
  if (problems.empty()) return;
  const std::string others = problems.size() > 1 ? fmt::format(" and {} more", problems.size() - 1) : "";
  std::fprintf(stderr, "solenoid: done again: %s%s\n", problems.front().c_str(), others.c_str());
}

/// Does the runs that have no record yet; false if interrupted.
bool fill(const Campaign& campaign, const CampaignOptions& options, int jobs, ResultsFolder& folder, Records& records) {
  std::vector<std::size_t> todo;
  for (std::size_t i = 0; i < records.size(); ++i)
    if (!records[i]) todo.push_back(i);
  std::optional<Progress> progress;
  if (options.progress) progress.emplace(records.size(), records.size() - todo.size());
  folder.log(fmt::format("{} runs were there already", records.size() - todo.size()));
  PoolEvents events;
  events.started = [&](std::size_t i) {
    if (progress) progress->started(campaign.runs[i].id);
  };
  events.ended = [&](std::size_t i, const Outcome& outcome) {
    records[i] = record_of(campaign, campaign.runs[i], outcome);
    folder.add(campaign.runs[i], *records[i], trace_of(outcome));
    if (progress) progress->ended(campaign.runs[i].id, first_line(records[i]->status));
  };
  events.waiting = [&] {
    if (progress) progress->tick();
  };
  events.most_silence_s = options.tick_limit_s;
  events.interrupted = [] { return InterruptGuard::raised(); };
  return work_in_processes(
      todo, jobs, [&](std::size_t i) { return simulate_run(campaign, campaign.runs[i], true); }, events);
}

}  // namespace

std::string new_results_folder(const std::string& name) {
  const std::string base = fmt::format("results/{}-{}", name, compact_timestamp());
  std::string path = base;
  std::error_code ignored;
  // A number when two campaigns start within a second.
  for (int i = 2; std::filesystem::exists(path, ignored); ++i) path = fmt::format("{}-{}", base, i);
  return path;
}

std::optional<std::vector<RunRecord>> run_in_processes(const Campaign& campaign, int jobs, double tick_limit_s) {
  const InterruptGuard guard;
  std::vector<std::size_t> all(campaign.runs.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::vector<RunRecord> records(all.size());
  PoolEvents events;
  events.started = [](std::size_t) {};
  events.ended = [&](std::size_t i, const Outcome& outcome) {
    records[i] = record_of(campaign, campaign.runs[i], outcome);
  };
  events.waiting = [] {};
  events.most_silence_s = tick_limit_s;
  events.interrupted = [] { return InterruptGuard::raised(); };
  const bool done = work_in_processes(
      all, jobs > 0 ? jobs : this_machine().cores,
      [&](std::size_t i) { return simulate_run(campaign, campaign.runs[i], false); }, events);
  if (!done) return std::nullopt;
  return records;
}

CampaignResult run_campaign(const Campaign& campaign, const CampaignOptions& options) {
  const int jobs = options.jobs > 0 ? options.jobs : this_machine().cores;
  const InterruptGuard guard;
  ResultsFolder folder(options.out.empty() ? new_results_folder(campaign.name) : options.out, campaign, jobs);
  CampaignResult result;
  result.folder = folder.path();
  try {
    Records records;
    for (const CampaignRun& run : campaign.runs)  // what is in Python may have changed
      records.push_back(written_in_python(campaign.variants[run.variant]) ? std::nullopt : folder.finished_before(run));
    tell_distrusted(folder.distrusted());
    result.interrupted = !fill(campaign, options, jobs, folder, records);
    for (std::optional<RunRecord>& record : records)
      if (record) result.records.push_back(std::move(*record));
    folder.close(result.interrupted ? "interrupted" : "finished", result.records);
  } catch (const std::exception& error) {
    folder.abandon(error.what());
    throw;
  }
  return result;
}

}  // namespace solenoid
