#include "experiments/cluster/slurm_runner.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/child_process.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/cluster/command.hpp"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr int most_arrays = 4;
constexpr double between_looks_s = 2.0, late_files_s = 10.0;

void cancel(const SlurmJobs& jobs) {
  for (const SlurmJobs::Array& array : jobs.arrays) run_command("scancel", {std::to_string(array.id)}, "slurm-client");
}

/// Whether no task of the jobs waits or runs. A controller that does not answer is asked again, `patience` times in all.
bool all_over(const SlurmJobs& jobs, int& patience) {
  try {
    return std::ranges::all_of(jobs.tasks(), [](const auto& task) { return task.second.over(); });
  } catch (const ConfigError&) {
    if (--patience <= 0) throw;
    return false;
  }
}

/// Waits until no task of the jobs waits or runs; false if interrupted, and then they are cancelled.
bool wait_for(const SlurmJobs& jobs) {
  int patience = 300;  // of looks: ten minutes and more
  for (;;) {
    if (InterruptGuard::raised()) return cancel(jobs), false;
    if (all_over(jobs, patience)) return true;
    wait_s(between_looks_s);
  }
}

std::optional<std::vector<RunRecord>> run_on_slurm(const Campaign& campaign, const std::string& folder,
                                                   const SlurmSettings& settings) {
  using Ending = StoredRuns::Ending;
  StoredRuns kept(folder, campaign);
  for (int array = 0; array < most_arrays; ++array) {
    if (!wait_for(submit(campaign, folder, settings, plan_slurm(campaign, folder, settings)))) return std::nullopt;
    // A folder that machines share shows what a task has written a little later.
    wait_until([&] { return kept.refresh(), kept.count(Ending::missing) == 0 || InterruptGuard::raised(); },
               array == 0 ? late_files_s : 0.1);
    if (InterruptGuard::raised()) return std::nullopt;
    if (kept.count(Ending::missing) == 0) break;
  }
  if (const std::size_t missing = kept.count(Ending::missing); missing > 0)
    throw std::runtime_error(
        fmt::format("{} of {} runs are missing after {} arrays; what their tasks said is in {}/slurm", missing,
                    kept.size(), most_arrays, folder));
  std::vector<RunRecord> records;
  for_each_run(kept, [&](std::size_t, const KeptRun& run) { records.push_back(run.record); });
  return records;
}

}  // namespace

CampaignRunner slurm_runner(const std::string& folder, SlurmSettings settings) {
  settings.finishes = false;
  settings.traces = "none";
  settings.program = program_copy(folder);
  const auto number = std::make_shared<int>(0);
  return [folder, settings, number](const Campaign& campaign) {
    const InterruptGuard guard;
    std::string path;
    do path = fmt::format("{}/evaluations/{:04}", folder, ++*number);
    while (std::filesystem::exists(path));  // of a search that was cut off
    create_folder(path);
    auto records = run_on_slurm(campaign, path, settings);
    std::error_code ignored;
    if (records) std::filesystem::remove_all(path, ignored);
    return records;
  };
}

}  // namespace solenoid
