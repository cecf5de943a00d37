#include "controllers/factory.hpp"
#include "core/config/document.hpp"
#include "core/config/reader.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/rig/faulty_plant.hpp"
#include "experiments/rig/plants.hpp"
#include "experiments/rig/replay_run.hpp"

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
  double moved_m = 0.0;      ///< how far the reference had moved from the fault to SAFE
};

/// What a run is of, besides variant and plant.
struct QuietTask {
  std::string fault;  ///< in the grammar of fault_script.hpp, or empty
  double until_s = 8.0;
  std::string motion = "";  ///< keys of the cycloid
  std::string rig = "";     ///< the rig's file
};

std::string quiet_campaign(const std::string& variant_name, const std::string& plant, const std::string& motion = "") {
  return "variants = [\"" + variant_name +
         "\"]\nseeds = [1]\n[[scenario]]\nname = \"quiet\"\ntrajectory = { kind = \"cycloidal\"" + motion + " }\n" +
         plant;
}

/// `plant`: keys of the scenario.
QuietRun quiet_run(const std::string& variant_name, const std::string& plant, const QuietTask& task) {
  const std::string text = quiet_campaign(variant_name, plant, task.motion);
  const Campaign campaign = read_campaign(Document::from_text(text, "quiet.toml"), {});
  const ScenarioConfig& scenario = campaign.scenarios.front();
  const VariantConfig variant = told(campaign.variants.front(), scenario);
  RigFile rig = read_rig(TableReader::from_text(task.rig, "rig.toml"), variant);
  expect_noise(rig, simulation_of(*campaign.system).noise(scenario));
  std::vector<InjectedFault> faults;
  if (!task.fault.empty()) faults = parse_faults({task.fault}, simulation_of(*campaign.system));
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
        out.safe_s = t.sensors.time_s, out.causes = t.decision.safe_causes, out.moved_m = std::abs(reference - from);
    }
  };
  QuietRun out;
  Recorder recorder{out, faults.empty() ? 0.0 : faults.front().from_s};
  FakeClock clock;
  ControlLoop loop(simulated, clock, *ladder, limits, recorder);
  loop.run(variant.timing.ticks_in(task.until_s), variant.timing.tick_s, [] { return false; });
  out.safe_entries = ladder->counts().safe_entries;
  return out;
}

constexpr const char* quiet_twin = "plant = \"twin\"\nnoise = false\nsensing = \"measured\"\n";
constexpr const char* loaded_twin =
    "plant = \"twin\"\nnoise = false\nsensing = \"measured\"\npayload_kg = 0.15\nmismatch = { friction = 1.5 }\n";
constexpr double motion_s = 2.0;  // the cycloid's dwell

class QuietPlant : public testing::TestWithParam<std::tuple<const char*, const char*>> {
 protected:
  static QuietRun run(const QuietTask& task = {}) {
    return quiet_run(std::get<0>(GetParam()), std::get<1>(GetParam()), task);
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
    const QuietRun stuck = run({fault, 3.0});
    EXPECT_EQ(stuck.safe_entries, 1);
    EXPECT_GT(stuck.safe_s, motion_s) << fault;
    EXPECT_LT(stuck.safe_s, stuck.moved_by_s) << fault;
    EXPECT_TRUE(stuck.causes.has(position_channel, SensorFault::stuck))
        << to_string(stuck.causes, actuator_description());
  }
}

TEST_P(QuietPlant, ASensorThatSticksInMotionIsFoundWithin150Milliseconds) {
  for (const double at : {3.5, 5.5}) {
    const QuietRun stuck = run({"position:stuck@" + std::to_string(at), at + 1.0});
    EXPECT_EQ(stuck.safe_entries, 1);
    EXPECT_GE(stuck.safe_s, at);
    EXPECT_LT(stuck.safe_s, at + 0.150);
    EXPECT_TRUE(stuck.causes.any(position_channel)) << to_string(stuck.causes, actuator_description());
  }
}

/// What tells a stuck sensor is how far the slide must have moved, so slowly it takes longer, but goes no further.
TEST_P(QuietPlant, ASensorThatSticksInSlowMotionIsFoundBeforeTheReferenceHasMovedAMillimetre) {
  for (const double at : {2.5, 6.0, 13.3, 15.1, 20.5}) {  // 20 mm in 20 s: at most 2 mm/s
    const QuietRun stuck =
        run({"position:stuck@" + std::to_string(at), at + 4.0, ", from_m = 0.04, to_m = 0.06, move_s = 20"});
    EXPECT_EQ(stuck.safe_entries, 1) << at;
    EXPECT_GE(stuck.safe_s, at);
    EXPECT_LT(stuck.moved_m, 1e-3) << at;
    EXPECT_TRUE(stuck.causes.any(position_channel)) << to_string(stuck.causes, actuator_description());
  }
}

