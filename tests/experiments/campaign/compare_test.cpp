#include "tests/experiments/program_under_test.hpp"

#include <csignal>
#include <thread>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>

namespace solenoid::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

/// runs.csv without what a clock decides.
std::string without_timing(const std::string& csv) {
  std::string text;
  for (auto& row : read_csv(csv)) {
    for (const auto& [heading, cell] : row)
      if (!heading.starts_with("solve_us_") && heading != "deadline_misses")
        text.append(heading).append("=").append(cell).append(" ");
    text += "\n";
  }
  return text;
}

TEST(Compare, RunsCsvIsTheSameToTheLastDigitWhateverTheJobs) {
  Folder folder;
  folder.write("c.toml", small_campaign);
  ASSERT_EQ(run_program(folder, "compare c.toml --out one --jobs 1").exit_code, 0);
  ASSERT_EQ(run_program(folder, "compare c.toml --out four --jobs 4").exit_code, 0);
  const std::string one = text_of(folder.file("one/runs.csv")), four = text_of(folder.file("four/runs.csv"));
  EXPECT_EQ(read_csv(one).size(), 8u);
  EXPECT_EQ(without_timing(one), without_timing(four));
}

TEST(Compare, SeedsMatterUnderNoise) {
  Folder folder;
  folder.write("c.toml", small_campaign);
  const auto rows = read_csv(run_program(folder, "compare c.toml --out o --format csv").out);
  ASSERT_EQ(rows.size(), 8u);
  EXPECT_EQ(rows[0].at("seed"), "3");
  EXPECT_EQ(rows[1].at("seed"), "4");
  EXPECT_NE(rows[0].at("rmse_mm"), rows[1].at("rmse_mm"));
}

TEST(Compare, JsonIsOneObjectWithTheNamesOfTheDesign) {
  Folder folder;
  folder.write("c.toml", small_campaign);
  const ProgramRun ended = run_program(folder, "compare c.toml --out o --format json");
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const json result = json::parse(ended.out);
  ASSERT_EQ(result.size(), 2u);
  ASSERT_TRUE(result.contains("paired"));
  ASSERT_EQ(result.at("runs").size(), 8u);
  const std::vector<std::string> numbers = {"payload_kg",
                                            "seed",
                                            "rmse_mm",
                                            "mae_mm",
                                            "rmse_measured_mm",
                                            "mae_measured_mm",
                                            "sse_mean_abs_mm",
                                            "sse_abs_mean_mm",
                                            "sse_max_abs_mm",
                                            "ssa_mm",
                                            "itae",
                                            "overshoot_percent",
                                            "coil_switches",
                                            "switches_per_s",
                                            "steady_switches_per_s",
                                            "busiest_coil_per_s",
                                            "life_years",
                                            "valves_usd",
                                            "air_g",
                                            "air_nl",
                                            "steady_air_g_per_s",
                                            "motor_rms_n",
                                            "deadline_misses",
                                            "proven_optimal_fraction"};
  for (const json& run : result.at("runs")) {
    for (const std::string& name : numbers) EXPECT_TRUE(run.at(name).is_number()) << name;
    for (const char* name : {"system", "variant", "scenario", "trajectory", "status"})
      EXPECT_TRUE(run.at(name).is_string());
    for (const char* name : {"p50", "p90", "p99", "p999", "max"}) EXPECT_TRUE(run.at("solve_us").at(name).is_number());
    EXPECT_EQ(run.size(), numbers.size() + 6);
    EXPECT_EQ(run.at("system"), "actuator");
    EXPECT_EQ(run.at("status"), "ok");
  }
  const auto rows = read_csv(text_of(folder.file("o/runs.csv")));
  for (std::size_t i = 0; i < rows.size(); ++i)
    EXPECT_EQ(std::stod(rows[i].at("rmse_mm")), result.at("runs")[i].at("rmse_mm").get<double>());
}

TEST(Compare, TableRanksByGeometricMeanAndReadsWithoutColour) {
  Folder folder;
  folder.write("c.toml", small_campaign);
  const ProgramRun ended = run_program(folder, "compare c.toml --out o");
  EXPECT_THAT(ended.out, HasSubstr("rank"));
  EXPECT_THAT(ended.out, HasSubstr("*"));
  EXPECT_THAT(ended.out, HasSubstr("Results: o"));
  EXPECT_THAT(ended.out, Not(HasSubstr("\033")));
  EXPECT_THAT(ended.err, HasSubstr("8/8"));
  EXPECT_THAT(ended.err, Not(HasSubstr("\r")));
}

