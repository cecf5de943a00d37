#include "experiments/campaign/ensemble.hpp"

#include "core/config/reader.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/report/comparison.hpp"
#include "experiments/report/pareto.hpp"
#include "experiments/report/ranking.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "tests/experiments/program_under_test.hpp"
#include "tests/support/actuator_metrics.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid::test {
namespace {

using testing::HasSubstr;

constexpr const char* campaign_text = R"(
variants = ["thesis_pd"]
[[scenario]]
name = "one"
trajectory = { kind = "cycloidal" }
[[scenario]]
name = "many"
trajectory = { kind = "sine" }
plant = "twin"
noise = true
ensemble = { members = 40, seed = 3, payload_kg = [0.0, 0.2], friction = [0.5, 2.0], noise_factor = [0.5, 2.0] }
)";

Campaign read(const std::string& text) {
  const Folder folder;
  folder.write("c.toml", text);
  return read_campaign(folder.file("c.toml"));
}

TEST(Ensemble, IsALatinHypercubeOfItsIntervals) {
  const Campaign campaign = read(campaign_text);
  ASSERT_EQ(campaign.scenarios.size(), 41u);
  EXPECT_EQ(campaign.scenarios[0].name, "one");
  EXPECT_EQ(campaign.scenarios[1].name, "many-m001");
  std::set<int> payload_slices, friction_slices, noise_slices;
  double cross = 0;
  for (std::size_t i = 1; i <= 40; ++i) {
    const ScenarioConfig& s = campaign.scenarios[i];
    const double payload = actuator(s).payload_kg / 0.2, friction = std::log2(actuator(s).mismatch.friction) / 2 + 0.5;
    const double noise =
        std::log2(actuator(s).twin.sensing.position_sigma_m / SensingEffects{}.position_sigma_m) / 2 + 0.5;
    payload_slices.insert(static_cast<int>(40 * payload));
    friction_slices.insert(static_cast<int>(40 * friction));
    noise_slices.insert(static_cast<int>(40 * noise));
    cross += (payload - 0.5) * (friction - 0.5) * 12 / 40;
    EXPECT_EQ(actuator(s).mismatch.flow, 1.0) << "not named: not drawn";
    EXPECT_EQ(s.trajectory_kind, "sine");
  }
  EXPECT_EQ(payload_slices.size(), 40u);
  EXPECT_EQ(*payload_slices.begin(), 0);
  EXPECT_EQ(*payload_slices.rbegin(), 39);
  EXPECT_EQ(friction_slices.size(), 40u);
  EXPECT_EQ(noise_slices.size(), 40u);
  EXPECT_LT(std::abs(cross), 0.5) << "quantities drawn together";
}

TEST(Ensemble, SeedDecidesAndTheResolvedCampaignIsTheSame) {
  const Campaign first = read(campaign_text), again = read(campaign_text);
  std::string other_text = campaign_text;
  other_text.replace(other_text.find("seed = 3"), 8, "seed = 4");
  const Campaign other = read(other_text), resolved = read(first.resolved_toml);
  ASSERT_EQ(resolved.scenarios.size(), first.scenarios.size());
  for (std::size_t i = 1; i < first.scenarios.size(); ++i) {
    EXPECT_EQ(actuator(first.scenarios[i]).mismatch, actuator(again.scenarios[i]).mismatch);
    EXPECT_EQ(actuator(first.scenarios[i]).mismatch, actuator(resolved.scenarios[i]).mismatch);
    EXPECT_EQ(actuator(first.scenarios[i]).payload_kg, actuator(resolved.scenarios[i]).payload_kg);
    EXPECT_NE(actuator(first.scenarios[i]).mismatch, actuator(other.scenarios[i]).mismatch);
  }
}

TEST(Ensemble, ThePublishedOnesAreAsTheyWere) {
  struct Drawn {
    const char* name;
    double payload_kg, friction, flow, supply, delay, inertia, noise_factor;
  };
  // As they were written into the results folder of the tables in docs/results/robustness.md.
  const Drawn drawn[] = {
      {"cycloidal-m001", 0.017734074143733531, 1.9027500076578372, 1.0852128662331717, 0.96549908563698994,
       0.87627530018243049, 1.0237115967327095, 0.66815616668988054},
      {"cycloidal-m050", 0.092370616592757679, 1.0363906724097969, 1.0712647636756862, 0.94294080318283435,
       0.93757521959338175, 0.90619763830971656, 1.9293859248311038},
      {"sine-m057", 0.11690724458229998, 1.2209869422258737, 0.90723223398627084, 1.0995130597180967,
       1.1307629398584464, 0.96848906826315861, 0.69201221970332205},
      {"sine-m100", 0.033696739122682035, 1.0073067331153285, 0.82342705062755306, 0.94414477820311038,
       1.2179371029754924, 0.91267452916530034, 0.92183002190171193},
  };
  const Campaign campaign = read_campaign("robustness");
  for (const Drawn& d : drawn) {
    const ScenarioConfig s = *std::ranges::find(campaign.scenarios, d.name, &ScenarioConfig::name);
    EXPECT_EQ(actuator(s).payload_kg, d.payload_kg) << d.name;
    EXPECT_EQ(actuator(s).mismatch.friction, d.friction) << d.name;
    EXPECT_EQ(actuator(s).mismatch.flow, d.flow) << d.name;
    EXPECT_EQ(actuator(s).mismatch.supply, d.supply) << d.name;
    EXPECT_EQ(actuator(s).mismatch.delay, d.delay) << d.name;
    EXPECT_EQ(actuator(s).mismatch.inertia, d.inertia) << d.name;
    EXPECT_EQ(actuator(s).twin.sensing.position_sigma_m, SensingEffects{}.position_sigma_m * d.noise_factor) << d.name;
  }
}

