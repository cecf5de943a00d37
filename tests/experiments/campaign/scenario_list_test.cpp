#include "experiments/campaign/scenario_list.hpp"

#include "core/config/document.hpp"
#include "core/config/reader.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/ensemble.hpp"
#include "experiments/campaign/run_record.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <algorithm>
#include <set>
#include <stdexcept>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace solenoid::test {
namespace {

using testing::HasSubstr;

/// Scenarios "one", as many as `members` says of "many", and "last", with two variants and two seeds.
std::string text_with(const std::string& members, const std::string& more = "") {
  return fmt::format(R"(
variants = ["thesis_pd", "thesis_id"]
seeds = [5, 3]
[[scenario]]
name = "one"
trajectory = {{ kind = "cycloidal" }}
[[scenario]]
name = "many"
trajectory = {{ kind = "sine" }}
plant = "twin"
noise = true
ensemble = {{ {}, seed = 3, payload_kg = [0.0, 0.2], friction = [0.5, 2.0], noise_factor = [0.5, 2.0] }}
[[scenario]]
name = "last"
trajectory = {{ kind = "sine" }}
{})",
                     members, more);
}

Campaign campaign_of(const std::string& text, const std::vector<std::string>& scenarios = {}) {
  return read_campaign(Document::from_text(text, "c.toml"), {{}, scenarios});
}