TEST(Compare, SelectionTakesAnyKnownVariant) {
  Folder folder;
  folder.write("c.toml", small_campaign);
  const auto rows =
      read_csv(run_program(folder, "compare c.toml --out o --variant thesis_id --scenario loaded --format csv").out);
  ASSERT_EQ(rows.size(), 2u);
  for (const auto& row : rows) {
    EXPECT_EQ(row.at("variant"), "thesis_id");
    EXPECT_EQ(row.at("scenario"), "loaded");
  }
}

/// The row of runs.csv of a run.
std::map<std::string, std::string> row_of(const Folder& folder, const std::string& scenario, const std::string& variant,
                                          const std::string& seed) {
  for (auto& row : read_csv(text_of(folder.file("o/runs.csv"))))
    if (row.at("scenario") == scenario && row.at("variant") == variant && row.at("seed") == seed) return row;
  return {};
}

/// Changes a byte of a file, counted from its end.
void flip(const std::string& path, std::size_t from_end) {
  std::string bytes = text_of(path);
  bytes[bytes.size() - from_end] = static_cast<char>(bytes[bytes.size() - from_end] ^ 0x20);
  std::ofstream(path, std::ios::binary) << bytes;
}

TEST(Compare, ResumesWhatIsTheSameAndRepeatsWhatChanged) {
  Folder folder;
  folder.write("c.toml", small_campaign);
  ASSERT_EQ(run_program(folder, "compare c.toml --out o").exit_code, 0);
  const std::string before = text_of(folder.file("o/runs.csv"));
  const auto kept = row_of(folder, "step", "nine_pd", "3"), changed = row_of(folder, "loaded", "nine_pd", "3");

  EXPECT_THAT(run_program(folder, "compare c.toml --out o").err, HasSubstr("8 of 8 runs are there already"));
  EXPECT_EQ(text_of(folder.file("o/runs.csv")), before) << "timing columns too: nothing ran again";

  std::string other = small_campaign;
  other.replace(other.find("0.15"), 4, "0.30");
  folder.write("c.toml", other);
  EXPECT_THAT(run_program(folder, "compare c.toml --out o").err, HasSubstr("4 of 8 runs are there already"));
  EXPECT_EQ(row_of(folder, "step", "nine_pd", "3"), kept);
  EXPECT_NE(row_of(folder, "loaded", "nine_pd", "3"), changed);

  folder.write("c.toml", small_campaign);  // and back: what was done is still there
  EXPECT_THAT(run_program(folder, "compare c.toml --out o").err, HasSubstr("8 of 8 runs are there already"));
  EXPECT_EQ(text_of(folder.file("o/runs.csv")), before);
}

TEST(Compare, ResumesOnlyWhatIsAsItWasWritten) {
  Folder folder;
  folder.write("c.toml", small_campaign);
  ASSERT_EQ(run_program(folder, "compare c.toml --out o").exit_code, 0);
  const std::string before = without_timing(text_of(folder.file("o/runs.csv")));
  const std::string runs = "o/shards/all.runs", traces = "o/shards/all.traces";
  const auto done_again = [&](int kept, const std::string& why) {
    const ProgramRun again = run_program(folder, "compare c.toml --out o");
    EXPECT_EQ(again.exit_code, 0);
    EXPECT_EQ(again.err.find(std::to_string(kept) + " of 8 runs are there already") != std::string::npos, kept > 0);
    EXPECT_THAT(again.err, HasSubstr("solenoid: done again: " + why));
    EXPECT_EQ(without_timing(text_of(folder.file("o/runs.csv"))), before);
    EXPECT_THAT(run_program(folder, "compare c.toml --out o").err, HasSubstr("8 of 8 runs are there already"));
  };
  const auto cut = [&](const std::string& file, std::size_t bytes) {
    std::filesystem::resize_file(folder.file(file), std::filesystem::file_size(folder.file(file)) - bytes);
  };
  flip(folder.file(runs), 100);
  done_again(7, runs + ": ");
  cut(runs, 1);
  done_again(7, runs + ": ");
  cut(runs, 200);
  done_again(7, runs + ": ");
  flip(folder.file(traces), 1);
  done_again(7, traces + ": is damaged at byte ");
  cut(traces, 1);
  done_again(7, traces + ": is damaged at byte ");
  std::filesystem::remove(folder.file(traces));
  done_again(0, traces + ": cannot be read: No such file or directory");
}