TEST(Ensemble, RefusesWhatCannotBe) {
  const auto refused = [](const std::string& ensemble) {
    try {
      read(
          "variants = [\"thesis_pd\"]\n[[scenario]]\nname = \"a\"\nplant = \"twin\"\ntrajectory = { kind = \"sine\" "
          "}\n" +
          ensemble);
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(refused("ensemble = { }"), HasSubstr("c.toml:6: key 'scenario[0].ensemble.members'"));
  EXPECT_THAT(refused("ensemble = { members = 0 }"), HasSubstr("key 'scenario[0].ensemble.members'"));
  EXPECT_THAT(refused("ensemble = { members = 2, flow = [1.2, 0.8] }"),
              HasSubstr("key 'scenario[0].ensemble.flow': not an interval"));
  EXPECT_THAT(refused("ensemble = { members = 2, flow = [0.0, 0.8] }"), HasSubstr("key 'scenario[0].ensemble.flow'"));
  EXPECT_THAT(refused("ensemble = { members = 2, wind = [0.5, 0.8] }"), HasSubstr("key 'scenario[0].ensemble.wind'"));
  EXPECT_THAT(refused("payload_kg = 0.1\nensemble = { members = 2 }"),
              HasSubstr("key 'scenario[0].payload_kg': beside ensemble"));
}

TEST(Ensemble, NamesItsMembers) {
  EXPECT_EQ(ensemble_name("sine-m017"), "sine");
  EXPECT_EQ(ensemble_name("sine_017"), "sine_017");
  EXPECT_EQ(ensemble_name("sine_0.15"), "sine_0.15");
  EXPECT_EQ(ensemble_name("-m017"), "-m017");
}

/// Runs of two variants on an ensemble: the second's error is the first's times ten, their spread is known.
std::vector<RunRecord> runs_on_an_ensemble(int members) {
  std::vector<RunRecord> runs;
  for (int i = 1; i <= members; ++i)
    for (const double scale : {1.0, 10.0}) {
      RunRecord r{scale > 1 ? "coarse" : "fine",
                  "sine-m" + std::string(i < 10 ? "00" : "0") + std::to_string(i),
                  "sine",
                  {0.0},
                  1,
                  "ok",
                  no_metrics()};
      (*r.metrics)["rmse_mm"] = scale * (i % 2 ? 0.01 : 0.04);
      (*r.metrics)["switches_per_s"] = 10 / scale;
      (*r.metrics)["air_g"] = 1;
      runs.push_back(r);
    }
  return runs;
}

TEST(Ranking, SpreadOfAnEnsemble) {
  const auto runs = runs_on_an_ensemble(40);
  const Ranking ranking = rank_variants(runs);
  const RankedVariant& best = ranking.variants.front();
  EXPECT_EQ(best.variant, "fine");
  EXPECT_NEAR(best.error, 0.02, 1e-12);
  EXPECT_NEAR(best.margin, std::exp(1.96 * std::log(2.0) / std::sqrt(39.0)), 1e-9);
  EXPECT_EQ(best.p95, 0.04);
  EXPECT_EQ(best.worst, 0.04);
  const std::string text = result_of(runs, false).text(false);
  EXPECT_THAT(text, HasSubstr("95 % mm"));
  EXPECT_THAT(text, HasSubstr("sine, 40 plants"));
  EXPECT_THAT(result_of(runs_on_an_ensemble(5), false).text(false), testing::Not(HasSubstr("95 % mm")));
}

TEST(Pareto, DrawsEveryRankedVariant) {
  const Folder folder;
  draw_pareto(runs_on_an_ensemble(9), folder.file("p.svg"));
  const std::string svg = text_of(folder.file("p.svg"));
  for (const char* text : {"fine", "coarse", "switches/s", "air, g"}) EXPECT_THAT(svg, HasSubstr(text));
  EXPECT_THROW(draw_pareto(runs_on_an_ensemble(9), folder.file("p.pdf")), ConfigError);
  EXPECT_THROW(draw_pareto({}, folder.file("p.svg")), ConfigError);
}

}  // namespace
}  // namespace solenoid::test
