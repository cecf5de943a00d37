#include "tests/experiments/program_under_test.hpp"

#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

/// A file's rows without what a clock decides.
std::vector<std::map<std::string, std::string>> rows_of(const Folder& folder, const std::string& results) {
  auto rows = read_csv(text_of(folder.file(results + "/runs.csv")));
  for (auto& row : rows)
    std::erase_if(
        row, [](const auto& cell) { return cell.first.starts_with("solve_us_") || cell.first == "deadline_misses"; });
  return rows;
}

/// The ranking's lines up to the times of solving.
std::string before_times(const std::string& table) {
  const std::size_t column = table.find("solve p50");
  std::string text;
  std::istringstream lines(table);
  for (std::string line; std::getline(lines, line) && !line.empty();) text += line.substr(0, column - 8) + "\n";
  return text;
}

/// The small campaign done whole into "whole", and again in shards by each test.
class ShardedCampaign : public testing::Test {
 protected:
  ShardedCampaign() {
    folder_.write("c.toml", small_campaign);
    EXPECT_EQ(run_program(folder_, "compare c.toml --out whole").exit_code, 0);
  }

  ProgramRun shard(const std::string& share, const std::string& more = "", const std::string& before = "") const {
    return run_program(folder_, "compare c.toml --shard " + share + " --out parts " + more, before);
  }
  ProgramRun merge(int exit_code = 0) const {
    ProgramRun ended = run_program(folder_, "merge parts --no-report");
    EXPECT_EQ(ended.exit_code, exit_code) << ended.err;
    return ended;
  }
  void expect_equal_to_whole() const {
    merge();
    EXPECT_EQ(rows_of(folder_, "parts"), rows_of(folder_, "whole"));
  }
  json status() const { return json::parse(run_program(folder_, "status parts --format json").out); }

  Folder folder_;
};

TEST_F(ShardedCampaign, MergesToWhatOneProcessMakes) {
  for (const char* share : {"2/3", "3/3", "1/3"}) {
    const ProgramRun ended = shard(share);
    EXPECT_EQ(ended.exit_code, 0) << ended.err;
    EXPECT_EQ(ended.out, "Results: parts\n");
  }
  EXPECT_FALSE(std::filesystem::exists(folder_.file("parts/runs.csv")));
  expect_equal_to_whole();
  const json manifest = json::parse(text_of(folder_.file("parts/manifest.json")));
  EXPECT_EQ(manifest.at("status"), "finished");
  EXPECT_EQ(manifest.at("shards"), 3);
  EXPECT_EQ(manifest.at("counts").at("ok"), 8);
  EXPECT_EQ(text_of(folder_.file("parts/resolved.toml")), text_of(folder_.file("whole/resolved.toml")));
  // The ranking that is printed, but for the times at its end.
  const std::string whole = run_program(folder_, "merge whole --no-report").out, parts = merge().out;
  EXPECT_EQ(before_times(whole), before_times(parts));
  EXPECT_THAT(before_times(parts), HasSubstr("nine_pd"));
}

TEST_F(ShardedCampaign, MayBePartedAnewAndDoesNothingTwice) {
  shard("1/2");
  EXPECT_THAT(shard("1/2").err, HasSubstr("4 of 4 runs are there already"));
  EXPECT_EQ(status().at("left"), 4);
  for (const char* share : {"1/5", "2/5", "3/5", "4/5", "5/5"}) shard(share);
  EXPECT_EQ(status().at("left"), 0);
  expect_equal_to_whole();
  std::uintmax_t bytes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_.file("parts/shards")))
    bytes += entry.path().extension() == ".runs" ? entry.file_size() : 0;
  EXPECT_LT(bytes, 2 * std::filesystem::file_size(folder_.file("whole/shards/all.runs"))) << "each run once";
}

TEST_F(ShardedCampaign, WhatIsMissingIsToldAndDoneAgain) {
  shard("1/2");
  EXPECT_THAT(merge(1).err, HasSubstr("4 runs are missing"));
  EXPECT_EQ(rows_of(folder_, "parts").size(), 4u);
  EXPECT_EQ(json::parse(text_of(folder_.file("parts/manifest.json"))).at("status"), "interrupted");
  shard("2/2");
  EXPECT_FALSE(std::filesystem::exists(folder_.file("parts/runs.csv"))) << "it is not of all any more";
  std::filesystem::resize_file(folder_.file("parts/shards/2-of-2.runs"),
                               std::filesystem::file_size(folder_.file("parts/shards/2-of-2.runs")) - 1);
  const ProgramRun cut = merge(1);
  EXPECT_THAT(cut.err, HasSubstr("parts/shards/2-of-2.runs: "));
  EXPECT_THAT(cut.err, HasSubstr("at its end are of no whole record"));
  EXPECT_THAT(cut.err, HasSubstr("1 runs are missing"));
  EXPECT_THAT(shard("2/2").err, HasSubstr("3 of 4 runs are there already"));
  expect_equal_to_whole();
}

