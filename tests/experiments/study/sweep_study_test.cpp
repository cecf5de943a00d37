#include "core/config/reader.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/campaign/variant_numbers.hpp"
#include "experiments/study/sweep.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "tests/experiments/program_under_test.hpp"
#include "tests/support/actuator_metrics.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using test::Folder;
using testing::HasSubstr;

/// Two variants, one of them swept, on a rest so short that runs take no time.
constexpr const char* small_study = R"(
variants = ["swept", "plain"]
[[scenario]]
name       = "rest_light"
trajectory = { kind = "cycloidal", move_s = 0.2, dwell_s = 0.1 }
[[scenario]]
name       = "rest_heavy"
trajectory = { kind = "cycloidal", move_s = 0.2, dwell_s = 0.1 }
payload_kg = 0.15
[variant.swept]
valves = "three_way"
[variant.plain]
valves = "two_way"
[study]
title = "Small"
sweep = { key = "horizon.steps", values = [40, 60, 100], variants = ["swept"] }
[[study.table]]
name      = "step"
scenarios = ["rest"]
figures   = ["overshoot_percent", "sse_max_abs_mm"]
knee      = { x = "overshoot_percent", y = "sse_max_abs_mm" }
printed   = { name = "rig", file = "table_5-2_step_np", value = "np", columns = ["max_overshoot_percent", "max_abs_steady_state_error_mm"] }
[[study.table]]
name      = "errors"
scenarios = ["rest"]
figures   = ["rmse_mm", "worst_rmse_mm"]
across_conditions = true
only      = 60
[[study.panel]]
table = "step"
x     = "overshoot_percent"
y     = "sse_max_abs_mm"
[[study.panel]]
table = "errors"
y     = "rmse_mm"
log   = "y"
)";

/// A record of every run of the campaign, made by hand.
std::vector<RunRecord> records_of(const Study& study, const auto& metrics_of) {
  std::vector<RunRecord> records;
  for (const CampaignRun& run : study.campaign.runs) {
    Metrics metrics = no_metrics();
    metrics_of(study.members[run.variant], study.campaign.scenarios[run.scenario], metrics);
    records.push_back(record_of(study.campaign, run, metrics));
  }
  return records;
}

TEST(SweepStudy, HasAVariantForEachValueAndLeavesTheOthersAsTheyAre) {
  const Folder folder;
  const Study study = read_study(folder.write("s.toml", small_study));
  ASSERT_EQ(study.campaign.variants.size(), 4u);
  EXPECT_EQ(study.campaign.variants[0].name, "swept-40");
  EXPECT_EQ(study.campaign.variants[1].horizon.steps, 60);
  EXPECT_EQ(study.campaign.variants[2].modes, "three_way");
  EXPECT_EQ(study.campaign.variants[3].name, "plain");
  EXPECT_EQ(study.campaign.variants[3].horizon.steps, 100);
  EXPECT_EQ(study.members[2].value, 100.0);
  EXPECT_FALSE(study.members[3].value);
  EXPECT_EQ(study.campaign.name, "study-s");
}

TEST(SweepStudy, PoolsRunsByValueAndByPayload) {
  const Folder folder;
  const Study study = read_study(folder.write("s.toml", small_study));
  const auto records = records_of(study, [](const Study::Member&, const ScenarioConfig& s, Metrics& m) {
    m["rmse_mm"] = actuator(s).payload_kg > 0 ? 0.4 : 0.1;
    m["overshoot_percent"] = actuator(s).payload_kg > 0 ? 3.0 : 1.0;
  });
  const auto rows = study_rows(study, records);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0][0].figures[0], 2.0);
  EXPECT_EQ(rows[0][0].runs, 2);
  ASSERT_EQ(rows[1].size(), 4u);  // swept at 60 and plain, light and heavy
  EXPECT_EQ(rows[1][1].value, 0.15);
  EXPECT_NEAR(rows[1][1].figures[0], 0.4, 1e-12);
}

