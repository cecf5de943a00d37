#include "controllers/factory.hpp"
#include "core/config/document.hpp"
#include "core/config/reader.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/rig/faulty_plant.hpp"
#include "experiments/rig/rig_file.hpp"

#include <cmath>
#include <string>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// What became of a run on a plant without noise: the cycloid's dwell of a second, then 0.1 m in four.
struct QuietRun {
  std::int64_t safe_entries = 0;
  double safe_s = -1.0;  ///< when SAFE was entered
  FaultSet causes;
  double largest_error_m = 0.0;
  double moved_by_s = -1.0;  ///< when the reference had moved by a millimetre since the fault
};

/// `plant`: keys of the scenario; `fault`: in the grammar of fault_script.hpp, or empty.
QuietRun quiet_run(const std::string& variant_name, const std::string& plant, const std::string& fault = "",
                   double until_s = 8.0) {
  const std::string text = "variants = [\"" + variant_name +
                           "\"]\nseeds = [1]\n[[scenario]]\nname = \"quiet\"\ntrajectory = { kind = \"cycloidal\" }\n" +
                           plant;
  const Campaign campaign = read_campaign(Document::from_text(text, "quiet.toml"), {});
  const ScenarioConfig& scenario = campaign.scenarios.front();
  const VariantConfig variant = told(campaign.variants.front(), scenario);
  RigFile rig = usual_rig(variant);
  expect_noise(rig, simulation_of(*campaign.system).noise(scenario));
  std::vector<InjectedFault> faults;
  if (!fault.empty()) faults = parse_faults({fault}, simulation_of(*campaign.system));
  FaultyPlant simulated(make_plant(variant, scenario, 1), faults, variant, 1);
  const auto ladder = make_ladder(variant, scenario.trajectory, rig.ladder);
  CommandLimits limits = make_limits(variant);
  struct Recorder {
    QuietRun& out;
    double fault_s, from = NAN;
    void record(const TickRecord& t) {
      const double reference = t.decision.reference.axis[0].value;
      out.largest_error_m = std::max(out.largest_error_m, std::abs(reference - t.sensors.truth[position]));
      if (t.sensors.time_s >= fault_s && std::isnan(from)) from = reference;
      if (out.moved_by_s < 0 && std::abs(reference - from) > 1e-3) out.moved_by_s = t.sensors.time_s;
      if (t.decision.rung == Rung::safe && out.safe_s < 0)
        out.safe_s = t.sensors.time_s, out.causes = t.decision.safe_causes;
    }
  };
  QuietRun out;
  Recorder recorder{out, faults.empty() ? 0.0 : faults.front().from_s};
  FakeClock clock;
  ControlLoop loop(simulated, clock, *ladder, limits, recorder);
  loop.run(variant.timing.ticks_in(until_s), variant.timing.tick_s, [] { return false; });
  out.safe_entries = ladder->counts().safe_entries;
  return out;
}

constexpr const char* quiet_twin = "plant = \"twin\"\nnoise = false\nsensing = \"measured\"\n";
constexpr const char* loaded_twin =
    "plant = \"twin\"\nnoise = false\nsensing = \"measured\"\npayload_kg = 0.15\nmismatch = { friction = 1.5 }\n";
constexpr double motion_s = 2.0;  // the cycloid's dwell

class QuietPlant : public testing::TestWithParam<std::tuple<const char*, const char*>> {
 protected:
  static QuietRun run(const std::string& fault = "", double until_s = 8.0) {
    return quiet_run(std::get<0>(GetParam()), std::get<1>(GetParam()), fault, until_s);
  }
};

INSTANTIATE_TEST_SUITE_P(NoiseFreeTwin, QuietPlant,
                         testing::Combine(testing::Values("nine_state", "nine_robust"),
                                          testing::Values(quiet_twin, loaded_twin)),
                         [](const auto& of) {
                           return std::string(std::get<0>(of.param)) +
                                  (std::get<1>(of.param) == quiet_twin ? "_nominal" : "_loaded");
                         });