/// A step a hundred times as wide as the noise: rest repeats its value for as long as it lasts.
TEST_P(QuietPlant, RestsWhereTheRigsFileStatesNextToNoNoise) {
  const QuietRun quiet = run({"", 3.0, "", "[calibration]\nposition = { noise_v = 1e-5, bits = 13 }\n"});
  EXPECT_EQ(quiet.safe_entries, 0) << to_string(quiet.causes, actuator_description());
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

/// What would have no effect is refused, in words that name the key and what is allowed.
TEST(ExpectedNoise, StatedWhereNothingReadsItIsRefused) {
  const auto refusal = [](const std::string& calibration) {
    try {
      read_rig(TableReader::from_text("[calibration]\n" + calibration, "rig.toml"), new_variant());
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  using testing::AllOf, testing::HasSubstr;
  EXPECT_THAT(
      refusal("pressure_a = { noise_v = 0.002 }\n"),
      AllOf(HasSubstr("noise_v"), HasSubstr("pressure_a is not told stuck"), HasSubstr("allowed of: position")));
  EXPECT_THAT(refusal("pressure_b = { bits = 12 }\n"), AllOf(HasSubstr("bits"), HasSubstr("allowed of: position")));
  EXPECT_THAT(refusal("position = { bits = 12 }\n"), AllOf(HasSubstr("bits"), HasSubstr("allowed: with noise_v")));
  EXPECT_EQ(refusal("position = { noise_v = 0.002, bits = 12 }\npressure_a = { gain = 21000.0 }\n"), "");
}

/// The change that tells a stuck sensor is never less than two steps of its converter, whoever says what they are.
TEST(ExpectedNoise, TheChangeThatTellsAStuckSensorFollowsTheConvertersStep) {
  const auto change_of = [](const std::string& calibration, const std::vector<ChannelNoise>& of_plant = {}) {
    RigFile rig = read_rig(TableReader::from_text(calibration, "rig.toml"), new_variant());
    expect_noise(rig, of_plant);
    EXPECT_EQ(rig.ladder.plausibility.channels[pressure_a_channel].stuck_change, 25e3);
    return rig.ladder.plausibility.channels[position_channel].stuck_change;
  };
  EXPECT_EQ(change_of(""), 3e-4);
  EXPECT_EQ(change_of("[calibration]\nposition = { noise_v = 0.002, bits = 10 }\n"), 3e-4);
  for (const int bits : {1, 6, 9})
    EXPECT_DOUBLE_EQ(change_of("[calibration]\nposition = { noise_v = 0.002, bits = " + std::to_string(bits) + " }\n"),
                     std::max(3e-4, 2 * 0.12 / std::pow(2.0, bits)));
  EXPECT_DOUBLE_EQ(change_of("[calibration]\nposition = { gain = -1.2 }\n"), 2 * 12.0 / 8192);
  EXPECT_DOUBLE_EQ(change_of("", {{0.0, 1e-3}, {}, {}}), 2e-3);
}

/// Of a plant by its kind, the address it is told and its rig's file.
struct NoisySource {
  const char *kind, *address, *rig;
  bool scenario;  ///< whether the scenario's noise holds
};

constexpr NoisySource noisy_sources[] = {
    {"sim", "", "", true},
    {"sim", "192.0.2.7:47811", "", true},  // not used
    {"emulator", "", "", true},
    {"emulator", "127.0.0.1:4000", "", true},
    {"emulator", "127.8.9.1:4000", "", true},
    {"emulator", "192.0.2.7:47811", "", false},
    {"emulator", "", "[node]\naddress = \"192.0.2.7:47811\"\n", false},
    {"emulator", "127.0.0.1:4000", "[node]\naddress = \"192.0.2.7:47811\"\n", true},
    {"comedi", "", "", false},
};

TEST(ExpectedNoise, IsTheScenariosWhereTheScenarioIsThePlant) {
  const std::string text = quiet_campaign("nine_state", quiet_twin);
  const Campaign campaign = read_campaign(Document::from_text(text, "quiet.toml"), {});
  const VariantConfig variant = told(campaign.variants.front(), campaign.scenarios.front());
  for (const NoisySource& source : noisy_sources) {
    PlantChoice choice;
    choice.kind = source.kind, choice.address = source.address;
    choice.rig = read_rig(TableReader::from_text(source.rig, "rig.toml"), variant);
    EXPECT_EQ(drives_scenario(choice), source.scenario) << source.kind << " " << source.address << source.rig;
    expect_noise(choice, campaign.scenarios.front());
    EXPECT_EQ(choice.rig.ladder.plausibility.channels[position_channel].stuck_ticks, source.scenario ? 0 : 100);
  }
}

/// A replay decides by what the log says of the plant, as the run did.
TEST(ExpectedNoise, OfAReplayIsThatOfItsRun) {
  for (const NoisySource& source : noisy_sources) {
    RecordedRun run;
    run.path = "run.mcap";
    run.about = {{"variant", "nine_state"}, {"scenario", "quiet"},
                 {"plant", source.kind},    {"campaign", quiet_campaign("nine_state", quiet_twin)},
                 {"rig", source.rig},       {"lowering_s", "0"},
                 {"policy", "at_once"}};
    if (*source.address != '\0') run.about["node"] = source.address;
    EXPECT_EQ(recorded_task(run).ladder.plausibility.channels[position_channel].stuck_ticks, source.scenario ? 0 : 100)
        << source.kind << " " << source.address << source.rig;
    run.about["node"] = "nowhere";
    if (source.kind == std::string("emulator")) {
      EXPECT_THROW(recorded_task(run), ConfigError);
    }
  }
}

}  // namespace
}  // namespace solenoid
