// Every command that asks for a system, on each of them.
#include "controllers/systems.hpp"
#include "tests/experiments/needs_uplot.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <ostream>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using nlohmann::json;
using test::Folder;
using test::ProgramRun;
using test::run_program;
using test::text_of;
using testing::HasSubstr;

/// A short campaign of a system and what its people look for.
struct Case {
  std::string system, variants, scenario, free, judged, heading, axis;
  std::string first() const { return variants.substr(1, variants.find('"', 1) - 1); }
  /// Two tasks, of which one judges what is tuned.
  std::string campaign() const {
    std::string text = "variants = [" + variants + "]\n";
    for (const char* name : {"train", "held_out"})
      text += "[[scenario]]\nname = \"" + std::string(name) + "\"\nsystem = \"" + system + "\"\n" + scenario;
    return text;
  }
};

/// In the names of tests.
std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.system; }

const Case cases[] = {
    {"actuator", R"("nine_cylinder", "thesis_pd")", "trajectory = { kind = \"sine\" }\nduration_s = 0.5\n",
     "cost.switching=1e-9..1e-7:log", "rmse_mm", "RMSE mm", "position"},
    {"thrusters", R"("flyer_pairs", "flyer_rounded")",
     "trajectory = { x = { kind = \"step\", height_m = 0.1, at_s = 0.2 } }\nnoise = true\nduration_s = 3.0\n",
     "cost.air=1..100:log", "rmse_mm", "RMSE mm", "angle"},
    {"inverter", R"("inverter_one_step", "inverter_n3")", "trajectory = { kind = \"rotating\", duration_s = 0.01 }\n",
     "cost.switching=100..10000:log", "error_percent", "error %", "current alpha"}};

class EverySystem : public testing::TestWithParam<Case> {};

TEST_P(EverySystem, IsListedWithItsKeys) {
  const Folder folder;
  const ProgramRun listed = run_program(folder, "list systems --format json");
  ASSERT_EQ(listed.exit_code, 0) << listed.err;
  EXPECT_THAT(listed.out, HasSubstr("\"" + GetParam().system + "\""));
  const ProgramRun keys = run_program(folder, "list keys --format json --system " + GetParam().system);
  ASSERT_EQ(keys.exit_code, 0) << keys.err;
  std::set<std::string> own;
  const json listed_keys = json::parse(keys.out).at("keys");
  for (const json& key : listed_keys) own.insert(key.at("key"));
  for (const OutputSource& output : find_system(GetParam().system)->description().outputs)
    EXPECT_TRUE(own.contains("cost." + output.name)) << output.name;
  const ProgramRun modes = run_program(folder, "list modes --system " + GetParam().system);
  EXPECT_THAT(modes.out, HasSubstr(find_system(GetParam().system)->mode_sets().front()));
}

TEST_P(EverySystem, IsComparedAndDrawnInItsUnits) {
  const Case& c = GetParam();
  const Folder folder;
  folder.write("c.toml", c.campaign());
  const ProgramRun compared = run_program(folder, "compare c.toml --out r --format json");
  ASSERT_EQ(compared.exit_code, 0) << compared.err;
  const json runs = json::parse(compared.out).at("runs");
  ASSERT_EQ(runs.size(), 4u);
  for (const json& run : runs) {
    EXPECT_EQ(run.at("system"), c.system);
    EXPECT_EQ(run.at("status"), "ok");
    EXPECT_GT(run.at(c.judged).get<double>(), 0.0);
  }
  EXPECT_THAT(run_program(folder, "compare c.toml --out r").out, HasSubstr(c.heading));
  EXPECT_THAT(text_of(folder / "r/runs.csv"), HasSubstr("," + c.judged + ","));
  const ProgramRun figure = run_program(folder, "report r --figure train--" + c.first() + "--s1 --svg run.svg");
  EXPECT_EQ(figure.exit_code, 0) << figure.err;
  EXPECT_THAT(text_of(folder / "run.svg"), HasSubstr(c.axis));
}

