#include "experiments/study/fishing.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <filesystem>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

TEST(FishingStudy, RoundingFallsToThePublishedRelaxedOptimumAndTwoSwitchesReachTheirs) {
  const auto study = study_fishing(
      {24, 96, 192, 384}, [](const std::string&) {}, [] { return false; });
  ASSERT_EQ(study.rows.size(), 4u);
  double before = 1e300;
  for (const FishingRow& row : study.rows) {
    EXPECT_LE(row.sum_up_gap, row.guarantee * (1 + 1e-12));
    EXPECT_LE(row.approximated_gap, row.sum_up_gap + 1e-12);
    EXPECT_GT(row.sum_up, fishing_published_relaxed);
    EXPECT_LE(row.relaxed, row.sum_up);
    EXPECT_LE(row.improved, row.sum_up + 1e-9);
    EXPECT_LT(row.sum_up, before);  // of these grids, each cut in whole parts of the one before
    before = row.sum_up;
  }
  EXPECT_NEAR(study.rows.back().relaxed, fishing_published_relaxed, 1e-5);
  EXPECT_LT(study.rows.back().sum_up - fishing_published_relaxed, 5e-4);
  EXPECT_GT(study.order, 1.0);  // no slower than the theory's linear fall
  EXPECT_LE(study.two.refined, fishing_published_two_switches);
  EXPECT_GT(study.two.refined, fishing_published_two_switches - 1e-4);
  EXPECT_EQ(study.two.gap, study.two.gap_bound);
}

TEST(FishingStudy, CommandPrintsEveryFormatAndDraws) {
  const test::Folder folder;
  const std::string svg = folder / "fishing.svg";
  const auto json = test::run_program({"study", "fishing", "--intervals", "12,24", "--format", "json", "--svg", svg});
  EXPECT_EQ(json.exit_code, 0) << json.err;
  EXPECT_EQ(nlohmann::json::parse(json.out)["rows"].size(), 2u);
  EXPECT_GT(std::filesystem::file_size(svg), 1000u);
  EXPECT_NE(test::run_program({"study", "fishing", "--intervals", "12"}).out.find("sum-up"), std::string::npos);
  EXPECT_EQ(test::run_program({"study", "fishing", "--intervals", "13"}).exit_code, 2);
  EXPECT_EQ(test::run_program({"study"}).exit_code, 2);
}

}  // namespace
}  // namespace solenoid
