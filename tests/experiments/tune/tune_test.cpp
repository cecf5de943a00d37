#include "experiments/tune/tune.hpp"

#include "core/config/reader.hpp"
#include "tests/experiments/program_under_test.hpp"
#include "tests/support/actuator_metrics.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using test::Folder;
using testing::HasSubstr;

TEST(FreeParameter, RangesAreReadAndWalkedInTheirScale) {
  const FreeParameter plain = parse_free_parameter("integral.gain=0..0.01");
  EXPECT_EQ(plain.key, "integral.gain");
  EXPECT_DOUBLE_EQ(plain.at(0.25), 0.0025);
  const FreeParameter log = parse_free_parameter("cost.switching=1e-9..1e-5:log");
  EXPECT_NEAR(log.at(0.5), 1e-7, 1e-20);
  const FreeParameter whole = parse_free_parameter("horizon.steps=-3..7:whole");
  EXPECT_EQ(whole.at(0.44), 1.0);
  for (const FreeParameter& p : {plain, log, whole}) {
    EXPECT_EQ(p.at(-1.0), p.low);
    EXPECT_EQ(p.at(2.0), p.high);
    EXPECT_NEAR(p.at(p.point(p.at(0.3))), p.at(0.3), 1e-12 * p.high);
  }
}

TEST(FreeParameter, WhatIsNoRangeIsRefusedWithWhatIs) {
  for (const char* text : {"", "cost.switching", "=1..2", "k=1", "k=2..1", "k=1..1", "k=a..2", "k=1..b", "k=0..1:log",
                           "k=1..2:exp", "k=0.5..2:whole", "k=1..inf"}) {
    try {
      parse_free_parameter(text);
      ADD_FAILURE() << "accepted " << text;
    } catch (const ConfigError& error) {
      EXPECT_THAT(error.what(), HasSubstr("KEY=LOW..HIGH:log"));
    }
  }
}

RunRecord record(const std::string& scenario, double rmse_mm, double switches, double air_g) {
  RunRecord r{"v", scenario, "sine", {0.0}, 1, "ok", no_metrics()};
  (*r.metrics)["rmse_mm"] = rmse_mm;
  (*r.metrics)["switches_per_s"] = switches;
  (*r.metrics)["air_g"] = air_g;
  return r;
}

TEST(TuneScore, IsTheLogOfTheGeometricMeanPlusEffortBeyondTheLimits) {
  std::vector<RunRecord> runs = {record("a", 0.01, 10, 1), record("b", 0.04, 30, 3)};
  Score s = score_of(runs, {20, 2});
  EXPECT_NEAR(s.objective, std::log(0.02), 1e-9);
  EXPECT_EQ(s.worst_error, 0.04);
  s = score_of(runs, {10, 1});
  EXPECT_NEAR(s.objective, std::log(0.02) + 5 * std::log(2.0) + 5 * std::log(2.0), 1e-9);
  runs.push_back({"v", "c", "sine", {0.0}, 1, "unstable", std::nullopt});
  s = score_of(runs, {20, 2});
  EXPECT_EQ(s.bad, 1);
  EXPECT_NEAR(s.objective, std::log(0.02) + 10.0 / 3, 1e-9);
}

TEST(TuneScore, OfStepsIsTheDistanceToNoOvershootAndNoErrorInUnitsOfTable52) {
  std::vector<RunRecord> runs = {record("a", 6, 10, 1), record("b", 6, 10, 1)};
  (*runs[0].metrics)["overshoot_percent"] = 21;
  (*runs[0].metrics)["sse_max_abs_mm"] = 2;
  (*runs[1].metrics)["sse_max_abs_mm"] = 6;
  const Score s = score_of(runs, {20, 2}, TuneAim::step);
  EXPECT_EQ(s.overshoot_percent, 10.5);
  EXPECT_EQ(s.sse_mm, 4.0);
  EXPECT_NEAR(s.objective, std::log(0.5), 1e-12);  // |(0.3, 0.4)|
}

