#include "experiments/cluster/status.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/base/files.hpp"
#include "experiments/campaign/manifest.hpp"
#include "experiments/campaign/shards.hpp"
#include "experiments/campaign/stored_runs.hpp"
#include "experiments/report/results.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <regex>

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

namespace fs = std::filesystem;

/// Whether a process of this machine, or one that the file system knows of, has the file.
bool in_use(const std::string& path) {
  const OpenFile file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  return file && !take_lock(file, FileLock::shared);
}

/// What a task said last of how many runs it has done: "12/40, 0:07 left: ...".
std::size_t last_count(const std::string& log) {
  constexpr std::streamoff tail = 4096;
  std::ifstream in(log, std::ios::binary | std::ios::ate);
  if (!in) return 0;
  in.seekg(std::max<std::streamoff>(0, std::streamoff(in.tellg()) - tail));
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  static const std::regex count("(?:^|\n)([0-9]+)/[0-9]+, ");
  std::size_t last = 0;
  for (auto at = std::sregex_iterator(text.begin(), text.end(), count); at != std::sregex_iterator(); ++at)
    last = std::stoul((*at)[1]);
  return last;
}

std::string log_of(const std::string& folder, const SlurmJobs& jobs, int shard) {
  int first = 0;
  for (const SlurmJobs::Array& array : jobs.arrays)
    if (array.first < shard) first = std::max(first, array.first);
  return first == 0 ? fmt::format("{}/slurm/{}.log", folder, shard)
                    : fmt::format("{}/slurm/{}-from-{}.log", folder, shard - first, first);
}

/// What the runs that are left take a core, by the mean of those of the same variant.
double core_s_left(const Campaign& campaign, const StoredRuns& kept) {
  std::vector<double> sum(campaign.variants.size());
  std::vector<std::size_t> done(campaign.variants.size()), left(campaign.variants.size());
  for (std::size_t run = 0; run < kept.size(); ++run) {
    const std::size_t variant = campaign.runs.variant(run);
    if (kept.ending(run) <= StoredRuns::Ending::failed) {
      ++left[variant];
      continue;
    }
    sum[variant] += kept.wall_s(run);
    ++done[variant];
  }
  const double guess = expected_core_s(campaign) / static_cast<double>(std::max<std::size_t>(kept.size(), 1));
  double all = 0.0;
  for (std::size_t v = 0; v < sum.size(); ++v)
    all += static_cast<double>(left[v]) * (done[v] > 0 ? sum[v] / static_cast<double>(done[v]) : guess);
  return all;
}

std::string time_text(double seconds) {
  const auto minutes = static_cast<long>(std::ceil(seconds / 60.0));
  return minutes < 60 ? fmt::format("{} min", minutes) : fmt::format("{} h {:02} min", minutes / 60, minutes % 60);
}

std::string state_text(const ShardStatus& shard) {
  if (shard.task) {
    const SlurmTask& task = *shard.task;
    std::string text = task.state;
    if (!task.node.empty()) text += " on " + task.node;
    if (task.waits() && !task.reason.empty() && task.reason != "None") text += ", " + task.reason;
    if (task.restarts > 0)
      text += fmt::format(", restarted {}", task.restarts == 1 ? "once" : fmt::format("{} times", task.restarts));
    return text;
  }
  return shard.at_work ? "at work" : shard.left() > 0 ? "nobody is at it" : "ended";
}

nlohmann::ordered_json read_manifest(const std::string& folder) {
  const std::string path = folder + "/manifest.json";
  const auto text = read_whole_file(path, file_size::json);
  if (!text)
    throw ConfigError(fmt::format("{}: cannot be read (allowed: a results folder of `solenoid compare`)", path));
  auto manifest = parse_json(*text, path);
  require_manifest(manifest, path);
  return manifest;
}

/// Of each of so many shards, 0: of a campaign that is not parted.
std::vector<ShardStatus> shards_of(const Campaign& campaign, const StoredRuns& kept, const std::string& folder,
                                   int parted) {
  using Ending = StoredRuns::Ending;
  std::vector<ShardStatus> shards;
  for (int index = 1; index <= std::max(1, parted); ++index) {
    const Shard shard = parted > 0 ? Shard::of(index, parted) : Shard{};
    shards.push_back(
        {.shard = index, .at_work = in_use(fmt::format("{}/shards/{}.runs", folder, shard.name())), .task = {}});
  }
  const std::vector<std::uint32_t> owners = shards_of_runs(campaign, std::max(1, parted));
  for (std::size_t run = 0; run < owners.size(); ++run) {
    ShardStatus& shard = shards[owners[run] - 1];
    ++shard.runs;
    shard.failed += kept.ending(run) == Ending::failed;
    shard.done += kept.ending(run) > Ending::failed;
  }
  return shards;
}

}  // namespace