std::string refusal(const std::string& text, const std::vector<std::string>& scenarios = {}) {
  try {
    campaign_of(text, scenarios);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

std::set<std::string> hashes_of(const Campaign& campaign) {
  std::set<std::string> hashes;
  for (const CampaignRun& run : campaign.runs) hashes.insert(run.hash);
  return hashes;
}

TEST(ScenarioList, NamesFindsAndReadsItsScenariosInTheirOrder) {
  const ScenarioList scenarios = campaign_of(text_with("members = 12, sampling = \"sobol\"")).scenarios;
  ASSERT_EQ(scenarios.size(), 14u);
  EXPECT_EQ(scenarios.tasks(), (std::vector<std::string>{"one", "many", "last"}));
  std::size_t i = 0;
  for (const ScenarioConfig& s : scenarios) {
    EXPECT_EQ(s.name, i == 0 ? "one" : i == 13 ? "last" : fmt::format("many-m{:03}", i));
    EXPECT_EQ(scenarios.name(i), s.name);
    EXPECT_EQ(scenarios[i].name, s.name);
    EXPECT_EQ(scenarios.find(s.name), i);
    EXPECT_EQ((*std::ranges::find(scenarios, s.name, &ScenarioConfig::name)).name, s.name);
    ++i;
  }
  EXPECT_EQ(i, scenarios.size());
  for (const char* unknown : {"many", "many-m000", "many-m013", "many-m0001", "many-m1", "many-m01x", "one-m001",
                              "-m001", "many-m99999999999999999999", ""})
    EXPECT_FALSE(scenarios.find(unknown)) << unknown;
  EXPECT_THROW(static_cast<void>(scenarios.at(14)), std::out_of_range);
  EXPECT_THROW(static_cast<void>(ScenarioList().front()), std::out_of_range);
}

TEST(RunList, CrossesByScenarioThenVariantThenSeed) {
  const Campaign campaign = campaign_of(text_with("members = 12, sampling = \"latin_hypercube\""));
  ASSERT_EQ(campaign.runs.size(), 14u * 2 * 2);
  std::size_t i = 0;
  for (std::size_t s = 0; s < campaign.scenarios.size(); ++s)
    for (std::size_t v = 0; v < 2; ++v)
      for (const std::uint64_t seed : {std::uint64_t{5}, std::uint64_t{3}}) {
        const CampaignRun run = campaign.runs[i];
        EXPECT_EQ(run.scenario, s);
        EXPECT_EQ(run.variant, v);
        EXPECT_EQ(run.seed, seed);
        EXPECT_EQ(run.id, run_id(campaign.scenarios.name(s), campaign.variants[v].name, seed));
        EXPECT_EQ(campaign.runs.find(campaign.scenarios.name(s), campaign.variants[v].name, seed), i);
        ++i;
      }
  EXPECT_EQ(hashes_of(campaign).size(), campaign.runs.size()) << "no two runs are the same";
  EXPECT_FALSE(campaign.runs.find("many", "thesis_pd", 5));
  EXPECT_FALSE(campaign.runs.find("one", "nine_pd", 5));
  EXPECT_FALSE(campaign.runs.find("one", "thesis_pd", 4));
  EXPECT_THROW(static_cast<void>(campaign.runs.at(i)), std::out_of_range);
}

TEST(Ensemble, GrowsWithoutAnotherMemberIfItIsOfSobol) {
  for (const bool sobol : {true, false}) {
    const std::string sampling = fmt::format(", sampling = \"{}\"", sobol ? "sobol" : "latin_hypercube");
    const Campaign few = campaign_of(text_with("members = 10" + sampling)),
                   more = campaign_of(text_with("members = 25" + sampling));
    const std::set<std::string> then = hashes_of(more);
    for (const CampaignRun& run : few.runs) {
      const bool drawn = few.scenarios.name(run.scenario).starts_with("many");
      EXPECT_EQ(then.contains(run.hash), sobol || !drawn) << run.id;
    }
    EXPECT_EQ(few.scenarios[3].name, more.scenarios[3].name);
    EXPECT_EQ(actuator(few.scenarios[3]).mismatch == actuator(more.scenarios[3]).mismatch, sobol);
  }
}

TEST(Ensemble, OfAMillionIsNotWrittenOut) {
  const Campaign campaign = campaign_of(text_with("members = 1000000, sampling = \"sobol\""));
  ASSERT_EQ(campaign.scenarios.size(), 1000002u);
  EXPECT_EQ(campaign.runs.size(), 4000008u);
  EXPECT_LT(campaign.resolved_toml.size(), 4000u);
  EXPECT_EQ(campaign.scenarios.name(999999), "many-m999999");
  const ScenarioConfig last = campaign.scenarios[1000000];
  EXPECT_EQ(last.name, "many-m1000000");
  EXPECT_EQ(campaign.scenarios.find(last.name), 1000000u);
  EXPECT_EQ(ensemble_name(last.name), "many");
  EXPECT_GE(actuator(last).payload_kg, 0.0);
  EXPECT_LE(actuator(last).payload_kg, 0.2);
  EXPECT_GE(actuator(last).mismatch.friction, 0.5);
  EXPECT_LE(actuator(last).mismatch.friction, 2.0);
  EXPECT_EQ(campaign.runs[4000003].id, "many-m1000000--thesis_id--s3");
  EXPECT_EQ(campaign.scenarios[1000001].name, "last");
  const Campaign again = campaign_of(campaign.resolved_toml);
  EXPECT_EQ(again.runs[2345678].hash, campaign.runs[2345678].hash);
  EXPECT_EQ(again.resolved_toml, campaign.resolved_toml);
}

TEST(Ensemble, MembersAreSelectedOneByOne) {
  for (const char* sampling : {"sobol", "latin_hypercube", "shuffled"}) {
    const std::string text = text_with(fmt::format("members = 40, sampling = \"{}\"", sampling));
    const Campaign whole = campaign_of(text), some = campaign_of(text, {"many-m017", "last", "many-m003"});
    EXPECT_EQ(some.scenarios.tasks(), (std::vector<std::string>{"many-m003", "many-m017", "last"}))
        << "canonical order";
    EXPECT_THAT(some.resolved_toml, testing::Not(HasSubstr("ensemble")));
    EXPECT_EQ(actuator(some.scenarios[1]).mismatch, actuator(whole.scenarios[17]).mismatch);
    EXPECT_EQ(actuator(some.scenarios[1]).payload_kg, actuator(whole.scenarios[17]).payload_kg);
    const auto all = hashes_of(whole);
    for (const std::string& hash : hashes_of(some)) EXPECT_TRUE(all.contains(hash)) << "a run done is done";
    EXPECT_EQ(campaign_of(text, {"many", "many-m003"}).scenarios.size(), 40u);
  }
  const std::string text = text_with("members = 40");
  EXPECT_THAT(refusal(text, {"many-m041"}),
              HasSubstr("--scenario: 'many-m041' is not known (allowed: one, many, last"));
  EXPECT_THAT(refusal(text, {"one-m001"}), HasSubstr("--scenario: 'one-m001'"));
  EXPECT_THAT(refusal(text, {"many-m03"}), HasSubstr("--scenario: 'many-m03'"));
}

TEST(Ensemble, ReadsWhatEarlierVersionsWroteOut) {
  const std::string text = text_with("members = 40");
  const Campaign whole = campaign_of(text);
  std::vector<std::string> names = {"one", "last"};
  for (std::size_t m = 1; m <= 40; ++m) names.push_back(member_name("many", m));
  const Campaign written_out = campaign_of(campaign_of(text, names).resolved_toml);
  ASSERT_EQ(written_out.scenarios.tasks().size(), 42u);
  ASSERT_EQ(written_out.runs.size(), whole.runs.size());
  for (std::size_t i = 0; i < whole.runs.size(); ++i) {
    EXPECT_EQ(written_out.runs[i].id, whole.runs[i].id);
    EXPECT_EQ(written_out.runs[i].hash, whole.runs[i].hash);
  }
}

TEST(Ensemble, FilesAreReadOnceThoughMembersAreReadLater) {
  const Folder folder;
  folder.write("p.csv", "t,y\n0,0.02\n1,0.03\n");
  folder.write("c.toml",
               "variants = [\"thesis_pd\"]\n[[scenario]]\nname = \"s\"\nplant = \"twin\"\n"
               "trajectory = { kind = \"csv\", path = \"p.csv\" }\n"
               "ensemble = { members = 3, sampling = \"sobol\", friction = [0.5, 2.0] }\n");
  const Campaign campaign = read_campaign(folder.file("c.toml"));
  const std::string hash = campaign.runs[1].hash;
  folder.write("p.csv", "t,y\n0,0.02\n9,0.04\n");
  EXPECT_EQ(campaign.scenarios[1].duration_s, 1.0) << "the file as it was when the campaign was read";
  EXPECT_EQ(campaign.runs[1].hash, hash);
  EXPECT_NE(read_campaign(folder.file("c.toml")).runs[1].hash, hash);
  ASSERT_EQ(campaign.inputs.size(), 1u);
  EXPECT_THAT(campaign.resolved_toml, HasSubstr(campaign.inputs[0].name));
  EXPECT_EQ(read_campaign(*campaign.resolved).runs[1].hash, hash);
  EXPECT_EQ(read_campaign(*campaign.resolved, {{}, {"s-m002"}}).runs[0].hash, hash);
}

TEST(Ensemble, WhatIsRefusedOfSamplingAndNames) {
  EXPECT_THAT(refusal(text_with("members = 1000")),
              HasSubstr("c.toml:12: key 'scenario[1].ensemble.members': 1000 of them cannot be shuffled (allowed: 1 to "
                        "999, or up to 10000000 with sampling = \"sobol\" or \"latin_hypercube\")"));
  EXPECT_THAT(refusal(text_with("members = 9, sampling = \"random\"")),
              HasSubstr("key 'scenario[1].ensemble.sampling': 'random'"));
  EXPECT_THAT(refusal(text_with("members = 9, sampling = \"random\"")), HasSubstr("shuffled, sobol, latin_hypercube"));
  EXPECT_THAT(refusal(text_with("members = 10000001, sampling = \"sobol\"")), HasSubstr("from 1 to 10000000"));
  EXPECT_THAT(refusal(text_with("members = 10000000, sampling = \"sobol\"",
                                "[[scenario]]\nname = \"b\"\nplant = \"twin\"\ntrajectory = { kind = \"sine\" }\n"
                                "ensemble = { members = 10000000, sampling = \"sobol\", seed = 4 }\n"
                                "[[scenario]]\nname = \"c\"\nplant = \"twin\"\ntrajectory = { kind = \"sine\" }\n"
                                "ensemble = { members = 10000000, sampling = \"sobol\", seed = 4 }\n")),
              HasSubstr("are 120000008 runs (allowed: at most 100000000)"));
  const std::string namesake = "[[scenario]]\nname = \"many-m007\"\ntrajectory = { kind = \"sine\" }\n";
  EXPECT_THAT(refusal(text_with("members = 7", namesake)), HasSubstr("'many-m007' is a member of the ensemble 'many'"));
  EXPECT_EQ(refusal(text_with("members = 6", namesake)), "accepted");
}

TEST(Ensemble, AMemberThatCannotBeReadIsAFailedRun) {
  Campaign campaign = campaign_of(text_with("members = 2"), {"many"});
  const auto quantities = simulation_of(campaign.scenarios.front()).quantities();
  Ensemble below_nothing{4, 1, Sampling::sobol, std::vector<Ensemble::Interval>(quantities.size())};
  below_nothing.intervals.front() = {-2.0, -1.0};  // payloads, which no file may say
  const Document document = Document::from_text(
      "[[scenario]]\nname = \"bad\"\nplant = \"twin\"\ntrajectory = { kind = \"sine\" }\nensemble = {}\n", "bad.toml");
  const Document table = document.part("scenario[0]", *document.root()["scenario"][0].as_table());
  campaign.scenarios = ScenarioList();
  campaign.scenarios.add(std::make_shared<const EnsembleMembers>(below_nothing, quantities, table, "bad.toml:5"), "");
  campaign.runs = campaign.runs.over(campaign.scenarios, {1});
  try {
    campaign.scenarios[2];
    ADD_FAILURE() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("bad.toml:5"));
    EXPECT_THAT(error.what(), HasSubstr("payload_kg"));
  }
  const RunRecord record = failed_record(campaign, campaign.runs[4], "payload");
  EXPECT_EQ(record.scenario, "bad-m003");
  EXPECT_EQ(record.status, "failed: payload");
  EXPECT_EQ(record_from_json(to_json(record), "r").status, record.status);
}

}  // namespace
}  // namespace solenoid::test
