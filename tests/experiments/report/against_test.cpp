#include "experiments/report/against.hpp"

#include "core/config/reader.hpp"
#include "experiments/report/comparison.hpp"
#include "experiments/report/headings.hpp"
#include "experiments/report/merge.hpp"
#include "experiments/report/paired.hpp"
#include "experiments/report/report_data.hpp"
#include "tests/experiments/judged_runs.hpp"
#include "tests/experiments/program_under_test.hpp"
#include "tests/experiments/synthetic_runs.hpp"

#include <cmath>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>

namespace solenoid {
namespace {

using test::judged_run;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

std::optional<Against> against_of(const std::vector<RunRecord>& records, const std::string& baseline) {
  const RunTable runs = tables_of(records).front();
  return against(runs, rank_variants(runs), baseline);
}

/// Three variants in `scenarios` scenarios, log-normal; the first is the best by far.
std::vector<RunRecord> three_variants(int scenarios) {
  std::mt19937_64 random(21);
  std::lognormal_distribution<double> spread(0.0, 0.2);
  std::vector<std::vector<double>> errors(3);
  for (int s = 0; s < scenarios; ++s)
    for (std::size_t v = 0; v < 3; ++v) errors[v].push_back((v == 0 ? 0.1 : 1.0) * spread(random));
  return test::judged_runs(errors);
}

TEST(Against, RatiosAreOfTheSameScenarioAndSeed) {
  const std::vector<RunRecord> records = {judged_run("base", "a", 1, 1.0),   judged_run("base", "a", 2, 10.0),
                                          judged_run("base", "b", 1, 100.0), judged_run("base", "b", 2, -1.0),
                                          judged_run("mine", "a", 1, 2.0),   judged_run("mine", "a", 2, 4.0),
                                          judged_run("mine", "b", 1, 200.0), judged_run("mine", "b", 2, 7.0)};
  const auto found = against_of(records, "base");
  ASSERT_TRUE(found.has_value());
  const Json rows = found->table.json();
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_NEAR(rows[0].at("ratio").get<double>(), std::exp((2 * std::log(2.0) + std::log(0.4)) / 3), 1e-12);
  EXPECT_NEAR(rows[0].at("better").get<double>(), 1.0 / 3, 1e-12);
  EXPECT_EQ(rows[0].at("tasks"), 3);
  EXPECT_EQ(rows[0].at("lost"), 0);
  EXPECT_EQ(rows[0].at("baseline_lost"), 1);
  EXPECT_THAT(found->table.title, HasSubstr("base"));
  EXPECT_THAT(against_of(records, "")->table.title, HasSubstr("mine"));  // the better one
}

TEST(Against, OneRunHasNoIntervalAndNoVerdict) {
  const std::vector<RunRecord> one = {judged_run("base", "a", 1, 1.0), judged_run("mine", "a", 1, 2.0),
                                      judged_run("never", "a", 1, -1.0)};
  const auto found = against_of(one, "base");
  ASSERT_TRUE(found.has_value());
  EXPECT_FALSE(found->several_tasks);
  const Json rows = found->table.json();
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].at("ratio"), 2.0);
  for (const char* key : {"low", "high", "own_low", "own_high", "p", "verdict"}) {
    EXPECT_TRUE(rows[0].at(key).is_null()) << key;
    EXPECT_TRUE(rows[1].at(key).is_null()) << key;
  }
  EXPECT_TRUE(rows[1].at("ratio").is_null());
  EXPECT_EQ(rows[1].at("lost"), 1);
  EXPECT_FALSE(against_of({one[0]}, "base").has_value());
  EXPECT_THROW(against_of(one, "nobody"), ConfigError);
  EXPECT_THROW(against_of({one[0]}, "nobody"), ConfigError);
}

TEST(Against, ABaselineThatTheErrorsChoseIsCorrectedOverAllPairs) {
  const std::vector<RunRecord> records = three_variants(30);
  const Json chosen = against_of(records, "")->json, named = against_of(records, "v0")->json;
  EXPECT_EQ(chosen.at("baseline"), "v0");
  EXPECT_EQ(chosen.at("chosen"), "ranked first");
  EXPECT_EQ(named.at("chosen"), "named");
  EXPECT_EQ(chosen.at("comparisons"), 3);
  EXPECT_EQ(named.at("comparisons"), 2);
  EXPECT_EQ(chosen.at("matrix"), named.at("matrix"));
  EXPECT_EQ(chosen.at("matrix").size(), 6u);
  for (std::size_t i = 0; i < 2; ++i) {
    const Json &wide = chosen.at("variants")[i], &narrow = named.at("variants")[i];
    EXPECT_EQ(wide.at("variant"), narrow.at("variant"));
    EXPECT_EQ(wide.at("ratio"), narrow.at("ratio"));
    EXPECT_EQ(wide.at("own_low"), narrow.at("own_low"));
    EXPECT_LT(wide.at("low"), narrow.at("low"));
    EXPECT_LT(narrow.at("low"), narrow.at("own_low"));
    EXPECT_EQ(wide.at("verdict"), "worse");
    Json of_matrix = wide;
    of_matrix["baseline"] = "v0";
    EXPECT_EQ(std::ranges::count_if(chosen.at("matrix"),
                                    [&](const Json& row) { return nlohmann::json(row) == nlohmann::json(of_matrix); }),
              1);
  }
}