/// The horizon of the thesis's law with a good estimator: shorter is better (docs/results/robustness.md).
std::string campaign_in(const Folder& folder) {
  return folder.write("c.toml", R"(
variants = ["thesis_pd_ekf"]
[[scenario]]
name = "train"
plant = "twin"
noise = true
trajectory = { kind = "sine", lead_s = 1.0, periods = 1 }
duration_s = 2.0
[[scenario]]
name = "held_out"
plant = "twin"
noise = true
payload_kg = 0.1
trajectory = { kind = "sine", lead_s = 1.0, periods = 1 }
duration_s = 2.0
)");
}

TuneSettings settings_in(const Folder& folder, const std::string& out) {
  TuneSettings s;
  s.campaign = campaign_in(folder);
  s.variant = "thesis_pd_ekf";
  s.free = {parse_free_parameter("horizon.steps=20..100:whole"), parse_free_parameter("integral.gain=1e-4..1e-2:log")};
  s.limits = {{"switches_per_s", 1000}, {"air_g", 1000}};
  s.evaluations = 12;
  s.out = folder.file(out);
  return s;
}

TEST(Tune, FindsTheShorterHorizonAndLeavesACampaignThatShowsIt) {
  const Folder folder;
  const TuneSettings settings = settings_in(folder, "out");
  const TuneResult result = tune(settings);
  EXPECT_EQ(result.ended, "evaluations");
  ASSERT_EQ(result.steps.size(), 13u);
  EXPECT_EQ(result.steps[0].values[1], 0.001);  // as the variant is
  const TuneStep& chosen = result.steps[result.chosen];
  EXPECT_LT(chosen.values[0], 100);
  EXPECT_EQ(chosen.values[0], std::round(chosen.values[0]));
  EXPECT_LT(chosen.training.objective, result.steps[0].training.objective - 0.3);
  EXPECT_LT(chosen.held_out->objective, result.steps[0].held_out->objective);
  const Campaign tuned = read_campaign(folder.file("out/tuned.toml"));
  ASSERT_EQ(tuned.variants.size(), 2u);
  EXPECT_EQ(tuned.variants[1].name, "thesis_pd_ekf_tuned");
  EXPECT_EQ(tuned.variants[1].horizon.steps, static_cast<int>(chosen.values[0]));
  EXPECT_EQ(tuned.variants[1].integral.gain, chosen.values[1]);
  ASSERT_EQ(tuned.scenarios.size(), 1u);
  EXPECT_EQ(tuned.scenarios[0].name, "held_out");
}

TEST(Tune, BeginsWithTheVariantAsItIsWhereItSaysNothingToo) {
  const Folder folder;
  TuneSettings s = settings_in(folder, "out");
  s.free = {parse_free_parameter("integral.forgetting=0.9..1"), parse_free_parameter("cost.switching=1e-9..1e-6:log"),
            parse_free_parameter("motor_gains.derivative=100..1000")};
  s.evaluations = 1;
  EXPECT_EQ(tune(s).steps[0].values, (std::vector<double>{1.0, 1e-9, 400.0}));
}

TEST(Tune, FreesTheLengthsOfBlocks) {
  const Folder folder;
  TuneSettings s = settings_in(folder, "out");
  s.campaign = folder.write("b.toml",
                            "include = [\"c.toml\"]\nvariants = [\"blocks\"]\n[variant.blocks]\nsolver = "
                            "\"branch_and_bound\"\nhorizon = { steps = 100, blocks = [4, 16] }\n");
  s.variant = "blocks";
  s.free = {parse_free_parameter("horizon.blocks.0=1..4:whole"), parse_free_parameter("horizon.blocks.1=2..16:whole")};
  s.evaluations = 4;
  const TuneResult result = tune(s);
  EXPECT_EQ(result.steps[0].values, (std::vector<double>{4, 16}));
  const Campaign tuned = read_campaign(folder.file("out/tuned.toml"));
  const std::vector<double>& chosen = result.steps[result.chosen].values;
  EXPECT_EQ(tuned.variants[1].horizon.blocks,
            (std::vector<int>{static_cast<int>(chosen[0]), static_cast<int>(chosen[1])}));
  EXPECT_EQ(tuned.variants[1].horizon.steps, static_cast<int>(5 * (chosen[0] + chosen[1])));
}

