#include "experiments/study/scaling.hpp"

#include "experiments/systems/actuator/scaling/actuator_scaling.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using testing::HasSubstr;

TEST(ScalingBlocks, SplitTheSameHorizonFinerAndFiner) {
  for (int count = 1; count <= most_blocks; ++count) {
    const std::vector<int> periods = scaling_blocks(count);
    EXPECT_EQ(periods.size(), static_cast<std::size_t>(count));
    EXPECT_EQ(std::accumulate(periods.begin(), periods.end(), 0), 20);
    EXPECT_TRUE(std::is_sorted(periods.begin(), periods.end()));
    EXPECT_GE(periods.front(), 1);
  }
}

void expect_consistent(const nlohmann::json& row) {
  const double states = row.at("states"), blocks = row.at("blocks"), instances = 2;
  double tree = 0;
  for (int b = 1; b <= static_cast<int>(blocks); ++b) tree += std::pow(states, b);
  EXPECT_EQ(row.at("full_tree"), tree);
  EXPECT_EQ(row.at("enumeration").is_null(), std::pow(states, blocks) > most_enumerated);
  if (!row.at("enumeration").is_null()) {
    for (const char* key : {"nodes_p50", "nodes_max"}) EXPECT_EQ(row.at("enumeration").at(key), tree);  // all of them
    EXPECT_EQ(row.at("enumeration").at("proven"), 1.0);
  }
  for (const char* search : {"cold", "warm"}) {
    EXPECT_LE(row.at(search).at("nodes_max"), tree + 2 * blocks);  // two incumbents beside the tree
    EXPECT_GE(row.at(search).at("nodes_p50"), 2 * blocks + states);
    EXPECT_LE(row.at(search).at("us_p50"), row.at(search).at("us_p99"));
  }
  ASSERT_EQ(row.at("deadlines").size(), 5u);
  for (const auto& d : row.at("deadlines")) {
    EXPECT_DOUBLE_EQ(d.at("proven"), 1 - d.at("open").get<double>() / instances);
    EXPECT_EQ(d.at("gap_max").is_null(), d.at("open") == 0);
    if (d.at("open") == 0) continue;
    EXPECT_GT(d.at("gap_p50"), 0.0);
    EXPECT_LE(d.at("gap_p50"), d.at("gap_max"));
    EXPECT_LE(d.at("gap_max"), 1.0);
  }
}

TEST(ScalingCommand, PrintsOneConsistentRowForEachValveSetAndNumberOfBlocks) {
  const test::Folder folder;
  const std::string svg = folder / "scaling.svg";
  const test::ProgramRun run =
      test::run_program({"scaling", "--instances", "2", "--cylinder", "--format", "json", "--svg", svg});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  EXPECT_EQ(json.at("model"), "cylinder");
  ASSERT_EQ(json.at("rows").size(), 3u * 8);
  for (const auto& row : json.at("rows")) expect_consistent(row);
  for (const char* valves : {"three_way", "seven_mode", "two_way"}) EXPECT_THAT(run.err, HasSubstr(valves));
  const std::string figure = test::text_of(svg);
  for (const char* label : {"4 states (three_way)", "9 states (two_way)", "in 0.25 ms"})
    EXPECT_THAT(figure, HasSubstr(label));
}

TEST(ScalingCommand, RefusesWhatItCannotDoInOneLine) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"--instances", "0"}, {"--format", "xml"}, {"--instances", "many"}}) {
    std::vector<std::string> all = {"scaling"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const test::ProgramRun run = test::run_program(all);
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_EQ(run.out, "");
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1);
  }
}

TEST(ScalingStudy, KeepsOnlyFinishedRowsWhenStopped) {
  int asked = 0;
  const auto rows = study_actuator_scaling(
      {.instances = 2}, false, [](const std::string&) {}, [&] { return ++asked > 5; });
  ASSERT_EQ(rows.size(), 2u);  // two solves a row: the third row is stopped in its middle
  EXPECT_EQ(rows.back().periods, scaling_blocks(2));
}

TEST(ScalingStudy, OfOtherSystemsGrowsTheHorizonWithTheBlocks) {
  const System* system = find_system("inverter");
  const auto rows = study_scaling(
      {.system = system, .instances = 3}, [](const std::string&) {}, [] { return false; });
  ASSERT_EQ(rows.size(), 2u * most_blocks);
  EXPECT_EQ(rows[0].mode_set, "three_level");
  EXPECT_EQ(rows[0].states, 27);
  EXPECT_EQ(rows[4].periods, std::vector<int>(5, 1));
  EXPECT_EQ(rows[most_blocks].mode_set, "two_level");
  for (const ScalingRow& row : rows) {
    EXPECT_EQ(row.cold.proven, 1.0);
    EXPECT_GT(row.warm.nodes_p50, 0);
    if (row.periods.size() > 2) {
      EXPECT_LT(row.warm.nodes_p50, row.full_tree);
    }
  }
}

}  // namespace
}  // namespace solenoid