TEST(Against, ATableSaysBetterAndWorseAsItsNumbersDo) {
  const Result result = result_of(three_variants(30), false, "v1");
  const std::string text = result.text(false);
  const Json row = result.facts.at("paired")[0].at("variants")[0];
  EXPECT_EQ(row.at("variant"), "v0");
  std::istringstream lines(text.substr(text.find("divided by that of v1")));
  std::string line;
  for (int i = 0; i < 3; ++i) std::getline(lines, line);
  std::istringstream words(line);
  std::vector<std::string> shown;
  for (std::string word; words >> word;) shown.push_back(word);
  EXPECT_THAT(shown,
              ElementsAre("v0", fmt::format("{:.4f}", row.at("ratio").get<double>()),
                          fmt::format("{:.4f}", row.at("low").get<double>()),
                          fmt::format("{:.4f}", row.at("high").get<double>()), "100.0", "30", "0", "0", "better"));
  EXPECT_THAT(text, HasSubstr("of all 2 comparisons together, from 10000 resamples of the 30 scenarios"));
  EXPECT_THAT(result.csv(),
              HasSubstr("variant,ratio,own_low,own_high,low,high,p,better,tasks,lost,baseline_lost,verdict"));
}

TEST(Against, APairWithoutAVerdictIsNoneOfThoseCorrectedTogether) {
  std::vector<RunRecord> records = three_variants(30);
  for (std::size_t i = 2; i < records.size(); i += 3)  // v2 is v1, but in the first scenario
    if (i > 2) records[i].metrics = records[i - 1].metrics;
  const Result all = result_of(records, false), named = result_of(records, false, "v1");
  EXPECT_THAT(all.text(false), HasSubstr("of 2 of 3 pairs of variants together"));
  EXPECT_THAT(named.text(false), HasSubstr("of 1 of 2 comparisons together"));
  for (const Result& found : {all, named}) {
    EXPECT_THAT(found.text(false), HasSubstr("The others have no verdict, which takes 5 scenarios"));
    const Json paired = found.facts.at("paired")[0];
    std::size_t verdicts = 0;
    for (const Json& row : paired.at("matrix")) {
      EXPECT_EQ(row.at("verdict").is_string(), row.at("variant") == "v0" || row.at("baseline") == "v0");
      verdicts += row.at("verdict").is_string();
    }
    EXPECT_EQ(verdicts, 4u);
  }
}

TEST(Against, OneTaskIsNoTableUnlessItIsAskedFor) {
  const std::vector<RunRecord> one = {judged_run("base", "a", 1, 1.0), judged_run("mine", "a", 1, 2.0)};
  EXPECT_THAT(result_of(one, false).text(false), Not(HasSubstr("divided by")));
  EXPECT_THAT(result_of(one, false, "mine").text(false), HasSubstr("divided by that of mine"));
  EXPECT_EQ(result_of(one, false).facts.at("paired")[0].at("variants")[0].at("ratio"), 2.0);
  EXPECT_FALSE(result_of(std::vector{one[0]}, false).facts.contains("paired"));
}

TEST(Against, OfVeryManyVariantsABaselineWantsAName) {
  constexpr std::size_t variants = PairedVariants::most_variants + 1;
  std::mt19937_64 random(22);
  std::lognormal_distribution<double> spread(0.0, 0.2);
  std::vector<std::vector<double>> errors(variants, std::vector<double>(6));
  for (std::vector<double>& own : errors)
    for (double& error : own) error = spread(random);
  const std::vector<RunRecord> records = test::judged_runs(errors);
  for (const char* baseline : {"", "v7"}) {
    const bool named = *baseline != 0;
    const Result result = result_of(records, false, baseline);
    const Json paired = result.facts.at("paired")[0];
    EXPECT_EQ(paired.at("comparisons"), named ? variants - 1 : 0);
    EXPECT_EQ(paired.at("variants").size(), variants - 1);
    EXPECT_EQ(paired.at("matrix").size(), variants - 1);
    for (const Json& row : paired.at("matrix")) EXPECT_EQ(row.at("baseline"), paired.at("baseline"));
    for (const Json& row : paired.at("variants")) {
      EXPECT_TRUE(row.at("own_low").is_number());
      EXPECT_EQ(row.at("low").is_number(), named);
      EXPECT_EQ(row.at("verdict").is_string(), named);
    }
    EXPECT_THAT(result.text(false), HasSubstr(named ? "of all 40 comparisons together"
                                                    : "the best ranked of more than 40 variants is not corrected for"));
  }
}