TEST(SweepStudy, TheKneeIsNearestToTheBestInBothAndTheThesisChoseIt) {
  const Folder folder;
  const Study study = read_study(folder.write("s.toml", small_study));
  // x: 10, 2, 0 and y: 1, 2, 6: distances 1, |(0.2, 0.2)|, 1. The plain variant is better than all in x: only y counts.
  auto records = records_of(study, [](const Study::Member& member, const ScenarioConfig&, Metrics& m) {
    const double value = member.value.value_or(0.0);
    m["overshoot_percent"] = value == 40 ? 10 : value == 60 ? 2 : value == 100 ? 0 : -5;
    m["sse_max_abs_mm"] = value == 40 ? 1 : value == 60 ? 2 : value == 100 ? 6 : 3.5;
  });
  StudyRows rows = study_rows(study, records).front();
  EXPECT_DOUBLE_EQ(*rows[0].to_best, 1.0);
  EXPECT_NEAR(*rows[1].to_best, std::sqrt(0.08), 1e-12);
  EXPECT_DOUBLE_EQ(*rows[2].to_best, 1.0);
  EXPECT_DOUBLE_EQ(*rows[3].to_best, 0.5);
  EXPECT_TRUE(rows[1].knee);
  EXPECT_FALSE(rows[3].knee);
  for (const StudyPoint& p : rows) {
    if (p.series == "rig") {
      EXPECT_EQ(p.knee, p.value == 100.0) << *p.value;
    }
  }
  // Runs that did not end well count as such and nowhere else.
  for (RunRecord& r : records)
    if (r.variant == "swept-60") r.status = "unstable", r.metrics.reset();
  rows = study_rows(study, records).front();
  EXPECT_EQ(rows[1].bad, 2);
  EXPECT_TRUE(std::isnan(rows[1].figures[0]));
  EXPECT_FALSE(rows[1].knee);
}

/// Against a figure that is better small, and against a life, which is better long and pooled by its harmonic mean.
TEST(SweepStudy, AFrontIsWhatNothingBeatsInBoth) {
  const Folder folder;
  std::string text = small_study;
  const std::string figures = "figures   = [\"rmse_mm\", \"worst_rmse_mm\"]";
  text.replace(text.find(figures), figures.size(),
               "figures = [\"rmse_mm\", \"air_g\", \"life_years\", \"solve_p50_us\"]\n"
               "fronts = { x = [\"air_g\", \"life_years\"], y = \"rmse_mm\" }");
  text.replace(text.find("across_conditions = true\nonly      = 60\n"), 40, "");
  const Study study = read_study(folder.write("s.toml", text));
  // swept at 40, 60, 100, plain; one run of two in a scenario lasts three times as long
  const auto records = records_of(study, [](const Study::Member& member, const ScenarioConfig& s, Metrics& m) {
    const double value = member.value.value_or(0.0);
    m["rmse_mm"] = value == 40 ? 4 : value == 60 ? 2 : value == 100 ? 3 : 1;
    m["air_g"] = value == 40 ? 1 : value == 60 ? 2 : value == 100 ? 3 : 4;
    m["life_years"] = (value == 40    ? 10
                       : value == 60  ? 20
                       : value == 100 ? 30
                                      : 5) *
                      (actuator(s).payload_kg > 0 ? 3.0 : 1.0);
    m.solve_us.p50 = 7.0;
  });
  const StudyRows rows = study_rows(study, records).back();
  EXPECT_DOUBLE_EQ(rows[0].figures[2], 2.0 / (1.0 / 10 + 1.0 / 30));
  EXPECT_EQ(rows[0].figures[3], 7.0);
  const auto values = [&](const char* x) {
    std::vector<double> all;
    for (const StudyPoint* p : front_of(study, study.tables.back(), rows, x, "rmse_mm"))
      all.push_back(p->value.value_or(0.0));
    return all;
  };
  EXPECT_THAT(values("air_g"), testing::ElementsAre(40, 60, 0));        // at 100 more air and more error than at 60
  EXPECT_THAT(values("life_years"), testing::ElementsAre(100, 60, 0));  // the longest first; 40 lasts less than 60
}

