#include "experiments/campaign/campaign.hpp"

#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/reader.hpp"
#include "experiments/report/ranking.hpp"
#include "tests/experiments/program_under_test.hpp"
#include "tests/support/actuator_metrics.hpp"

#include <cmath>
#include <set>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid::test {
namespace {

using testing::HasSubstr;

constexpr const char* a_sine = "[[scenario]]\nname = \"s\"\ntrajectory = { kind = \"sine\" }\n";

TEST(Campaign, RunsAreTheProductInCanonicalOrder) {
  Folder folder;
  const Campaign campaign = read_campaign(folder.write("c.toml", small_campaign));
  EXPECT_EQ(campaign.name, "c");
  std::vector<std::string> ids;
  std::set<std::string> hashes;
  for (const CampaignRun& run : campaign.runs) {
    ids.push_back(run.id);
    hashes.insert(run.hash);
  }
  EXPECT_THAT(ids, testing::ElementsAre("step--thesis_cylinder--s3", "step--thesis_cylinder--s4", "step--nine_pd--s3",
                                        "step--nine_pd--s4", "loaded--thesis_cylinder--s3",
                                        "loaded--thesis_cylinder--s4", "loaded--nine_pd--s3", "loaded--nine_pd--s4"));
  EXPECT_EQ(hashes.size(), 8u);
}

TEST(Campaign, OwnVariantsOverrideIncludedAndShippedOnes) {
  Folder folder;
  std::filesystem::create_directory(folder.file("sub"));
  folder.write("sub/base.toml", std::string("variants = [\"a\", \"thesis_pd\"]\nseeds = [7]\n") +
                                    "[variant.a]\nvalves = \"two_way\"\n[variant.b]\nvalves = \"seven_mode\"\n" +
                                    a_sine);
  const Campaign campaign = read_campaign(
      folder.write("c.toml",
                   "include = [\"sub/base.toml\"]\n[variant.a]\nvalves = \"three_mode\"\n[variant.thesis_pd]\nmotor = "
                   "\"inverse_dynamics\"\n"));
  ASSERT_EQ(campaign.variants.size(), 2u);
  EXPECT_EQ(campaign.variants[0].modes, "three_mode");
  EXPECT_EQ(actuator(campaign.variants[1]).motor, "inverse_dynamics");
  EXPECT_EQ(campaign.seeds, std::vector<std::uint64_t>{7});
  EXPECT_EQ(campaign.scenarios.size(), 1u);
}

TEST(Campaign, AShippedFileIsIncludedByNameWhereThereIsNoOther) {
  Folder folder;
  const Campaign campaign =
      read_campaign(folder.write("c.toml", "include = [\"default.toml\"]\nvariants = [\"nine_id\"]\nseeds = [2]\n"));
  EXPECT_EQ(campaign.scenarios.size(), 6u);
  ASSERT_EQ(campaign.variants.size(), 1u);
  EXPECT_EQ(campaign.variants[0].name, "nine_id");
}

TEST(Campaign, TwoIncludedFilesMayNotDefineOneVariant) {
  Folder folder;
  folder.write("one.toml", "[variant.a]\n");
  folder.write("two.toml", "[variant.a]\n");
  folder.write("c.toml", std::string("include = [\"one.toml\", \"two.toml\"]\nvariants = [\"a\"]\n") + a_sine);
  try {
    read_campaign(folder.file("c.toml"));
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("two.toml:1"));
    EXPECT_THAT(error.what(), HasSubstr("one.toml:1"));
    EXPECT_THAT(error.what(), HasSubstr("twice"));
  }
}

TEST(Campaign, ShippedFilesAreKnownByNameAndRead) {
  const Campaign campaign = read_campaign("default");
  ASSERT_GE(campaign.variants.size(), 6u);
  EXPECT_EQ(campaign.variants.front().name, "thesis_cylinder");
  EXPECT_EQ(campaign.runs.size(), 6 * campaign.variants.size());
  for (const std::string& name : shipped_campaigns()) EXPECT_NO_THROW(read_campaign(name)) << name;
  EXPECT_EQ(actuator(shipped_variant("thesis_pd")).motor, "pd");
  EXPECT_THROW(shipped_variant("none"), ConfigError);
  for (const VariantConfig& variant : shipped_variants()) EXPECT_FALSE(variant.summary.empty()) << variant.name;
}

TEST(Campaign, HashFollowsWhatTheResultDependsOn) {
  Folder folder;
  const auto hash = [&](const std::string& variant, const std::string& points) {
    folder.write("p.csv", points);
    folder.write("c.toml", "variants = [\"a\"]\n[variant.a]\n" + variant +
                               "[[scenario]]\nname = \"s\"\ntrajectory = { kind = \"csv\", path = \"p.csv\" }\n");
    return read_campaign(folder.file("c.toml")).runs.at(0).hash;
  };
  const std::string points = "t,y\n0,0.02\n1,0.03\n", moved = "t,y\n0,0.02\n1,0.031\n";
  const std::string first = hash("motor = \"pd\"\nsolver = \"exhaustive\"\n", points);
  EXPECT_EQ(first, hash("# reordered\nsolver = \"exhaustive\"\nmotor = \"pd\"\n", points));
  EXPECT_NE(first, hash("motor = \"none\"\nsolver = \"exhaustive\"\n", points));
  EXPECT_NE(first, hash("motor = \"pd\"\nsolver = \"exhaustive\"\n", moved));
}

