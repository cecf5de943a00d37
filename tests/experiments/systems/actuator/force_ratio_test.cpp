#include "experiments/systems/actuator/force_ratio/force_ratio.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/result.hpp"
#include "experiments/systems/actuator/sizing/size_task.hpp"
#include "experiments/systems/actuator/twin/twin_parameters.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using test::Folder;
using test::run_program;
using testing::ElementsAre;
using testing::HasSubstr;

const SizingTask& task() { return thesis_sizing().task; }
const RatioAssumptions& assumed() { return shipped_ratio_assumptions(); }

TEST(RatioDesign, CapabilityIsTheSameAtEveryRatioAndTheThesissShareIsItsRig) {
  const double capability = 1.34 * size_actuator(task()).cylinder_n;
  double bore = 1.0, torque = 0.0;
  for (const double share : {0.0, 0.01, 0.104, 0.3, 0.9, 1.0}) {
    const RatioDesign d = design_ratio(share, task(), assumed());
    EXPECT_NEAR(d.cylinder_n + d.motor_n, capability, 1e-9);
    EXPECT_NEAR(force_of_bore(d.bore_m, task().supply_gauge_pa), d.cylinder_n, 1e-9);
    EXPECT_NEAR(d.motor_torque_nm, d.motor_n * d.pinion_m / 2, 1e-12);
    EXPECT_LT(d.bore_m, bore);
    EXPECT_GE(d.motor_torque_nm, torque);
    bore = d.bore_m;
    torque = d.motor_torque_nm;
  }
  const RatioDesign rig = design_ratio(0.104, task(), assumed());
  EXPECT_NEAR(1e3 * rig.bore_m, 24.13, 0.05);
  EXPECT_NEAR(rig.motor_n, 8.0, 0.05);
  EXPECT_NEAR(rig.motor_torque_nm, 0.06, 0.001);
}

TEST(RatioDesign, MassAndPriceAreTheStatedLaws) {
  const RatioAssumptions& a = assumed();
  const RatioDesign cylinder = design_ratio(0.0, task(), a), motor = design_ratio(1.0, task(), a);
  EXPECT_NEAR(cylinder.mass_kg, 0.6 + 0.35 * std::pow(1e3 * cylinder.bore_m / 24.13, 1.5), 1e-12);
  EXPECT_NEAR(cylinder.price, 380 + 150 * std::sqrt(1e3 * cylinder.bore_m / 24.13), 1e-9);
  const double torque = motor.motor_torque_nm / 0.11;
  EXPECT_NEAR(motor.mass_kg, 0.48 * std::pow(torque, 0.8) + 0.2 * std::sqrt(torque), 1e-12);
  EXPECT_NEAR(motor.price, 350 * std::pow(torque, 0.7) + 250 * std::sqrt(torque), 1e-9);
  EXPECT_NEAR(motor.motor_constant, 0.056 * std::pow(torque, 0.8 * 5 / 6), 1e-12);
  EXPECT_NEAR(motor.motor_inertia, 1.38e-5 * std::pow(torque, 0.8 * 5 / 3), 1e-15);
  EXPECT_EQ(design_ratio(0.01, task(), a).motor_inertia, 1e-6);  // what the truth plant takes
  EXPECT_EQ(cylinder.motor_n, 0.0);
  EXPECT_EQ(motor.bore_m, 0.0);
}

TEST(RatioDesign, ThePinionIsTheLeastWhoseToothIsSafe) {
  RatioAssumptions a = assumed();
  a.safety_factor = 4.0;
  const RatioDesign d = design_ratio(1.0, task(), a);
  EXPECT_GE(d.pinion_safety, 4.0);
  const auto chosen = std::ranges::find(a.modules_m, d.module_m);
  ASSERT_NE(chosen, a.modules_m.begin());
  EXPECT_LT(d.pinion_safety * *(chosen - 1) / d.module_m, 4.0);  // a tooth is as strong as its module
  EXPECT_NEAR(d.pinion_m, 20 * d.module_m, 1e-15);
  a.safety_factor = 1000.0;
  try {
    design_ratio(1.0, task(), a);
    ADD_FAILURE() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("capability.modules_mm"));
  }
}

