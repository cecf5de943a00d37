#include "core/config/reader.hpp"
#include "experiments/base/result.hpp"
#include "experiments/systems/actuator/sizing/size_output.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <array>
#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using test::Folder;
using test::run_program;
using testing::HasSubstr;
using testing::Not;

constexpr double pi = std::numbers::pi;
constexpr std::array laws = {ArmMotionLaw::cycloidal, ArmMotionLaw::quintic, ArmMotionLaw::cosine};

SizingQuantity quantity(const SizingInput& input, const std::string& name) {
  for (const SizingQuantity& q : sizing_quantities(input))
    if (q.name == name) return q;
  ADD_FAILURE() << "no " << name;
  return {};
}

ToothReading tooth(const SizingInput& input, const std::string& name) {
  for (const ToothReading& r : tooth_readings(input))
    if (r.name == name) return r;
  ADD_FAILURE() << "no " << name;
  return {};
}

TEST(ArmMotion, DerivativesAreTheDerivativesAndTheLargestAreReached) {
  for (const ArmMotionLaw law : laws) {
    const ArmMotion motion{law, 0.3, -2.1, 1.7};
    EXPECT_NEAR(arm_at(motion, 0.0).angle_rad, 0.3, 1e-12);
    EXPECT_NEAR(arm_at(motion, 1.7).angle_rad, 0.3 - 2.1, 1e-12);
    EXPECT_NEAR(arm_at(motion, 0.0).speed_rad_s, 0.0, 1e-12);
    EXPECT_NEAR(arm_at(motion, 1.7).speed_rad_s, 0.0, 1e-12);
    double speed = 0.0, acceleration = 0.0;
    constexpr double h = 1e-5;
    for (int i = 1; i < 3400; ++i) {
      const double t = i * 0.5e-3;
      const ArmSample before = arm_at(motion, t - h), at = arm_at(motion, t), after = arm_at(motion, t + h);
      EXPECT_NEAR((after.angle_rad - before.angle_rad) / (2 * h), at.speed_rad_s, 1e-7);
      EXPECT_NEAR((after.speed_rad_s - before.speed_rad_s) / (2 * h), at.acceleration_rad_s2, 1e-7);
      speed = std::max(speed, std::abs(at.speed_rad_s));
      acceleration = std::max(acceleration, std::abs(at.acceleration_rad_s2));
    }
    EXPECT_NEAR(speed, largest_speed(motion), 1e-5);
    EXPECT_NEAR(acceleration, largest_acceleration(motion), 1e-4 * acceleration);
  }
}

TEST(Sizing, TorquesAreTheEquations) {
  SizingTask task;
  task.payload_kg = 0.7;
  task.motion.from_rad = 0.2;
  for (const double t : {0.0, 0.4, 1.3, 2.9, 4.0}) {
    const ArmTorque torque = torque_at(task, t);
    const double s = t / 4, angle = 0.2 + pi * (s - std::sin(2 * pi * s) / (2 * pi));  // (3.1)
    EXPECT_NEAR(torque.angle_rad, angle, 1e-12);
    EXPECT_NEAR(torque.acceleration_nm,
                (0.5 * 0.35 * 0.35 / 3 + 0.7 * 0.35 * 0.35) * 2 * pi * pi / 16 * std::sin(2 * pi * s), 1e-12);  // (3.6)
    EXPECT_NEAR(torque.gravity_nm, (0.25 + 0.7) * 0.35 * 9.8 * std::sin(angle), 1e-12);                         // (3.8)
  }
}

TEST(Sizing, PeakIsNoLowerThanAnyPointOfTheCurve) {
  for (const ArmMotionLaw law : laws)
    for (const double move_s : {0.3, 1.0, 4.0, 60.0})
      for (const double from : {0.0, pi, -1.0}) {
        SizingTask task;
        task.motion = {law, from, pi, move_s};
        const double peak = std::abs(torque_peak(task).total_nm());
        for (const ArmTorque& t : torque_curve(task, 9999)) EXPECT_LE(std::abs(t.total_nm()), peak * (1 + 1e-9));
      }
}