TEST(Against, TextDataAndReportAgree) {
  const test::Folder folder;
  const Campaign campaign = test::synthetic_campaign({"thesis_pd", "nine_state", "thesis_cylinder"}, 60);
  test::write_synthetic(campaign, folder.file("r"), 2);
  merge(folder.file("r"), false);
  Results results = read_results(folder.file("r"));
  const Json page = report_json(results, {}, false).at("rankings")[0].at("paired");
  Json of_compare = result_of(*results.table()).facts.at("paired")[0];
  EXPECT_EQ(of_compare.at("system"), campaign.system->description().name);
  of_compare.erase("system");
  EXPECT_EQ(page, of_compare);
  EXPECT_EQ(page.at("profiles").size(), 3u);
  EXPECT_EQ(page.at("profiles")[0].at("variant"), page.at("baseline"));
  const std::string text = result_of(*results.table()).text(false);
  for (const Json& row : page.at("variants"))
    for (const char* key : {"ratio", "low", "high"})
      EXPECT_THAT(text, HasSubstr(fmt::format("{:.4f}", row.at(key).get<double>()))) << key;
  results.manifest["status"] = "running";
  EXPECT_FALSE(report_json(results, {}, true).at("rankings")[0].contains("paired")) << "not while runs come in";
}

TEST(Against, IsAnOptionOfCompare) {
  const test::Folder folder;
  folder.write("c.toml", test::small_campaign);
  const std::string compare = "compare c.toml --out r ";
  const test::ProgramRun plain = test::run_program(folder, compare);
  ASSERT_EQ(plain.exit_code, 0) << plain.err;
  EXPECT_THAT(plain.out, HasSubstr("in the same scenario and seed"));
  const test::ProgramRun named = test::run_program(folder, compare + "--against nine_pd");
  EXPECT_THAT(named.out, HasSubstr("divided by that of nine_pd"));
  const test::ProgramRun csv = test::run_program(folder, compare + "--against nine_pd --format csv");
  EXPECT_THAT(csv.out, testing::StartsWith("variant,ratio,"));
  EXPECT_THAT(csv.out, HasSubstr("\nthesis_cylinder,"));
  const test::ProgramRun json = test::run_program(folder, compare + "--against nine_pd --format json");
  EXPECT_EQ(Json::parse(json.out).at("paired")[0].at("baseline"), "nine_pd");
  const test::ProgramRun unknown = test::run_program(folder, "compare c.toml --out new --against nobody");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("--against: 'nobody' is not compared (allowed: thesis_cylinder, nine_pd)"));
  EXPECT_FALSE(std::filesystem::exists(folder / "new")) << "it is told before anything runs";
  const test::ProgramRun shard = test::run_program(folder, "compare c.toml --out new --shard 1/2 --against nine_pd");
  EXPECT_EQ(shard.exit_code, 2);
  EXPECT_THAT(shard.err, HasSubstr("--against"));
  const test::ProgramRun alone =
      test::run_program(folder, "compare c.toml --variant nine_pd --against nine_pd --out n");
  EXPECT_THAT(alone.err, HasSubstr("--against: one variant alone"));
  const std::filesystem::path runs = folder / "r/runs.csv", page = folder / "r/report.html";
  std::filesystem::remove(runs);
  const test::ProgramRun merged = test::run_program(folder, "merge r --against nobody");
  EXPECT_EQ(merged.exit_code, 2);
  EXPECT_THAT(merged.err, HasSubstr("--against: 'nobody' is not compared (allowed: thesis_cylinder, nine_pd)"));
  EXPECT_FALSE(std::filesystem::exists(runs) || std::filesystem::exists(page)) << "it is told before anything is made";
  EXPECT_THAT(test::run_program(folder, "merge r --no-report --against nine_pd").out,
              HasSubstr("divided by that of nine_pd"));
}

}  // namespace
}  // namespace solenoid
