// Servo variants on the rig: their commands in logs, packets, calibration and faults, and nobody else's.
#include "controllers/systems/actuator/actuator_guard.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/rig/calibration.hpp"
#include "experiments/rig/log/recorded_run.hpp"
#include "experiments/rig/log/run_log.hpp"
#include "experiments/rig/plants.hpp"
#include "experiments/rig/rig_file.hpp"
#include "experiments/rig/udp_io.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using test::Folder;
using ::testing::HasSubstr;
using ::testing::Not;

TickRecord servo_tick(int k) {
  TickRecord t;
  t.sensors = {1e-3 * k, {0.1 / 3, 150123.456789, 1e5 / 7}};
  t.decision.command = {0, {-1.0 / 3, 1.0 / 7, -1.0 / 9}};
  t.applied = {0, {-1.0 / 3, 1.0 / 7, -1.0 / 11}};
  return t;
}

std::string logged(const Folder& folder, const std::map<std::string, std::string>& about) {
  RunLogSettings settings;
  settings.system = &servo_description();
  settings.folder = (folder / "").string();
  settings.about = about;
  RunLog log(settings, [](const TickRecord&) {});
  for (int k = 0; k < 20; ++k) log.record(servo_tick(k));
  EXPECT_EQ(log.close({}), "");
  return log.path();
}

TEST(ServoLog, KeepsTheCommandsThatAReplayNeeds) {
  const Folder folder;
  const RecordedRun run = read_run(logged(folder, {{"inputs", input_names(servo_description())}}));
  EXPECT_EQ(run.system, &servo_description());
  ASSERT_EQ(run.ticks.size(), 20u);
  EXPECT_EQ(run.ticks[3].applied, servo_tick(3).applied);
  EXPECT_EQ(run.ticks[3].decision.command, servo_tick(3).decision.command);
}

TEST(ServoLog, OfUnknownInputsIsRefused) {
  const Folder folder;
  const std::string path = logged(folder, {{"inputs", "motor pump"}});
  try {
    read_run(path);
    ADD_FAILURE() << "not refused";
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("motor pump"));
    EXPECT_THAT(error.what(), HasSubstr("'motor valve_a valve_b'"));
  }
}

TEST(ServoLog, OthersHaveNoColumnsOfIt) {
  EXPECT_THAT(TickFormat(actuator_description()).csv_heading(), Not(HasSubstr("valve_a")));
  EXPECT_THAT(TickFormat(servo_description()).csv_heading(), HasSubstr("valve_b_decided"));
}

TEST(ServoRig, NodeAndConverterAreToldOfTheCommands) {
  const VariantConfig servo = shipped_variant("servo_robust"), nine = shipped_variant("nine_robust");
  EXPECT_THAT(node_wire(servo).text, HasSubstr("continuous: motor [N] valve_a [1] valve_b [1]"));
  EXPECT_EQ(node_wire(servo).continuous, 3u);
  EXPECT_THAT(node_wire(nine).text, Not(HasSubstr("valve_a")));
  const RigFile rig = usual_rig(servo);
  ASSERT_EQ(rig.calibration.continuous.size(), 3u);
  EXPECT_NEAR(rig.calibration.continuous[opening_a_input].value(2.5), 0.5, 1e-12);
  EXPECT_EQ(rig.comedi.outputs.size(), 3u);
  EXPECT_TRUE(rig.comedi.switch_channels.empty());
  TableReader own =
      TableReader::from_text("valve_b = { offset = 0.01, gain = 0.1 }\nvalve_b_limit_v = 10.0", "rig.toml");
  EXPECT_NEAR(read_calibration(own, servo).continuous[opening_b_input].value(10.0), 1.01, 1e-12);
  TableReader other = TableReader::from_text("valve_b = { offset = 0.01, gain = 0.1 }", "rig.toml");
  EXPECT_THROW(read_calibration(other, nine), ConfigError);
}

TEST(ServoRig, AGuardShutsTheValvesWhereNoPlanComes) {
  const VariantConfig v = shipped_variant("servo_robust");
  const auto guard = system_of(v).guard(v);
  EXPECT_EQ(guard->held_inputs({3.0, 0.7, -0.2}), (ContinuousValues{3.0}));
  const VariantConfig nine = shipped_variant("nine_robust");
  EXPECT_EQ(system_of(nine).guard(nine)->held_inputs({3.0}), (ContinuousValues{3.0}));
}

TEST(ServoRig, FaultsOfTheValvesSpoilTheirCommands) {
  const VariantConfig v = shipped_variant("servo_robust");
  const SimulatedSystem& system = simulation_of(system_of(v));
  const Command wanted{0, {2.0, 0.5, -0.4}}, last{0, {1.0, 0.1, 0.2}};
  const auto reached = [&](const char* target, const char* kind) {
    return system.spoiled(v, {target, kind}, wanted, last).continuous;
  };
  EXPECT_EQ(reached("valves", "stuck"), (ContinuousValues{2.0, 0.1, 0.2}));
  EXPECT_EQ(reached("valves", "swapped"), (ContinuousValues{2.0, -0.4, 0.5}));
  EXPECT_EQ(reached("supply", "lost"), (ContinuousValues{2.0, 0.0, -0.4}));
}

}  // namespace
}  // namespace solenoid