TEST(Sizing, PeakOfASlowMotionIsGravitysAndOfAFlatOneTheAccelerations) {
  SizingTask task;
  task.motion.move_s = 1e4;
  EXPECT_NEAR(size_actuator(task).torque_nm, (0.25 + 0.5) * 0.35 * 9.8, 1e-6);
  task.motion.move_s = 4.0;
  task.vertical = false;
  const Sizing flat = size_actuator(task);
  EXPECT_NEAR(flat.torque_nm, flat.acceleration_torque_nm, 1e-12);
  EXPECT_EQ(flat.cylinder_n, flat.force_n);  // no weight of the slide to help
  // The peak with gravity, to second order in the ratio of the two torques: g + a^2/(2 g) at small a.
  task.vertical = true;
  const double g = 0.75 * 0.35 * 9.8, a = flat.acceleration_torque_nm;
  EXPECT_NEAR(size_actuator(task).torque_nm, g + a * a / (2 * g), 1e-5);
}

TEST(Sizing, ScalesWithPayloadPressureAndGear) {
  SizingTask task, twice;
  task.arm_mass_kg = task.slide_mass_kg = 0.0;
  twice = task;
  twice.payload_kg *= 2;
  const Sizing one = size_actuator(task), two = size_actuator(twice);
  EXPECT_NEAR(two.torque_nm, 2 * one.torque_nm, 1e-9);
  EXPECT_NEAR(two.force_n, 2 * one.force_n, 1e-9);
  EXPECT_NEAR(two.bore_m, std::sqrt(2.0) * one.bore_m, 1e-9);
  EXPECT_NEAR(two.motor_nm, 2 * one.motor_nm, 1e-9);
  EXPECT_NEAR(two.gear.safety, one.gear.safety / 2, 1e-9);
  SizingTask stronger = task;
  stronger.supply_gauge_pa *= 4;
  EXPECT_NEAR(size_actuator(stronger).bore_m, one.bore_m / 2, 1e-9);
  double before = 0.0;
  for (double payload = 0.0; payload < 3.0; payload += 0.25) {
    SizingTask heavier;
    heavier.payload_kg = payload;
    const double torque = size_actuator(heavier).torque_nm;
    EXPECT_GT(torque, before);
    before = torque;
  }
}

TEST(Sizing, AMotionOnTheOtherSideMustPullAndLoadsTheGearAsMuch) {
  SizingTask task, mirrored;
  mirrored.motion = {ArmMotionLaw::cycloidal, 2 * pi, -pi, 4.0};
  const Sizing push = size_actuator(task), pull = size_actuator(mirrored);
  EXPECT_NEAR(pull.torque_nm, -push.torque_nm, 1e-9);
  EXPECT_NEAR(pull.gear.safety, push.gear.safety, 1e-9);
  EXPECT_NEAR(pull.cylinder_n, -push.force_n - 1.17 * 9.8, 1e-9);
  EXPECT_NEAR(force_of_bore(pull.bore_m, 150e3, 0.00635), -pull.cylinder_n, 1e-9);
}

TEST(Sizing, BoreAndForceAreInverse) {
  for (const double force : {0.0, 1.0, 61.33, 5000.0})
    for (const double rod : {0.0, 0.00635})
      EXPECT_NEAR(force_of_bore(bore_for_force(force, 150e3, rod), 150e3, rod), force, 1e-9 * (1 + force));
  EXPECT_THROW(bore_for_force(-1.0, 150e3), std::invalid_argument);
  const std::vector<double> standard = {0.016, 0.020, 0.025};
  EXPECT_EQ(next_standard(standard, 0.0201), 0.025);
  EXPECT_EQ(next_standard(standard, 0.020), 0.020);
  EXPECT_EQ(next_standard(standard, 0.0251), std::nullopt);
}

