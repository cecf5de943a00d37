#include "experiments/campaign/run_campaign.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/bytes.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/base/processes.hpp"
#include "experiments/base/progress.hpp"
#include "experiments/campaign/results_folder.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/campaign/worst_traces.hpp"
#include "experiments/plugin/python_rows.hpp"

#include <charconv>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <numeric>
#include <optional>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// A run as its worker sends it: the length of its record [4], encode_run(), its trace if there is one.
struct SentRun {
  std::string_view encoded, trace;

  static SentRun of(std::string_view text) {
    const auto length = little_endian<std::uint32_t>(text.data());
    return {text.substr(4, length), text.substr(4 + length)};
  }
};

/// What a worker does.
std::string simulate_run(const Campaign& campaign, std::size_t index, bool traced) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point begin = Clock::now();
  const CampaignRun run = campaign.runs[index];
  const VariantConfig& variant = campaign.variants[run.variant];
  const ScenarioConfig scenario = campaign.scenarios[run.scenario];
  const RunResult result = simulate(variant, scenario, run.seed);
  KeptRun kept{run.hash, record_of(campaign, run, result.metrics), 0.0, solves_of(result.ticks)};
  kept.wall_s = std::chrono::duration<double>(Clock::now() - begin).count();
  const std::string encoded = encode_run(kept);
  std::string sent;
  append_little_endian(sent, static_cast<std::uint32_t>(encoded.size()));
  sent += encoded;
  if (traced) sent += encode_trace(make_trace(variant, scenario, result.ticks));
  return sent;
}

/// The same of a run whose worker failed.
std::string failed_run(const Campaign& campaign, std::size_t index, const std::string& why) {
  const CampaignRun run = campaign.runs[index];
  return encode_run({run.hash, failed_record(campaign, run, why), 0.0, {}});
}

/// One line for results that are there and cannot be believed.
void tell_distrusted(const std::vector<std::string>& problems) {
  if (problems.empty()) return;
  const std::string others = problems.size() > 1 ? fmt::format(" and {} more", problems.size() - 1) : "";
  std::fprintf(stderr, "solenoid: done again: %s%s\n", problems.front().c_str(), others.c_str());
}

/// A campaign's or shard's runs on their way into its folder.
class RunFiller {
 public:
  RunFiller(const Campaign& campaign, const CampaignOptions& options, ResultsFolder& folder)
      : campaign_(campaign), options_(options), folder_(folder), worst_(campaign, options.traces.worst) {
    for (const std::size_t run : runs_of(campaign, options.shard)) {
      const bool may_have_changed = written_in_python(campaign.variants[campaign.runs.variant(run)]);
      if (may_have_changed || !folder.finished_before(run)) todo_.push_back(run);
      ++runs_;
    }
  }

  std::size_t runs() const { return runs_; }
  std::size_t ended() const { return runs_ - todo_.size() + done_; }
  std::size_t done() const { return done_; }
  std::size_t failed() const { return failed_; }

  /// Does those that have no record yet; false if interrupted.
  bool fill(int jobs) {
    // A shard's lines go into a file that a whole cluster shares.
    if (options_.progress) progress_.emplace(runs_, runs_ - todo_.size(), options_.shard.alone ? 1 : 10);
    folder_.log(fmt::format("{} runs were there already", runs_ - todo_.size()));
    const bool traced = options_.traces.which != TraceKeeping::Which::none;
    PoolEvents events;
    events.started = [&](std::size_t run) {
      if (progress_) progress_->started(campaign_.runs[run].id);
    };
    events.ended = [&](std::size_t run, const Outcome& outcome) { take(run, outcome); };
    events.waiting = [&] {
      if (progress_) progress_->tick();
    };
    events.most_silence_s = options_.tick_limit_s;
    events.interrupted = [] { return InterruptGuard::raised(); };
    const bool whole = work_in_processes(
        todo_, jobs, [&](std::size_t run) { return simulate_run(campaign_, run, traced); }, events);
    worst_.hand_on([&](std::string_view encoded, std::string_view trace) { folder_.add(encoded, trace); });
    return whole;
  }