RunRecord record(const std::string& variant, const std::string& scenario, double rmse_mm) {
  RunRecord r{variant, scenario, "sine", {0.0}, 1, "ok", {}};
  Metrics m = no_metrics();
  m["rmse_mm"] = rmse_mm;
  if (rmse_mm > 0)
    r.metrics = m;
  else
    r.status = "failed: worker ended by signal 11";
  return r;
}

TEST(RunRecord, SurvivesJsonAndCsv) {
  Campaign campaign = read_campaign("default");
  Metrics m = no_metrics();
  m["rmse_mm"] = 0.1 + 0.2;
  m["coil_switches"] = 12;
  m.solve_us.p999 = 1.0 / 3.0;
  const RunRecord ok = record_of(campaign, campaign.runs[5], m);
  const RunRecord back = record_from_json(nlohmann::ordered_json::parse(to_json(ok).dump()), "a.json");
  EXPECT_EQ(back.metrics->number("rmse_mm"), 0.1 + 0.2);
  EXPECT_EQ(back.metrics->solve_us.p999, 1.0 / 3.0);
  EXPECT_EQ(to_csv(std::vector{back}), to_csv(std::vector{ok}));
  EXPECT_THAT(to_csv(std::vector{ok}), HasSubstr("0.30000000000000004"));
}

TEST(RunRecord, ThatIsNoneIsRefusedWithFileAndKey) {
  Campaign campaign = read_campaign("default");
  const nlohmann::ordered_json whole = to_json(record_of(campaign, campaign.runs[5], no_metrics()));
  const auto refused = [](const nlohmann::ordered_json& json) {
    try {
      record_from_json(json, "a.json");
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("nothing");
  };
  EXPECT_EQ(refused(whole), "nothing");
  for (const auto& no_record : {nlohmann::ordered_json(), nlohmann::ordered_json(3), nlohmann::ordered_json::array()})
    EXPECT_THAT(refused(no_record), HasSubstr("a.json: key 'run.variant': missing (allowed: "));
  for (const auto& [key, value] : whole.items()) {
    auto other = whole;
    other[key] = nlohmann::ordered_json::array();
    EXPECT_THAT(refused(other), HasSubstr("a.json: key 'run." + key)) << key;
  }
  auto negative = whole;
  negative["seed"] = -1;
  EXPECT_THAT(refused(negative), HasSubstr("a.json: key 'run.seed': refused (allowed: 0 to"));
}

TEST(RunRecord, UnstableAndFailedRunsHaveAStatusAndNoMetrics) {
  Campaign campaign = read_campaign("default");
  Metrics wild, infinite;
  wild.finite = false;
  infinite["itae"] = std::numeric_limits<double>::infinity();
  const RunRecord failed = failed_record(campaign, campaign.runs[0], "no, \"never\"");
  EXPECT_EQ(record_of(campaign, campaign.runs[0], wild).status, "unstable");
  EXPECT_EQ(record_of(campaign, campaign.runs[0], infinite).status, "unstable");
  EXPECT_EQ(failed.status, "failed: no, \"never\"");
  const auto json = to_json(failed);
  EXPECT_FALSE(json.contains("rmse_mm"));
  EXPECT_FALSE(json.contains("solve_us"));
  EXPECT_THAT(to_csv(std::vector{failed}), HasSubstr(",\"failed: no, \"\"never\"\"\"\n"));
}

TEST(Ranking, GeometricMeanOverScenariosThatAllRankedVariantsFinished) {
  const std::vector<RunRecord> runs = {record("a", "x", 1), record("a", "y", 4),  record("a", "z", 100),
                                       record("b", "x", 2), record("b", "y", 18), record("b", "z", 0),
                                       record("c", "x", 0), record("c", "y", 0),  record("c", "z", 0.1)};
  const Ranking ranking = rank_variants(runs);
  EXPECT_EQ(ranking.common_scenarios, 2u);
  EXPECT_EQ(ranking.scenarios, 3u);
  ASSERT_EQ(ranking.variants.size(), 3u);
  EXPECT_EQ(ranking.variants[0].variant, "a");
  EXPECT_DOUBLE_EQ(ranking.variants[0].error, 2.0);  // sqrt(1 * 4)
  EXPECT_DOUBLE_EQ(ranking.variants[0].worst, 4.0);
  EXPECT_DOUBLE_EQ(ranking.variants[1].error, 6.0);  // sqrt(2 * 18)
  EXPECT_EQ(ranking.variants[1].failed, 1);
  EXPECT_EQ(ranking.variants[2].variant, "c");
  EXPECT_FALSE(ranking.variants[2].ranked);
}

TEST(Ranking, OfNothingIsEmpty) {
  EXPECT_TRUE(rank_variants({}).variants.empty());
  const std::vector<RunRecord> failed = {record("a", "x", 0)};
  EXPECT_FALSE(rank_variants(failed).variants.at(0).ranked);
}

}  // namespace
}  // namespace solenoid::test