TEST(Compare, NeverWaitsForAPipeInItsFolder) {
  Folder folder;
  folder.write("c.toml", small_campaign);
  for (const char* name : {"log.txt", ".lock", ".room", "manifest.json.tmp", "shards/all.runs", "shards/all.traces"}) {
    std::filesystem::remove_all(folder.file("o"));
    std::filesystem::create_directories(folder.file("o/shards"));
    ASSERT_EQ(::mkfifo(folder.file(std::string("o/") + name).c_str(), 0600), 0);
    const ProgramRun ended = run_program(folder, "compare c.toml --out o --jobs 1", "timeout -s KILL 20");
    EXPECT_EQ(ended.exit_code, 2) << name;
    EXPECT_THAT(ended.err, HasSubstr(std::string("solenoid: o/") + name + ": is a pipe (allowed: a regular file)\n"));
    EXPECT_TRUE(std::filesystem::is_fifo(folder.file(std::string("o/") + name))) << "it is somebody's";
  }
  EXPECT_EQ(json::parse(text_of(folder.file("o/manifest.json"))).at("status"), "failed");
}

TEST(Compare, MayLogThroughALinkToAFile) {
  Folder folder;
  folder.write("c.toml", small_campaign);
  folder.write("elsewhere", "");
  std::filesystem::create_directory(folder.file("o"));
  std::filesystem::create_symlink("../elsewhere", folder.file("o/log.txt"));
  EXPECT_EQ(run_program(folder, "compare c.toml --out o", "timeout -s KILL 60").exit_code, 0);
  EXPECT_THAT(text_of(folder.file("elsewhere")), HasSubstr("step--nine_pd--s3: ok"));
}

TEST(Compare, TheResolvedConfigurationIsTheSameCampaign) {
  Folder folder;
  folder.write("points.csv", "time_s,position_m\n0,0.0197\n0.1,0.03\n0.3,0.04\n");
  folder.write("model.toml", "base = \"printed\"\nblock_mass_kg = 1.2\n");
  folder.write("c.toml", R"(
variants = ["mine"]
[variant.mine]
model = "model.toml"
[[scenario]]
name = "points"
trajectory = { kind = "csv", path = "points.csv" }
)");
  ASSERT_EQ(run_program(folder, "compare c.toml --out first").exit_code, 0);
  std::filesystem::remove(folder.file("points.csv"));  // the results folder stands alone
  std::filesystem::remove(folder.file("model.toml"));
  const ProgramRun again = run_program(folder, "compare first/resolved.toml --out second");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(without_timing(text_of(folder.file("first/runs.csv"))),
            without_timing(text_of(folder.file("second/runs.csv"))));
  EXPECT_THAT(run_program(folder, "compare first/resolved.toml --out first").err,
              HasSubstr("1 of 1 runs are there already"));
}

TEST(Compare, ManifestSaysWhatRanWhere) {
  Folder folder;
  folder.write("c.toml", small_campaign);
  ASSERT_EQ(run_program(folder, "compare c.toml --out o").exit_code, 0);
  const json manifest = json::parse(text_of(folder.file("o/manifest.json")));
  EXPECT_EQ(manifest.at("status"), "finished");
  EXPECT_EQ(manifest.at("counts").at("runs"), 8);
  EXPECT_EQ(manifest.at("counts").at("ok"), 8);
  EXPECT_EQ(manifest.at("seeds"), json::parse("[3, 4]"));
  EXPECT_GE(manifest.at("machine").at("cores"), 1);
  for (const char* key : {"started", "ended", "program", "jobs", "variants", "scenarios"})
    EXPECT_TRUE(manifest.contains(key)) << key;
  EXPECT_THAT(text_of(folder.file("o/log.txt")), HasSubstr("step--nine_pd--s3: ok"));
}

/// Starts `compare c.toml --out o --jobs 2` in a process group of its own; returns once a first run is there.
pid_t start_and_await_first_run(const Folder& folder) {
  const pid_t process = ::fork();
  if (process == 0) {
    ::setpgid(0, 0);
    if (::chdir(folder.path().c_str()) != 0 || !std::freopen(".out", "w", stdout) || !std::freopen(".err", "w", stderr))
      ::_exit(99);
    ::execl(SOLENOID_PROGRAM, "solenoid", "compare", "c.toml", "--out", "o", "--jobs", "2", nullptr);
    ::_exit(98);
  }
  while (text_of(folder.file("o/log.txt")).find("short--thesis_pd--s1: ok") == std::string::npos) {
    if (::waitpid(process, nullptr, WNOHANG) == process) throw std::runtime_error("ended before its first run");
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return process;
}

int exit_code_of(pid_t process) {
  int status = 0;
  ::waitpid(process, &status, 0);
  EXPECT_EQ(::kill(-process, 0), -1) << "a worker outlives the program";
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

std::vector<pid_t> children_of(pid_t parent) {
  std::vector<pid_t> children;
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    if (std::atoi(entry.path().filename().c_str()) == 0) continue;  // no process; /proc/net/stat is a folder
    const std::string stat = text_of(entry.path() / "stat");        // pid (name) state parent ...
    const auto after_name = stat.rfind(") ");
    if (after_name != std::string::npos && std::atoi(stat.c_str() + after_name + 4) == parent)
      children.push_back(std::atoi(stat.c_str()));
  }
  return children;
}

const std::string short_and_long = R"(
variants = ["thesis_pd"]
[[scenario]]
name = "short"
trajectory = { kind = "sine" }
duration_s = 0.1
[[scenario]]
name = "long"
trajectory = { kind = "sine" }
duration_s = )";