TEST(Sizing, FullForcesAddTheSlidesInertiaAndFrictionAndTheWayBack) {
  SizingTask task;
  task.coulomb_friction_n = task.viscous_friction = 0.0;
  task.slide_mass_kg = 0.0;
  CylinderForces f = full_cylinder_forces(task);
  EXPECT_NEAR(f.push_n, size_actuator(task).cylinder_n, 1e-6);  // then it is the formula's
  task.coulomb_friction_n = 3.0;
  EXPECT_NEAR(full_cylinder_forces(task).push_n, f.push_n + 3.0, 1e-6);
  task.vertical = false;  // as much on the way back
  f = full_cylinder_forces(task);
  EXPECT_NEAR(f.push_n, f.pull_n, 1e-9);
}

TEST(Tooth, FormFactorsAreShigleysAndRise) {
  EXPECT_DOUBLE_EQ(lewis_form_factor(20), 0.322);
  EXPECT_DOUBLE_EQ(lewis_form_factor(100), 0.447);  // what (A.7) has
  EXPECT_LT(lewis_form_factor(100000), 0.485);
  EXPECT_NEAR(lewis_form_factor(100000), 0.485, 1e-4);
  for (int n = 12; n < 1000; ++n) EXPECT_LT(lewis_form_factor(n), lewis_form_factor(n + 1));
  EXPECT_THROW(lewis_form_factor(11), std::invalid_argument);
}

TEST(ThesisSizing, PrintsTheThesissFigures) {
  const std::string text = result_of(thesis_sizing()).text(false);
  for (const char* figure : {"2.73", "72.8", "61.33", "22.8", "0.055", "121.5", "1.97", "2.28", "3.25"})
    EXPECT_THAT(text, HasSubstr(figure));
}

TEST(ThesisSizing, EachStepFromPrintedValuesIsPrintedButForThree) {
  for (const SizingQuantity& q : sizing_quantities(thesis_sizing())) {
    ASSERT_TRUE(q.printed) << q.name;
    const bool differs = q.name == "torque" || q.name == "speed" || q.name == "load_factor";
    EXPECT_EQ(q.own_difference(), differs) << q.name;
  }
  EXPECT_NEAR(quantity(thesis_sizing(), "torque").computed, 2.5745, 1e-4);
  EXPECT_NEAR(quantity(thesis_sizing(), "speed").computed, pi / 2, 1e-12);
  EXPECT_NEAR(*quantity(thesis_sizing(), "load_factor").stepped, 1.4508, 1e-4);
  EXPECT_EQ(sizing_differences(thesis_sizing()).size(), 5U);  // and two notes
}

TEST(ThesisSizing, AppendixAThreeWays) {
  EXPECT_NEAR(tooth(thesis_sizing(), "as printed").safety, 1.97, 0.005);
  EXPECT_NEAR(1e-6 * tooth(thesis_sizing(), "as printed").stress_pa, 121.53, 0.02);
  EXPECT_NEAR(tooth(thesis_sizing(), "corrected to (A.2)").safety, 2.28, 0.005);
  EXPECT_NEAR(tooth(thesis_sizing(), "standard formula, (A.3)").safety, 3.25, 0.005);
}

TEST(SizingTaskFile, WhatItLeavesOutIsTheThesissButForTheBoreAndThePrintedFigures) {
  const Folder folder;
  const SizingInput input = read_sizing_file(folder.write("crane.toml", "[arm]\npayload_kg = 2.0\n"));
  EXPECT_EQ(input.task.name, "crane");
  EXPECT_EQ(input.task.payload_kg, 2.0);
  EXPECT_EQ(input.task.arm_mass_kg, 0.5);
  EXPECT_FALSE(input.task.bore_m);
  EXPECT_TRUE(input.printed.empty());
  EXPECT_TRUE(sizing_differences(input).empty());
  EXPECT_THAT(result_of(input).text(false), Not(HasSubstr("printed")));
  const SizingInput set = with_settings(thesis_sizing(), {"arm.payload_kg=0.1", "motion.kind=\"quintic\""});
  EXPECT_EQ(set.task.payload_kg, 0.1);
  EXPECT_EQ(set.task.motion.law, ArmMotionLaw::quintic);
  EXPECT_EQ(set.task.motion.move_s, 4.0);
  EXPECT_TRUE(set.printed.empty());
}