TEST_P(QuietPlant, RestsAndMovesForEightSecondsWithoutAFault) {
  const QuietRun quiet = run();
  EXPECT_EQ(quiet.safe_entries, 0) << to_string(quiet.causes, actuator_description());
  EXPECT_LT(quiet.largest_error_m, 2e-3);
}

/// A slide that rests and shows it looks the same whether or not its sensor is stuck; once it should move, it does not.
TEST_P(QuietPlant, ASensorThatSticksAtRestIsFoundBeforeTheReferenceHasMovedAMillimetre) {
  for (const char* fault : {"position:stuck@0.5", "position:stuck@1.9"}) {
    const QuietRun stuck = run(fault, 3.0);
    EXPECT_EQ(stuck.safe_entries, 1);
    EXPECT_GT(stuck.safe_s, motion_s) << fault;
    EXPECT_LT(stuck.safe_s, stuck.moved_by_s) << fault;
    EXPECT_TRUE(stuck.causes.has(position_channel, SensorFault::stuck))
        << to_string(stuck.causes, actuator_description());
  }
}

TEST_P(QuietPlant, ASensorThatSticksInMotionIsFoundWithin150Milliseconds) {
  for (const double at : {3.5, 5.5}) {
    const QuietRun stuck = run("position:stuck@" + std::to_string(at), at + 1.0);
    EXPECT_EQ(stuck.safe_entries, 1);
    EXPECT_GE(stuck.safe_s, at);
    EXPECT_LT(stuck.safe_s, at + 0.150);
    EXPECT_TRUE(stuck.causes.any(position_channel)) << to_string(stuck.causes, actuator_description());
  }
}

TEST(ExpectedNoise, IsTheScenariosUnlessTheRigsFileStatesIt) {
  const VariantConfig variant = new_variant();
  const auto ticks_of = [&](const std::string& calibration, const std::vector<ChannelNoise>& of_plant) {
    RigFile rig = read_rig(TableReader::from_text(calibration, "rig.toml"), variant);
    expect_noise(rig, of_plant);
    EXPECT_EQ(rig.ladder.plausibility.channels[pressure_a_channel].stuck_ticks, 0);
    return rig.ladder.plausibility.channels[position_channel].stuck_ticks;
  };
  const double step = 0.12 / 8192;
  EXPECT_EQ(ticks_of("", {}), 100);
  EXPECT_EQ(ticks_of("", {{2e-5, step}, {}, {}}), 100);  // 22 would do
  EXPECT_EQ(ticks_of("", {{0.0, step}, {}, {}}), 0);
  EXPECT_EQ(ticks_of("", {{step / 4, step}, {}, {}}), stuck_ticks_of({step / 4, step}));
  EXPECT_GT(stuck_ticks_of({step / 4, step}), 100);
  EXPECT_EQ(ticks_of("[calibration]\nposition = { noise_v = 0.0 }\n", {{2e-5, step}, {}, {}}), 0);
  EXPECT_EQ(ticks_of("[calibration]\nposition = { noise_v = 0.002 }\n", {{0.0, step}, {}, {}}), 100);
  EXPECT_EQ(ticks_of("[calibration]\nposition = { noise_v = 0.002, bits = 10 }\n", {}),
            stuck_ticks_of({0.012 * 0.002, 0.12 / 1024}));
  EXPECT_THROW(ticks_of("[calibration]\nposition = { noise_v = -1 }\n", {}), ConfigError);
  EXPECT_THROW(ticks_of("[calibration]\nposition = { bits = 0 }\n", {}), ConfigError);
  EXPECT_THROW(ticks_of("[calibration]\nmotor = { noise_v = 0.1 }\n", {}), ConfigError);
}

}  // namespace
}  // namespace solenoid