TEST(RatioCriteria, EnergyIsCopperMotoringAndTheAirsIsothermalWork) {
  const RatioDesign d = design_ratio(0.2, task(), assumed());
  RatioMeasured m;
  m.rmse_mm = 0.02;
  m.air_g = 0.4;
  m.force_square_ns = 80.0;
  m.motoring_j = 1.5;
  const RatioCriteria c = criteria_of(d, m, task(), assumed());
  EXPECT_NEAR(c.electric_j, 80.0 * std::pow(d.pinion_m / 2 / d.motor_constant, 2) + 1.5, 1e-12);
  EXPECT_NEAR(c.air_j, 0.4e-3 * 287 * 293 * std::log(251325.0 / 101325.0) / 0.5, 1e-9);
  EXPECT_NEAR(c.score, std::log(c.error_mm * c.energy_j() * c.mass_kg * c.price), 1e-12);
  m.rmse_mm *= 2;
  EXPECT_NEAR(criteria_of(d, m, task(), assumed().with({"", "weights.error", 3.0})).score,
              c.score + 3 * std::log(0.04) - std::log(0.02), 1e-12);
}

RatioCriteria criteria(double error, double energy, double mass, double price) {
  RatioCriteria c{error, energy, 0.0, mass, price, 0.0};
  c.score = std::log(error * energy * mass * price);
  return c;
}

TEST(RatioCriteria, TheFrontAndTheRecommendation) {
  const std::vector<RatioCriteria> c = {criteria(1, 4, 1, 1), criteria(2, 1, 1, 1), criteria(2, 1, 1, 1.5),
                                        criteria(3, 5, 2, 2)};
  EXPECT_THAT(efficient(c), ElementsAre(true, true, false, false));
  std::vector<RatioMeasured> m(4);
  EXPECT_EQ(recommended(c, m), 1);
  m[1].bad = 1;
  EXPECT_EQ(recommended(c, m), 2);
  for (RatioMeasured& each : m) each.bad = 1;
  EXPECT_EQ(recommended(c, m), -1);
}

TEST(RatioStudy, VerdictsFollowTheAssumptionsWithoutARun) {
  RatioStudy study{task(), assumed(), {}, "none", false};
  for (const double share : {0.0, 0.104, 1.0}) {
    RatioResult r;
    r.design = design_ratio(share, task(), assumed());
    r.law = "hybrid";
    r.measured.rmse_mm = 0.02;
    r.measured.runs = 12;
    r.measured.air_g = 0.4 * (1 - share);
    r.measured.force_square_ns = share * 1000;
    study.ratios.push_back(r);
  }
  study.assumptions.changes = {{"free motors", "motor.price", 1e-9}, {"the same", "weights.mass", 1.0}};
  const std::vector<RatioVerdict> verdicts = verdicts_of(study);
  ASSERT_EQ(verdicts.size(), 3U);
  EXPECT_EQ(verdicts[0].share, verdicts[2].share);
  EXPECT_NEAR(verdicts[0].lead, verdicts[2].lead, 1e-12);
  for (const RatioVerdict& v : verdicts) {
    EXPECT_GE(v.lead, 0.0);
    EXPECT_EQ(v.hybrid_share, 0.104);
  }
  EXPECT_LT(criteria_of(study, assumed().with(study.assumptions.changes[0]))[2].price, study.ratios[2].design.price);
  EXPECT_THROW(assumed().with({"", "motor.colour", 2.0}), std::invalid_argument);
  EXPECT_THAT(result_of(study).text(false), HasSubstr("Recommended: a motor's share of"));
}