TEST(SizingTaskFile, DefaultsOfTheTypeAreThoseOfTheThesissFile) {
  const SizingTask file = thesis_sizing().task, type;
  EXPECT_NEAR(size_actuator(file).torque_nm, size_actuator(type).torque_nm, 1e-12);
  EXPECT_NEAR(size_actuator(file).gear.safety, size_actuator(type).gear.safety, 1e-12);
  EXPECT_NEAR(size_actuator(file).full.pull_n, size_actuator(type).full.pull_n, 1e-12);
  EXPECT_NEAR(*file.bore_m, *type.bore_m, 1e-15);
}

TEST(SizingTaskFile, BadOnesAreRefusedWithFileKeyAndWhatIsAllowed) {
  const Folder folder;
  struct Case {
    const char *text, *key, *allowed;
  };
  for (const Case& c :
       {Case{"[arm]\npayload = 1", "arm.payload", "payload_kg"}, Case{"plane = \"sloping\"", "plane", "horizontal"},
        Case{"[motion]\nmove_s = 0", "motion.move_s", "above 0 to 3600"},
        Case{"[motion]\ntotal_deg = 0", "motion.total_deg", "not 0"},
        Case{"[motion]\nkind = \"jump\"", "motion.kind", "quintic"}, Case{"[gear]\nteeth = 11", "gear.teeth", "12"},
        Case{"[cylinder]\nbore_mm = 6", "cylinder.bore_mm", "rod_mm less than bore_mm"},
        Case{"[cylinder]\nstandard_bores_mm = [20, 16]", "cylinder.standard_bores_mm", "rising"},
        Case{"[cylinder]\nstandard_bores_mm = []", "cylinder.standard_bores_mm", "at least one"},
        Case{"[motor]\nshare = 1.5", "motor.share", "0 to 1"},
        Case{"[arm]\nmass_kg = 0\npayload_kg = 0", "arm", "above 0"},
        Case{"[printed]\ntorque = { value = \"2,73\" }", "printed.torque.value", "digits"},
        Case{"[printed]\nweight = { value = \"2\" }", "printed.weight", "safety_factor"}}) {
    const std::string path = folder.write("bad.toml", c.text);
    const auto run = run_program({"size", path});
    EXPECT_EQ(run.exit_code, 2) << c.text;
    EXPECT_THAT(run.err, HasSubstr("bad.toml:")) << c.text;
    EXPECT_THAT(run.err, HasSubstr(fmt::format("'{}'", c.key))) << c.text;
    EXPECT_THAT(run.err, HasSubstr(c.allowed)) << c.text;
    EXPECT_EQ(run.out, "") << c.text;
  }
  EXPECT_EQ(run_program({"size", folder.file("none.toml")}).exit_code, 2);
  EXPECT_EQ(run_program({"size", "--set", "payload"}).exit_code, 2);
  EXPECT_EQ(run_program({"size", "--format", "xml"}).exit_code, 2);
}

TEST(SizeCommand, JsonCsvAndFigure) {
  const Folder folder;
  const auto json = nlohmann::json::parse(run_program({"size", "--format", "json"}).out);
  EXPECT_EQ(json.at("quantities").size(), 14U);
  EXPECT_EQ(json.at("curve").size(), 401U);
  EXPECT_NEAR(json.at("peak").at("torque_nm").get<double>(), 2.5745, 1e-4);
  EXPECT_EQ(json.at("standard_bore_mm").get<double>(), 25.0);
  EXPECT_THAT(run_program({"size", "--format", "csv"}).out, HasSubstr("cylinder_force,N,(3.11),61.33,"));
  const std::string svg = folder.file("torque.svg");
  EXPECT_EQ(run_program({"size", "--svg", svg}).exit_code, 0);
  EXPECT_THAT(test::text_of(svg), HasSubstr("peak, 2.574 N m"));
  EXPECT_EQ(run_program({"size", "--svg", folder.file("torque.pdf")}).exit_code, 2);
}

}  // namespace
}  // namespace solenoid
