#include "tests/experiments/program_under_test.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using test::Folder;
using test::ProgramRun;
using test::run_program;
using testing::HasSubstr;

TEST(IdentifyCommand, WritesTableParametersEstimatesAndRecords) {
  const Folder folder;
  const ProgramRun run =
      run_program(folder, "identify --twin study --only charge,edges,shuttle --out found --records --no-figures");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("energise_delay_s"));
  EXPECT_THAT(run.out, HasSubstr("solenoid compare --model found/parameters.toml"));
  EXPECT_THAT(test::text_of(folder / "found/parameters.toml"), HasSubstr("fill_coefficient = "));
  const auto rows = test::read_csv(test::text_of(folder / "found/estimates.csv"));
  EXPECT_EQ(rows.at(0).at("name"), "fill_coefficient");
  // The same from the records it kept, to the last digit.
  const ProgramRun again = run_program(folder,
                                       "identify --log found/records/charge.csv --log found/records/edges.csv --log "
                                       "found/records/shuttle.csv --out again --no-figures --format json");
  ASSERT_EQ(again.exit_code, 0) << again.err;
  const auto json = nlohmann::json::parse(again.out);
  EXPECT_EQ(json.at("estimates").at(0).at("value").get<double>(), std::stod(rows.at(0).at("value")));
}

TEST(IdentifyCommand, SaysWhatTheThesissTablesTell) {
  const Folder folder;
  const ProgramRun run = run_program(folder, "identify --thesis");
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_THAT(run.out, HasSubstr("F_sf = 1.45 N"));
  EXPECT_THAT(run.out, HasSubstr("Table 4-2 does not determine C_vf"));
}

TEST(IdentifyCommand, RefusesByName) {
  const Folder folder;
  const auto complaint = [&](const std::string& arguments) { return test::refusal_of(folder, arguments); };
  EXPECT_THAT(complaint("identify --only shake"), HasSubstr("breakaway"));
  EXPECT_THAT(complaint("identify --base mine"), HasSubstr("consistent"));
  EXPECT_THAT(complaint("identify --mismatch friction=-1"), HasSubstr("friction"));
  EXPECT_THAT(complaint("identify --mismatch weight=2"), HasSubstr("weight"));
  EXPECT_THAT(complaint("identify --log none.mcap"), HasSubstr("none.mcap"));
  folder.write("junk.mcap", "no log");
  EXPECT_THAT(complaint("identify --log junk.mcap"), HasSubstr("junk.mcap"));
  EXPECT_THAT(complaint("identify --log none.csv --column y"), HasSubstr("none.csv"));
  EXPECT_THAT(complaint("compare --model none.toml"), HasSubstr("none.toml"));
  EXPECT_THAT(complaint("compare --model better"), HasSubstr("consistent"));
}

/// RMSE of the best variant in a comparison's CSV: the least geometric mean over its runs.
double best_rmse_mm(const std::string& csv) {
  std::map<std::string, std::pair<double, int>> sums;
  for (const auto& row : test::read_csv(csv)) {
    EXPECT_EQ(row.at("status"), "ok");
    auto& [sum, count] = sums[row.at("variant")];
    sum += std::log(std::stod(row.at("rmse_mm")));
    ++count;
  }
  double best = 1e9;
  for (const auto& [name, s] : sums) best = std::min(best, std::exp(s.first / s.second));
  return best;
}

/// A mismatched plant is identified, its file written, and compared with.
TEST(IdentifyCommand, ItsParametersMakeTheBestVariantOfAMismatchedTwinBetter) {
  const Folder folder;
  const std::string campaign = SOLENOID_SOURCE_DIR "/experiments/systems/actuator/data/tried/identified.toml";
  const ProgramRun found = run_program(
      folder, "identify --mismatch friction=1.5,flow=0.8,supply=0.9,delay=1.4,inertia=1.2 --out found --no-figures");
  ASSERT_EQ(found.exit_code, 0) << found.err;
  const ProgramRun before = run_program(
      folder, "compare '" + campaign + "' --variant nine_robust,nine_robust_calm --out before --format csv");
  ASSERT_EQ(before.exit_code, 0) << before.err;
  const ProgramRun after =
      run_program(folder, "compare '" + campaign +
                              "' --variant nine_robust,nine_robust_calm --model found/parameters.toml --out after "
                              "--format csv");
  ASSERT_EQ(after.exit_code, 0) << after.err;
  EXPECT_GT(best_rmse_mm(before.out) / best_rmse_mm(after.out), 1.25);  // docs/how-to/identification.md: 1.44
  // The results folder is whole without the file: it was carried along.
  EXPECT_THAT(test::text_of(folder / "after/resolved.toml"), HasSubstr("inputs/parameters-"));
}

}  // namespace
}  // namespace solenoid