TEST_F(ShardedCampaign, ScratchIsPutIntoTheFolderAtTheEndAndLeftEmpty) {
  EXPECT_EQ(shard("1/1").exit_code, 0) << "not parted";
  std::filesystem::remove_all(folder_.file("parts"));
  EXPECT_THAT(refusal_of(folder_, "compare c.toml --out parts --scratch near"),
              HasSubstr("--scratch: the campaign is not parted"));
  for (const char* share : {"1/2", "2/2", "2/2"}) EXPECT_EQ(shard(share, "--scratch near").exit_code, 0);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.file("near")));
  expect_equal_to_whole();
  EXPECT_THAT(run_program(folder_, "merge parts --no-report").err, Not(HasSubstr("damaged")));
}

TEST_F(ShardedCampaign, AFullDiskLeavesWholeRecordsOnly) {
  if (!may_limit_files) GTEST_SKIP();
  shard("1/2", "--traces none");
  for (const int blocks : {2, 3, 4}) {  // of 512 bytes
    const ProgramRun ended = shard("2/2", "--traces none", "ulimit -f " + std::to_string(blocks) + ";");
    EXPECT_EQ(ended.exit_code, 2);
    EXPECT_THAT(ended.err, HasSubstr("cannot be written: File too large"));
    EXPECT_THAT(merge(1).err, Not(HasSubstr("damaged")));
    EXPECT_THAT(merge(1).err, Not(HasSubstr("no whole record")));
  }
  EXPECT_EQ(shard("2/2").exit_code, 0);
  expect_equal_to_whole();
}

TEST_F(ShardedCampaign, AnotherCampaignOrProgramIsRefusedByName) {
  shard("1/2");
  std::string other = small_campaign;
  other.replace(other.find("0.15"), 4, "0.30");
  folder_.write("other.toml", other);
  EXPECT_THAT(refusal_of(folder_, "compare other.toml --shard 2/2 --out parts"),
              HasSubstr("parts/resolved.toml: is of another campaign (allowed: "));
  json manifest = json::parse(text_of(folder_.file("parts/manifest.json")));
  manifest["program"]["maker"] = "0123456789abcdef";
  folder_.write("parts/manifest.json", manifest.dump());
  EXPECT_THAT(shard("2/2").err,
              HasSubstr("parts/manifest.json: its runs are made by another program or other plug-ins"));
  const ProgramRun merged = merge(1);
  EXPECT_THAT(merged.err,
              HasSubstr("parts/shards/1-of-2.runs: 4 runs of another program or other plug-ins: not counted"));
  EXPECT_THAT(merged.err, HasSubstr("8 runs are missing"));
  // A shard of another campaign among ours.
  manifest["program"]["maker"] = json::parse(text_of(folder_.file("whole/manifest.json"))).at("program").at("maker");
  folder_.write("parts/manifest.json", manifest.dump());
  ASSERT_EQ(run_program(folder_, "compare other.toml --shard 2/2 --out strange").exit_code, 0);
  std::filesystem::copy(folder_.file("strange/shards/2-of-2.runs"), folder_.file("parts/shards/2-of-2.runs"));
  EXPECT_THAT(merge(1).err, HasSubstr("of another campaign, or of this one before it was changed: not counted"));
}

TEST_F(ShardedCampaign, AnotherBuildMayMergeAndDoesNotMakeTheRunsItsOwn) {
  shard("1/2");
  shard("2/2");
  const std::string other = folder_.file("other");
  std::filesystem::copy_file(SOLENOID_PROGRAM, other);
  std::ofstream(other, std::ios::app) << "x";
  ASSERT_EQ(std::system(("cd '" + folder_.path() + "' && ./other merge parts --no-report >/dev/null 2>&1").c_str()), 0);
  expect_equal_to_whole();
  EXPECT_THAT(shard("1/2").err, HasSubstr("4 of 4 runs are there already"));
}

TEST_F(ShardedCampaign, MayBeMergedByTwoAtOnce) {
  shard("1/2");
  shard("2/2");
  const std::string one = "'" SOLENOID_PROGRAM "' merge parts --no-report >/dev/null 2>>errors & ";
  const std::string script =
      "cd '" + folder_.path() + "'; " + one + one + one + one + "wait; cat errors; test ! -s errors";
  EXPECT_EQ(std::system(("bash -c \"" + script + "\"").c_str()), 0);
  expect_equal_to_whole();
}