TEST(RatioAssumptions, AFileNamesWhatDiffersAndBadOnesAreRefused) {
  const Folder folder;
  const RatioAssumptions own = read_ratio_assumptions(folder.write("own.toml", "[motor]\nprice = 100\n"));
  EXPECT_EQ(own.motor_price, 100.0);
  EXPECT_EQ(own.motor_mass_kg, assumed().motor_mass_kg);
  EXPECT_EQ(own.changes.size(), assumed().changes.size());
  struct Case {
    const char *text, *key, *allowed;
  };
  for (const Case& c :
       {Case{"[motor]\ncolour = 1", "motor.colour", "price"}, Case{"[motor]\nprice = -1", "motor.price", ">= 0"},
        Case{"[wheels]\nmass_kg = 1", "wheels", "motor"},
        Case{"[air_side]\ncompressor_efficiency = 2", "air_side.compressor_efficiency", "1"},
        Case{"[capability]\nmodules_mm = [2, 1]", "capability.modules_mm", "rising"},
        Case{"[[sensitivity]]\nname = 'a'\nkey = 'motor.colour'\nfactor = 2", "key", "SECTION.KEY"}}) {
    const auto run = run_program(
        {"study", "force-ratio", "--assumptions", folder.write("bad.toml", c.text), "--out", folder.file("none")});
    EXPECT_EQ(run.exit_code, 2) << c.text;
    EXPECT_THAT(run.err, HasSubstr("bad.toml:")) << c.text;
    EXPECT_THAT(run.err, HasSubstr(c.key)) << c.text;
    EXPECT_THAT(run.err, HasSubstr(c.allowed)) << c.text;
  }
  EXPECT_EQ(run_program({"study", "force-ratio", "--shares", "0.1,0.1", "--out", folder.file("none")}).exit_code, 2);
  EXPECT_EQ(run_program({"study", "force-ratio", "--shares", "1.1"}).exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(folder.file("none")));
}

TEST(ForceRatioCommand, TunesAndJudgesEachRatioOnItsOwnPlantAndResumesWithoutARun) {
  const Folder folder;
  const std::string command =
      "study force-ratio --quick --shares 1,0.3 --evaluations 1 --plants 1 --judged 1 --out o --format json";
  const auto first = run_program(folder, command + " --svg front.svg");
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const auto json = nlohmann::json::parse(first.out);
  ASSERT_EQ(json.at("ratios").size(), 2U);
  EXPECT_EQ(json.at("ratios")[0].at("share").get<double>(), 0.3);
  EXPECT_EQ(json.at("ratios")[1].at("law").get<std::string>(), "motor");
  for (const auto& ratio : json.at("ratios")) {
    EXPECT_EQ(ratio.at("bad").get<int>(), 0);
    EXPECT_EQ(ratio.at("runs").get<int>(), 2);
    EXPECT_GT(ratio.at("electric_j").get<double>(), 0.0);
  }
  EXPECT_EQ(json.at("ratios")[1].at("air_g").get<double>(), 0.0);
  EXPECT_THAT(test::text_of(folder.file("front.svg")), HasSubstr("0.3"));

  const TwinParameters twin = read_twin_file(folder.file("o/share-0.300/hybrid/twin.toml"));
  const RatioDesign design = design_ratio(0.3, task(), assumed());
  EXPECT_NEAR(twin.actuator.bore_diameter_m, design.bore_m, 1e-12);
  EXPECT_NEAR(twin.actuator.motor_force_limit_n(), design.motor_n, 1e-9);
  EXPECT_NEAR(twin.gear.rotor_inertia, design.motor_inertia, 1e-12);
  const double area = std::pow(design.bore_m / ActuatorParameters().bore_diameter_m, 2);
  EXPECT_NEAR(twin.actuator.choked_flow, area * ActuatorParameters().choked_flow, 1e-12);

  const std::string elsewhere = [&] {
    std::string text = command;
    return text.replace(text.find("--out o"), 7, "--out i");
  }();
  const auto cut = run_program(folder, elsewhere, "timeout --preserve-status -s INT 0.5");
  EXPECT_TRUE(cut.exit_code == 130 || cut.exit_code == 0) << cut.err;
  const auto resumed = run_program(folder, elsewhere);
  EXPECT_EQ(nlohmann::json::parse(resumed.out).at("ratios"), json.at("ratios"));

  const std::string history = test::text_of(folder.file("o/share-1.000/motor/history.csv"));
  const auto second = run_program(folder, command);
  EXPECT_EQ(second.exit_code, 0);
  EXPECT_EQ(second.out, first.out);
  EXPECT_EQ(test::text_of(folder.file("o/share-1.000/motor/history.csv")), history);
}

}  // namespace
}  // namespace solenoid