CampaignStatus status_of(const std::string& folder) {
  const auto manifest = read_manifest(folder);
  if (!fs::is_directory(folder + "/shards"))
    throw ConfigError(
        fmt::format("{}: a version before wrote it, a file a run (allowed: a folder of this version; "
                    "`solenoid report {}` shows this one)",
                    folder, folder));
  const Campaign campaign = read_campaign(folder + "/resolved.toml", {.loads_plugins = false});
  StoredRuns kept(folder, campaign, maker_of(manifest).value_or(""));
  kept.refresh();
  CampaignStatus status{.folder = folder,
                        .campaign = manifest.value("campaign", ""),
                        .state = manifest.value("status", ""),
                        .runs = kept.size(),
                        .shards = {},
                        .seconds_left = {},
                        .problems = kept.problems()};
  const SlurmJobs jobs = SlurmJobs::of(folder);
  std::map<int, SlurmTask> tasks;
  try {
    if (!jobs.arrays.empty()) tasks = jobs.tasks();
  } catch (const std::exception& error) {
    status.problems.push_back(error.what());
  }
  const int parted = jobs.shards > 0 ? jobs.shards : manifest.value("shards", 0);
  for (ShardStatus& shard : shards_of(campaign, kept, folder, parted)) {
    if (const auto task = tasks.find(shard.shard); task != tasks.end()) {
      shard.task = task->second;
      shard.at_work = shard.at_work || task->second.runs();
      if (task->second.runs())
        shard.begun =
            std::max(std::min(last_count(log_of(folder, jobs, shard.shard)), shard.runs), shard.done) - shard.done;
    }
    if (shard.at_work) status.cores += std::max(jobs.cores, 1);
    status.done += shard.done;
    status.failed += shard.failed;
    status.left += shard.left();
    status.shards.push_back(std::move(shard));
  }
  status.core_s_left = core_s_left(campaign, kept);
  if (status.cores > 0) status.seconds_left = status.core_s_left / status.cores;
  status.bytes = kept.bytes();
  return status;
}

Result result_of(const CampaignStatus& s) {
  Result result{
      .title = fmt::format("{}: {} of {} runs done, {} failed, {} left", s.campaign, s.done, s.runs, s.failed, s.left)};
  result.facts = {{"folder", s.folder}, {"campaign", s.campaign},
                  {"state", s.state},   {"runs", s.runs},
                  {"done", s.done},     {"failed", s.failed},
                  {"left", s.left},     {"core_s_left", s.core_s_left},
                  {"cores", s.cores},   {"seconds_left", s.seconds_left ? Json(*s.seconds_left) : Json()},
                  {"bytes", s.bytes}};
  Table table{.name = "shards",
              .columns = {{"shard", "shard"},
                          {"runs", "runs"},
                          {"done", "done"},
                          {"failed", "failed"},
                          {"left", "left"},
                          {"begun", "done on its node"},
                          {"state", "state", "<"}}};
  std::size_t whole = 0, running = 0, waiting = 0;
  for (const ShardStatus& shard : s.shards) {
    whole += shard.left() == 0 && shard.failed == 0;
    running += shard.at_work;
    waiting += shard.task && shard.task->waits();
    if (shard.left() == 0 && shard.failed == 0 && !shard.at_work) continue;
    table.add({shard.shard, shard.runs, shard.done, shard.failed, shard.left(), shard.begun, state_text(shard)});
  }
  result.notes.push_back(fmt::format("{} of {} shards are whole, {} at work, {} waiting; {:.1f} MB so far.", whole,
                                     s.shards.size(), running, waiting, static_cast<double>(s.bytes) / 1e6));
  if (s.left + s.failed > 0) {
    std::string time = fmt::format("{} of a core's time to go", time_text(s.core_s_left));
    if (s.seconds_left) time += fmt::format(", with {} at work about {}", s.cores, time_text(*s.seconds_left));
    result.notes.push_back(time + ".");
  }
  if (s.left == 0 && s.state != "finished") result.notes.push_back("solenoid merge " + s.folder + " makes the result.");
  if (table.rows.empty()) result.facts["shards"] = Json::array();
  if (!table.rows.empty()) result.tables.push_back(std::move(table));
  return result;
}

}  // namespace solenoid