TEST(Compare, AKilledWorkerIsOneFailedRun) {
  Folder folder;
  folder.write("c.toml", short_and_long + "3600.0\n");
  const pid_t process = start_and_await_first_run(folder);
  const std::vector<pid_t> workers = children_of(process);
  ASSERT_EQ(workers.size(), 1u);
  ::kill(workers.front(), SIGKILL);
  EXPECT_EQ(exit_code_of(process), 1);
  const auto rows = read_csv(text_of(folder.file("o/runs.csv")));
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].at("status"), "ok");
  EXPECT_EQ(rows[1].at("status"), "failed: worker ended by signal 9 (Killed)");
  EXPECT_EQ(rows[1].at("rmse_mm"), "");
  EXPECT_THAT(text_of(folder.file(".err")), HasSubstr("1 runs failed"));
  EXPECT_EQ(json::parse(text_of(folder.file("o/manifest.json"))).at("counts").at("failed"), 1);
}

TEST(Compare, InterruptKeepsWhatIsFinishedAndResumes) {
  Folder folder;
  folder.write("c.toml", short_and_long + "3600.0\n");
  const pid_t process = start_and_await_first_run(folder);
  ::kill(-process, SIGINT);  // the whole group, as a terminal does
  ASSERT_EQ(exit_code_of(process), 130) << text_of(folder.file(".err"));
  EXPECT_EQ(json::parse(text_of(folder.file("o/manifest.json"))).at("status"), "interrupted");
  const auto rows = read_csv(text_of(folder.file("o/runs.csv")));
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0].at("scenario"), "short");
  EXPECT_THAT(text_of(folder.file(".err")), HasSubstr("resumes"));

  folder.write("c.toml", short_and_long + "0.2\n");
  const ProgramRun resumed = run_program(folder, "compare c.toml --out o");
  EXPECT_EQ(resumed.exit_code, 0);
  EXPECT_THAT(resumed.err, HasSubstr("1 of 2 runs are there already"));
  EXPECT_EQ(read_csv(text_of(folder.file("o/runs.csv"))).size(), 2u);
}

TEST(Compare, AFullDiskIsOneLineAndNoHalfResult) {
  if (!may_limit_files) GTEST_SKIP();
  for (const int blocks : {0, 1, 3}) {  // of 512 bytes: too small for the manifest, ..., for the larger files
    Folder folder;
    folder.write("c.toml", small_campaign);
    // The shell's own redirections are small; the limit holds for every file the program writes.
    const ProgramRun ended =
        run_program(folder, "compare c.toml --out o --format csv", "ulimit -f " + std::to_string(blocks) + ";");
    if (blocks > 0) {
      EXPECT_THAT(ended.err, HasSubstr("cannot be written: File too large"));
      EXPECT_THAT(ended.err, HasSubstr("o/"));
    }
    EXPECT_EQ(ended.exit_code, 2) << blocks << ended.err;
    EXPECT_FALSE(std::filesystem::exists(folder.file("o/runs.csv")));
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder.path()))
      EXPECT_NE(entry.path().extension(), ".tmp") << entry.path();
  }
}

TEST(Compare, AFullStandardOutputIsAnError) {
  Folder folder;
  const std::string command = "cd '" + folder.path() + "' && '" SOLENOID_PROGRAM "' list >/dev/full 2>.err";
  const int status = std::system(command.c_str());
  EXPECT_EQ(WEXITSTATUS(status), 2);
  EXPECT_THAT(text_of(folder.file(".err")), HasSubstr("standard output: cannot be written"));

  if (!may_limit_files) return;
  ASSERT_EQ(run_program(folder, "list --format json", "ulimit -f 1;").exit_code, 2);  // of 512 bytes
  EXPECT_THAT(text_of(folder.file(".err")), HasSubstr("standard output: cannot be written: File too large"));
}

}  // namespace
}  // namespace solenoid::test