 private:
  void take(std::size_t run, const Outcome& outcome) {
    const std::string failure = outcome.done ? "" : failed_run(campaign_, run, outcome.text);
    const SentRun sent = outcome.done ? SentRun::of(outcome.text) : SentRun{failure, {}};
    const bool all = options_.traces.which == TraceKeeping::Which::all;
    folder_.add(sent.encoded, all ? sent.trace : std::string_view());
    if (options_.traces.which == TraceKeeping::Which::worst) worst_.take(sent.encoded, sent.trace);
    ++done_;
    failed_ += !outcome.done;
    const RunHead head = decode_head(sent.encoded);
    if (progress_) progress_->ended(campaign_.runs[run].id, first_line(std::string(head.status)));
  }

  const Campaign& campaign_;
  const CampaignOptions& options_;
  ResultsFolder& folder_;
  WorstTraces worst_;
  std::vector<std::size_t> todo_;
  std::size_t runs_ = 0, done_ = 0, failed_ = 0;
  std::optional<Progress> progress_;
};

}  // namespace

TraceKeeping TraceKeeping::of(const std::string& text) {
  constexpr std::size_t most = 100'000;
  constexpr std::string_view worst = "worst:";
  if (text == "all") return {};
  if (text == "none") return {Which::none, 0};
  std::size_t count = 0;
  const char* end = text.data() + text.size();
  if (text.starts_with(worst) && std::from_chars(text.data() + worst.size(), end, count).ptr == end && count > 0 &&
      count <= most)
    return {Which::worst, count};
  throw ConfigError(
      fmt::format("--traces: '{}' is not known (allowed: all, none, worst:N with N from 1 to {})", text, most));
}

std::vector<RunRecord> CampaignResult::records() const {
  std::vector<RunRecord> records;
  if (kept) for_each_run(*kept, [&](std::size_t, const KeptRun& run) { records.push_back(run.record); });
  return records;
}

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
  const WritingSession session = session_of(campaign);
  std::vector<std::size_t> all(campaign.runs.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::vector<RunRecord> records(all.size());
  PoolEvents events;
  events.ended = [&](std::size_t i, const Outcome& outcome) {
    records[i] = outcome.done ? decode_run(SentRun::of(outcome.text).encoded, session).record
                              : failed_record(campaign, campaign.runs[i], outcome.text);
  };
  events.most_silence_s = tick_limit_s;
  events.interrupted = [] { return InterruptGuard::raised(); };
  const bool done = work_in_processes(
      all, jobs > 0 ? jobs : this_machine().cores, [&](std::size_t i) { return simulate_run(campaign, i, false); },
      events);
  if (!done) return std::nullopt;
  return records;
}

CampaignResult run_campaign(const Campaign& campaign, const CampaignOptions& options) {
  const int jobs = options.jobs > 0 ? options.jobs : this_machine().cores;
  const InterruptGuard guard;
  ResultsFolder folder(options.out.empty() ? new_results_folder(campaign.name) : options.out, campaign,
                       {jobs, options.shard, options.scratch});
  CampaignResult result;
  result.folder = folder.path();
  try {
    RunFiller runs(campaign, options, folder);
    if (runs.ended() < runs.runs()) tell_distrusted(folder.distrusted());
    const auto begin = std::chrono::steady_clock::now();
    result.interrupted = !runs.fill(jobs);
    result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    result.done = runs.done();
    result.runs = runs.runs();
    result.ended = runs.ended();
    result.failed = runs.failed();
    folder.close(result.interrupted ? "interrupted" : "finished");
  } catch (const std::exception& error) {
    folder.abandon(error.what());
    throw;
  }
  if (options.shard.alone) result.kept = std::make_shared<const StoredRuns>(folder.runs());
  return result;
}

}  // namespace solenoid