TEST_P(EverySystem, HasAPageOfItsCampaign) {
  NEEDS_UPLOT();
  const Folder folder;
  folder.write("c.toml", GetParam().campaign());
  const ProgramRun compared = run_program(folder, "compare c.toml --out r");
  ASSERT_EQ(compared.exit_code, 0) << compared.err;
  const ProgramRun page = run_program(folder, "report r --out page.html");
  ASSERT_EQ(page.exit_code, 0) << page.err;
  EXPECT_THAT(text_of(folder / "page.html"), HasSubstr("\"" + GetParam().judged + "\""));
}

TEST_P(EverySystem, IsProfiledAndItsGapsAreKept) {
  const Case& c = GetParam();
  const Folder folder;
  folder.write("c.toml", c.campaign());
  const ProgramRun profiled =
      run_program(folder, "profile c.toml --record c.instances --per-variant 20 --passes 1 --format json");
  ASSERT_EQ(profiled.exit_code, 0) << profiled.err;
  const json profiles = json::parse(profiled.out).at("variants");
  ASSERT_EQ(profiles.size(), 2u);
  for (const json& v : profiles) {
    EXPECT_GE(v.at("instances").get<int>(), 10);
    EXPECT_GT(v.at("p50_us").get<double>(), 0.0);
  }
  const ProgramRun ledger = run_program(
      folder, "ledger --instances c.instances --variant " + c.first() + " --states 5 --bonmin 0 --format json");
  ASSERT_EQ(ledger.exit_code, 0) << ledger.err;
  EXPECT_THAT(ledger.out, HasSubstr("branch_and_bound"));
}

TEST_P(EverySystem, IsTuned) {
  const Case& c = GetParam();
  const Folder folder;
  folder.write("c.toml", c.campaign());
  const ProgramRun tuned = run_program(
      folder, "tune " + c.first() + " --campaign c.toml --free " + c.free + " --evaluations 2 --out t --format json");
  ASSERT_EQ(tuned.exit_code, 0) << tuned.err;
  EXPECT_GE(json::parse(tuned.out).at("steps").size(), 2u);
  EXPECT_THAT(text_of(folder / "t/history.csv"), HasSubstr(",worst_" + c.judged + ","));
  const ProgramRun again = run_program(folder, "compare t/tuned.toml --out again");
  EXPECT_EQ(again.exit_code, 0) << again.err;
}

TEST_P(EverySystem, HasItsSearchScaled) {
  const Folder folder;
  const ProgramRun scaled = run_program(folder, "scaling " + GetParam().system + " --instances 1 --format json");
  ASSERT_EQ(scaled.exit_code, 0) << scaled.err;
  const json study = json::parse(scaled.out);
  EXPECT_EQ(study.at("system"), GetParam().system);
  std::set<int> states;
  for (const json& row : study.at("rows")) {
    states.insert(row.at("states").get<int>());
    if (row.at("blocks") != 1) continue;
    EXPECT_EQ(row.at("sequences"), row.at("states"));
    for (const char* solver : {"enumeration", "cold", "warm"}) EXPECT_EQ(row.at(solver).at("proven"), 1.0) << solver;
  }
  EXPECT_GE(states.size(), 2u);
}

TEST_P(EverySystem, RefusesWhatIsAnothers) {
  const Case& c = GetParam();
  const Folder folder;
  const std::string other = c.system == "actuator" ? "flyer_pairs" : "thesis_pd";
  folder.write("c.toml", c.campaign());
  const std::string mixed = refusal_of(folder, "compare c.toml --variant " + other);
  EXPECT_THAT(mixed, HasSubstr("c.toml:"));
  EXPECT_THAT(mixed, HasSubstr("allowed: scenarios and variants of one system"));
  const std::string key = c.system == "actuator" ? "cost = { i_alpha = 1.0 }" : "motor = \"pd\"";
  folder.write("k.toml", c.campaign() + "[variant.mine]\nsystem = \"" + c.system + "\"\n" + key + "\n");
  const std::string foreign = refusal_of(folder, "compare k.toml --variant mine");
  EXPECT_THAT(foreign, HasSubstr("k.toml:"));
  EXPECT_THAT(foreign, HasSubstr("not known"));
  folder.write("t.toml", c.campaign() + "timing = { tick_ms = 0.7, period_ms = 1.0 }\n");
  EXPECT_THAT(refusal_of(folder, "compare t.toml"), HasSubstr("no whole number of ticks"));
}

