#include "experiments/report/merge.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/campaign/manifest.hpp"
#include "experiments/campaign/results_folder.hpp"
#include "experiments/report/comparison.hpp"
#include "experiments/report/page.hpp"

#include <fmt/format.h>

namespace solenoid {

Merged merge(const std::string& folder, bool with_report, const std::string& baseline) {
  using Ending = StoredRuns::Ending;
  Merged merged{.results = read_results(folder)};
  Results& results = merged.results;
  if (!results.kept)
    throw ConfigError(
        fmt::format("{}: there is nothing to merge, a version before wrote it, a file a run (allowed: a "
                    "folder of `solenoid compare`; `solenoid report {}` shows this one)",
                    folder, folder));
  require_baseline(results.table()->variants(), baseline, "--against");
  const FolderLock lock(folder, FileLock::shared);
  const StoredRuns& kept = *results.kept;
  merged.ok = kept.count(Ending::ok);
  merged.unstable = kept.count(Ending::unstable);
  merged.failed = kept.count(Ending::failed);
  merged.missing = kept.count(Ending::missing);
  merged.problems = kept.problems();
  write_runs_csv(folder, results.campaign, kept);
  const std::string manifest =
      merged_manifest(results.manifest, merged.missing > 0 ? "interrupted" : "finished", results.campaign, kept);
  write_file_atomically(folder + "/manifest.json", manifest, Writers::several);
  results.manifest = nlohmann::ordered_json::parse(manifest);
  if (!with_report) return merged;
  try {
    const std::string path = folder + "/report.html";
    write_file_atomically(path, report_of(results, true), Writers::several);
    merged.report = path;
  } catch (const ConfigError& error) {
    merged.no_report = error.what();
  }
  return merged;
}

}  // namespace solenoid
