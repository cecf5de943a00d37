// What a campaign of a million runs costs after it has run: made-up records of a real campaign in real shards, then what
// `solenoid merge` does of them, step by step and as a whole, each in a process of its own whose largest memory is told.

#include "experiments/report/merge.hpp"

#include "experiments/report/page.hpp"
#include "experiments/report/paired.hpp"
#include "experiments/report/ranking.hpp"
#include "tests/bench/timing.hpp"
#include "tests/experiments/synthetic_runs.hpp"

#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>

#include <CLI/CLI.hpp>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace {

using namespace solenoid;
using bench::seconds_of;

/// Does it in a process of its own; the largest memory of that [MB].
double memory_of(const std::function<void()>& work) {
  std::fflush(stdout);
  const pid_t process = ::fork();
  if (process == 0) {
    int code = 0;
    try {
      work();
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s\n", error.what());
      code = 1;
    }
    std::fflush(stdout);
    ::_exit(code);
  }
  int status = 0;
  rusage used{};
  if (::wait4(process, &status, 0, &used) != process || status != 0) throw std::runtime_error("a step failed");
  return 1e-3 * static_cast<double>(used.ru_maxrss);
}

double mb(std::uintmax_t bytes) { return 1e-6 * static_cast<double>(bytes); }

/// What merge() does, a line each.
void steps(const std::string& folder) {
  const auto tell = [](const char* what, double s) { fmt::print("  {:<28}{:8.2f} s\n", what, s); };
  std::optional<Results> results;
  std::optional<Campaign> campaign;
  tell("campaign read", seconds_of([&] { campaign = read_campaign(folder + "/resolved.toml"); }));
  StoredRuns index(folder, *campaign);
  tell("index of the shards", seconds_of([&] { index.refresh(); }));
  tell("runs.csv", seconds_of([&] { write_runs_csv(folder, *campaign, index); }));
  tell("all of read_results", seconds_of([&] { results = read_results(folder); }));
  tell("ranking", seconds_of([&] { rank_variants(*results->table()); }));
  tell("pairs of variants", seconds_of([&] { PairedVariants(*results->table()).all(); }));
  std::string page;
  tell("page", seconds_of([&] { page = report_of(*results, true); }));
  fmt::print("  {:<28}{:8.2f} MB, {} runs listed of {}\n", "its size", mb(page.size()), results->runs.size(),
             results->table()->size());
}

void measure(const std::string& folder, std::size_t runs, int variants, int shards) {
  std::vector<std::string> names;
  for (const VariantConfig& variant : shipped_variants())
    if (variant.system == systems().front() && static_cast<int>(names.size()) < variants) names.push_back(variant.name);
  const Campaign campaign = test::synthetic_campaign(names, runs / names.size());
  fmt::print("{} runs: {} variants in {} scenarios, {} shards\n", campaign.runs.size(), names.size(),
             campaign.scenarios.size(), shards);
  memory_of([&] {
    fmt::print("  {:<28}{:8.2f} s\n", "made up and written",
               seconds_of([&] { test::write_synthetic(campaign, folder, shards); }));
  });
  memory_of([&] {
    StoredRuns kept(folder, campaign);
    kept.refresh();
    fmt::print("  {:<28}{:8.1f} MB in {} files\n", "their records", mb(kept.bytes()), kept.files());
  });
  memory_of([&] { steps(folder); });
  const double largest = memory_of(
      [&] { fmt::print("  {:<28}{:8.2f} s\n", "merge() as a whole", seconds_of([&] { merge(folder, true); })); });
  fmt::print("  {:<28}{:8.0f} MB\n", "its largest memory", largest);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("What merging a large campaign costs");
  std::size_t runs = 200'000;
  int variants = 4, shards = 40;
  std::string out;
  app.add_option("--runs", runs, "records; default 200000")->check(CLI::Range(1, 10'000'000));
  app.add_option("--variants", variants, "default 4")->check(CLI::Range(1, 100));
  app.add_option("--shards", shards, "default 40")->check(CLI::Range(1, most_shards));
  app.add_option("--out", out, "a folder that stays; default: none does");
  CLI11_PARSE(app, argc, argv);
  try {
    const TemporaryFolder temporary;
    measure(out.empty() ? (temporary.path() / "results").string() : out, runs, variants, shards);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