TEST(SweepStudy, WhatCannotBeStudiedIsRefusedWithItsKey) {
  const Folder folder;
  const auto refusal = [&](const std::string& from, const std::string& to) {
    std::string text = small_study;
    text.replace(text.find(from), from.size(), to);
    try {
      read_study(folder.write("s.toml", text));
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(refusal("[40, 60, 100]", "[40, 60, 6000]"), HasSubstr("horizon.steps"));
  EXPECT_THAT(refusal("[40, 60, 100]", "[]"), HasSubstr("values"));
  EXPECT_THAT(refusal("values =", "drawn = [1], values ="), HasSubstr("3 values"));
  EXPECT_THAT(refusal("variants = [\"swept\"]", "variants = [\"nobody\"]"), HasSubstr("nobody"));
  EXPECT_THAT(refusal("\"rmse_mm\", \"worst", "\"luck\", \"worst"), HasSubstr("steady_air_g_per_s"));
  EXPECT_THAT(refusal("scenarios = [\"rest\"]", "scenarios = [\"nowhere\"]"), HasSubstr("nowhere"));
  EXPECT_THAT(refusal("only      = 60", "only = 61"), HasSubstr("only"));
  EXPECT_THAT(refusal("table_5-2_step_np", "table_9"), HasSubstr("table_9"));
  EXPECT_THAT(refusal("y     = \"rmse_mm\"", "y = \"air_g\""), HasSubstr("worst_rmse_mm"));
  EXPECT_THAT(refusal("key = \"horizon.steps\"", "key = \"horizon.stairs\""), HasSubstr("stairs"));
  EXPECT_THAT(refusal("[study]", "[studies]"), HasSubstr("studies"));
}

TEST(SweepStudy, CommandPrintsEveryFormatDrawsAndResumes) {
  const Folder folder;
  folder.write("s.toml", small_study);
  const auto text = test::run_program(folder, "study sweep s.toml --out o --svg s.svg");
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_THAT(text.out, HasSubstr("Knee of sse_max_abs_mm against overshoot_percent, rig: horizon.steps = 100"));
  EXPECT_THAT(test::text_of(folder.file("s.svg")), HasSubstr("overshoot, %"));
  const auto json = test::run_program(folder, "study sweep s.toml --out o --format json");
  EXPECT_THAT(test::text_of(folder.file("o/log.txt")), HasSubstr("8 runs were there already"));
  const auto parsed = nlohmann::json::parse(json.out);
  EXPECT_EQ(parsed.at("tables").at(1).at("rows").size(), 4u);
  EXPECT_TRUE(parsed.at("tables").at(0).at("rows").at(0).at("sse_max_abs_mm").is_number());
  EXPECT_EQ(test::run_program(folder, "study valves --jobs 0").exit_code, 2);
  const auto csv = test::run_program(folder, "study sweep s.toml --out o --format csv");
  EXPECT_THAT(csv.out, HasSubstr("errors,plain,0.15,1,0,rmse_mm,"));
  EXPECT_EQ(test::run_program(folder, "study sweep missing.toml").exit_code, 2);
  EXPECT_EQ(test::run_program(folder, "study sweep default").exit_code, 2);  // a campaign, no study
}

/// The variant of a shipped study for a series and a value, and a scenario of it by name.
Metrics shipped_run(const Study& study, const std::string& series, std::optional<double> value,
                    const std::string& scenario) {
  for (std::size_t v = 0; v < study.members.size(); ++v)
    if (study.members[v].series == series && study.members[v].value == value)
      return simulate(study.campaign.variants[v],
                      *std::ranges::find(study.campaign.scenarios, scenario, &ScenarioConfig::name), 1)
          .metrics;
  ADD_FAILURE() << series << " is not in the study";
  return {};
}

TEST(HorizonStudy, OvershootIsTradedForSteadyStateErrorAndTheTunedLawBeatsTheKnee) {
  const Study study = read_study("horizon");
  const Metrics brief = shipped_run(study, "dmpc", 60, "twin"), knee = shipped_run(study, "dmpc", 100, "twin"),
                distant = shipped_run(study, "dmpc", 180, "twin"), tuned = shipped_run(study, "dmpc_tuned", {}, "twin");
  EXPECT_GT(brief["overshoot_percent"], 3 * knee["overshoot_percent"]);
  EXPECT_LT(brief["sse_max_abs_mm"], knee["sse_max_abs_mm"] / 2);
  EXPECT_GT(distant["sse_max_abs_mm"], 4 * knee["sse_max_abs_mm"]);
  EXPECT_LT(tuned["sse_max_abs_mm"], knee["sse_max_abs_mm"] / 2);
  EXPECT_LT(tuned["overshoot_percent"], knee["overshoot_percent"] + 0.5);
  EXPECT_LT(tuned["rmse_mm"], knee["rmse_mm"]);
}

TEST(ValveStudy, ClosedValvesHoldTheArmWhereThreeWayValvesKeepDrawingAir) {
  const Study study = read_study("valves");
  const Metrics nine = shipped_run(study, "nine", 1.2e-8, "holding_0.3_100"),
                four = shipped_run(study, "four_cylinder", 1.2e-8, "holding_0.3_100"),
                closed = shipped_run(study, "nine_cylinder", 2e-7, "holding_0.3_100");
  EXPECT_EQ(nine["steady_air_g_per_s"], 0.0);
  EXPECT_EQ(nine["steady_switches_per_s"], 0.0);
  EXPECT_GT(four["steady_switches_per_s"], 10.0);
  EXPECT_GT(four["steady_air_g_per_s"], 0.01);
  EXPECT_LT(closed["steady_air_g_per_s"], four["steady_air_g_per_s"] / 3);
  EXPECT_LE(four["steady_air_g_per_s"], four["air_g"]);
}

TEST(ForgettingStudy, ForgettingCalmsTheHybridAndLeavesAnError) {
  const Study study = read_study("forgetting");
  double swing = 0, all_swing = 0, error = 0, all_error = 0;
  for (const char* member : {"dwell-m001", "dwell-m002", "dwell-m003"}) {
    const Metrics recent = shipped_run(study, "thesis_pd", 0.999, member),
                  all = shipped_run(study, "thesis_pd", 1.0, member);
    swing += recent["ssa_mm"], all_swing += all["ssa_mm"];
    error += recent["sse_mean_abs_mm"], all_error += all["sse_mean_abs_mm"];
  }
  EXPECT_LT(swing, all_swing / 3);
  EXPECT_GT(error, all_error);
}

TEST(SetNumber, ReachesArraysAndKeepsTheHorizonWhatItsBlocksAre) {
  toml::table variant = toml::parse("horizon = { steps = 40, blocks = [1, 3, 4] }\nmotor = \"pd\"");
  EXPECT_EQ(number_at(variant, "horizon.blocks.1"), 3.0);
  EXPECT_FALSE(number_at(variant, "cost.air"));
  set_number(variant, "horizon.blocks.1", 7, true);
  EXPECT_EQ(number_at(variant, "horizon.blocks.1"), 7.0);
  EXPECT_EQ(number_at(variant, "horizon.steps"), 60.0);
  set_number(variant, "cost.air", 1e-4, false);
  EXPECT_EQ(number_at(variant, "cost.air"), 1e-4);
  EXPECT_THROW(set_number(variant, "horizon.blocks.3", 1, true), ConfigError);
  EXPECT_THROW(set_number(variant, "motor.gain", 1, false), ConfigError);
}

/// What a run's records say of its steady part, against the ticks themselves.
TEST(SteadyPart, SwitchesAndAirOfHoldingAreThoseOfItsTicks) {
  const Study study = read_study("valves");
  ScenarioConfig scenario = *std::ranges::find(study.campaign.scenarios, "holding_0_100", &ScenarioConfig::name);
  VariantConfig variant = study.campaign.variants.front();
  variant.modes = "three_way";
  const RunResult run = simulate(variant, scenario, 1);
  int switches = 0;
  for (std::size_t i = run.ticks.size() - 1000; i < run.ticks.size(); ++i)
    switches += std::popcount(run.ticks[i].applied.switches ^ run.ticks[i - 1].applied.switches);
  EXPECT_EQ(run.metrics["steady_switches_per_s"], switches);  // the steady part is a second
  scenario.duration_s -= 1.0;
  const Metrics before = simulate(variant, scenario, 1).metrics;
  EXPECT_NEAR(run.metrics["steady_air_g_per_s"], run.metrics["air_g"] - before["air_g"], 2e-3);
}

}  // namespace
}  // namespace solenoid