TEST_F(ShardedCampaign, KeepsTheTracesThatAreAskedFor) {
  EXPECT_THAT(refusal_of(folder_, "compare c.toml --out o --traces best"),
              HasSubstr("--traces: 'best' is not known (allowed: "));
  shard("1/2", "--traces none");
  EXPECT_FALSE(std::filesystem::exists(folder_.file("parts/shards/1-of-2.traces")));
  shard("2/2", "--traces worst:1");
  const auto drawn = [&](const std::string& id) {
    return run_program(folder_, "report parts --figure " + id + " --svg a.svg").exit_code == 0;
  };
  int count = 0;
  for (const auto& row : rows_of(folder_, "whole"))
    count += drawn(row.at("scenario") + "--" + row.at("variant") + "--s" + row.at("seed"));
  EXPECT_EQ(count, 2) << "one of each variant";
  expect_equal_to_whole();
}

TEST_F(ShardedCampaign, InAnArrayJobATaskTakesItsShare) {
  const auto task = [&](int id, const std::string& more) {
    return run_program(
        folder_, "compare c.toml " + more,
        "SLURM_ARRAY_TASK_ID=" + std::to_string(id) + " SLURM_ARRAY_TASK_MIN=5 SLURM_ARRAY_TASK_COUNT=2");
  };
  EXPECT_THAT(task(5, "").err, HasSubstr("--out: missing (allowed: the folder that all shards share; this is 1/2"));
  EXPECT_THAT(task(5, "--out parts").err, HasSubstr("shard 1/2: 4 of 4 runs are done"));
  EXPECT_THAT(task(6, "--out parts --shard auto").err, HasSubstr("shard 2/2: 4 of 4 runs are done"));
  expect_equal_to_whole();
  EXPECT_THAT(run_program(folder_, "compare c.toml --out x --shard auto").err,
              HasSubstr("auto outside of an array job"));
}

TEST_F(ShardedCampaign, StatusSaysHowFarItIs) {
  shard("2/4");
  const json found = status();
  EXPECT_EQ(found.at("runs"), 8);
  EXPECT_EQ(found.at("done"), 2);
  EXPECT_EQ(found.at("left"), 6);
  EXPECT_GT(found.at("core_s_left").get<double>(), 0.0);
  ASSERT_EQ(found.at("shards").size(), 3u) << "those that are whole are not listed";
  EXPECT_EQ(found["shards"][0].at("state"), "nobody is at it");
  const ProgramRun shown = run_program(folder_, "status parts");
  EXPECT_THAT(shown.out, HasSubstr("2 of 8 runs done, 0 failed, 6 left"));
  EXPECT_THAT(shown.out, HasSubstr("1 of 4 shards are whole"));
  EXPECT_THAT(refusal_of(folder_, "status nowhere"), HasSubstr("nowhere/manifest.json: cannot be read (allowed: "));
  EXPECT_THAT(refusal_of(folder_, "merge nowhere"), HasSubstr("nowhere: no folder (allowed: "));
}

TEST_F(ShardedCampaign, ShowsTheScriptsThatItWouldSubmit) {
  const ProgramRun shown = run_program(
      folder_,
      "compare c.toml --slurm --dry-run --nodes 3 --time 10:00 --mem 2G --partition fast --throttle 2 --jobs 4 "
      "--sbatch=--account=mine --out parts");
  EXPECT_EQ(shown.exit_code, 0) << shown.err;
  for (const char* line :
       {"#SBATCH --array=1-3%2\n", "#SBATCH --time=10:00\n", "#SBATCH --mem=2G\n", "#SBATCH --partition=fast\n",
        "#SBATCH --account=mine\n", "--cpus-per-task=4\n", "SOLENOID_SHARDS=3", "'merge'"})
    EXPECT_THAT(shown.out, HasSubstr(line));
  EXPECT_FALSE(std::filesystem::exists(folder_.file("parts")));
  EXPECT_THAT(refusal_of(folder_, "compare c.toml --throttle 3"),
              HasSubstr("--throttle: nothing is submitted without --slurm"));
  folder_.write("a.sh", shown.out.substr(0, shown.out.rfind("#!/bin/bash")));
  folder_.write("b.sh", shown.out.substr(shown.out.rfind("#!/bin/bash")));
  EXPECT_EQ(std::system(("bash -n '" + folder_.file("a.sh") + "' && bash -n '" + folder_.file("b.sh") + "'").c_str()),
            0);
}

}  // namespace
}  // namespace solenoid::test