TEST(Tune, ResumesWithoutRepeatingAndEndsWhereOneRunEnds) {
  const Folder folder;
  TuneSettings brief = settings_in(folder, "parts"), whole = settings_in(folder, "whole");
  brief.evaluations = 4;
  EXPECT_EQ(tune(brief).steps.size(), 5u);
  std::string text = test::text_of(folder.file("parts/history.csv"));
  folder.write("parts/history.csv", text + "5,-1,0.1,");  // cut while it was written
  brief.evaluations = 12;
  tune(brief);
  tune(whole);
  EXPECT_EQ(test::text_of(folder.file("parts/history.csv")), test::text_of(folder.file("whole/history.csv")));
  // An evaluation that is in the history is believed, not repeated.
  text = test::text_of(folder.file("whole/history.csv"));
  const std::size_t line = text.find("\n0,") + 3, comma = text.find(',', line);
  text.replace(line, comma - line, "-77");
  folder.write("whole/history.csv", text);
  EXPECT_EQ(tune(whole).steps[0].training.objective, -77);
}

TEST(Tune, RefusesWhatCannotBeTuned) {
  const Folder folder;
  const auto refusal = [&](auto change) {
    TuneSettings s = settings_in(folder, "out");
    s.evaluations = 1;
    change(s);
    try {
      tune(s);
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal([](TuneSettings&) {}), "");
  EXPECT_THAT(refusal([](TuneSettings& s) { s.free[0].high = 90; }), HasSubstr("another tuning run"));
  EXPECT_THAT(refusal([](TuneSettings& s) { s.variant = "nobody"; }), HasSubstr("nobody"));
  EXPECT_THAT(refusal([](TuneSettings& s) { s.free[0].key = "horizon.stairs", s.out += "2"; }),
              HasSubstr("--free horizon.stairs: key 'variant.thesis_pd_ekf.horizon.stairs'"));
  EXPECT_THAT(refusal([](TuneSettings& s) { s.free[0].key = "motor.gain", s.out += "3"; }), HasSubstr("'motor'"));
  EXPECT_THAT(refusal([](TuneSettings& s) { s.campaign = "rig", s.out += "4"; }), HasSubstr("held_out"));
  EXPECT_THAT(refusal([](TuneSettings& s) { s.algorithm = "luck", s.out += "5"; }), HasSubstr("subplex"));
  EXPECT_THAT(refusal([](TuneSettings& s) { s.free.clear(); }), HasSubstr("at least one"));
}

TEST(TuneCommand, PrintsBeforeAndAfterDrawsTheHistoryAndNamesWhatItRefuses) {
  const Folder folder;
  campaign_in(folder);
  const test::ProgramRun run =
      test::run_program(folder,
                        "tune thesis_pd_ekf --campaign c.toml --free horizon.steps=20..100:whole --evaluations 3 "
                        "--limit switches_per_s=1000 --limit air_g=1000 --out o");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  for (const char* word : {"training, before", "held out, tuned", "horizon.steps", "compare o/tuned.toml"})
    EXPECT_THAT(run.out, HasSubstr(word));
  EXPECT_THAT(run.err, HasSubstr("step 3 of 3"));
  EXPECT_THAT(test::text_of(folder.file("o/history.svg")), HasSubstr("best so far"));
  const test::ProgramRun json =
      test::run_program(folder,
                        "tune thesis_pd_ekf --campaign c.toml --free horizon.steps=20..100:whole --evaluations 3 "
                        "--limit switches_per_s=1000 --limit air_g=1000 --out o --format json");
  EXPECT_EQ(nlohmann::json::parse(json.out).at("steps").size(), 4u);
  const test::ProgramRun bad = test::run_program(folder, "tune thesis_pd_ekf --campaign c.toml --free horizon.steps=9");
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_THAT(bad.err, HasSubstr("gives no range"));
}

}  // namespace
}  // namespace solenoid