INSTANTIATE_TEST_SUITE_P(All, EverySystem, testing::ValuesIn(cases),
                         [](const auto& info) { return info.param.system; });

TEST(Systems, OneThatIsNotThereIsRefusedWithThoseThatAre) {
  const Folder folder;
  folder.write("c.toml",
               "variants = [\"v\"]\n[variant.v]\nsystem = \"hoist\"\n[[scenario]]\nname = \"s\"\ntrajectory = {}\n");
  const std::string refused = refusal_of(folder, "compare c.toml");
  EXPECT_THAT(refused, HasSubstr("c.toml:3"));
  EXPECT_THAT(refused, HasSubstr("allowed: actuator, thrusters, inverter"));
}

TEST(Systems, ARunOfNoTickOrOfTooManyIsRefused) {
  const Folder folder;
  for (const char* duration : {"1e-6", "3600.0"}) {
    folder.write(
        "c.toml",
        "variants = [\"inverter_n3\"]\n[[scenario]]\nname = \"s\"\nsystem = \"inverter\"\ntrajectory = { kind = "
        "\"rotating\", duration_s = 0.01 }\nduration_s = " +
            std::string(duration) + "\n");
    const std::string refused = refusal_of(folder, "compare c.toml");
    EXPECT_THAT(refused, HasSubstr("c.toml:6: key 'duration_s'"));
    EXPECT_THAT(refused, HasSubstr("allowed: 1 to 4000000 ticks"));
  }
}

/// A short circuit's current is mostly at the load's own frequency: there is little distortion in it, and much error.
TEST(Systems, AnInverterThatNeverSwitchesIsRankedLast) {
  const Folder folder;
  folder.write("c.toml",
               "variants = [\"idle\", \"inverter_one_step\"]\n[variant.idle]\nsystem = \"inverter\"\nsolver = "
               "\"exhaustive\"\ncost = { switching = 1e15 }\n[[scenario]]\nname = \"s\"\nsystem = "
               "\"inverter\"\ntrajectory = { kind = \"rotating\", duration_s = 1.0 }\n");
  const ProgramRun compared = run_program(folder, "compare c.toml --format json");
  ASSERT_EQ(compared.exit_code, 0) << compared.err;
  const json runs = json::parse(compared.out).at("runs");
  EXPECT_EQ(runs.at(0).at("switches"), 0);
  EXPECT_GT(runs.at(0).at("error_percent").get<double>(), 100.0);
  const std::string ranked = run_program(folder, "compare c.toml").out;
  EXPECT_LT(ranked.find("inverter_one_step"), ranked.find("idle"));
}

TEST(Systems, ListsHaveTheirOwnMotionsAndParameters) {
  const Folder folder;
  const auto kinds = [&](const char* system) {
    const ProgramRun listed = run_program(folder, std::string("list trajectories --format json --system ") + system);
    const json parsed = json::parse(listed.out);
    std::set<std::string> all;
    for (const json& motion : parsed.at("trajectories")) all.insert(motion.at("kind"));
    return all;
  };
  EXPECT_EQ(kinds("inverter"), (std::set<std::string>{"rotating"}));
  EXPECT_EQ(kinds("thrusters"), (std::set<std::string>{"cycloidal", "sine", "step", "multi_cycloid", "csv"}));
  EXPECT_EQ(json::parse(run_program(folder, "list parameters --format json --system inverter").out).at("parameters"),
            json::array());
}

}  // namespace
}  // namespace solenoid
