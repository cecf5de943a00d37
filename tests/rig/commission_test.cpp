// Commissioning rigs on the twin that are wired as they should be, and wrongly in one way each.
#include "controllers/systems/actuator/actuator_guard.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/reader.hpp"
#include "core/rt/clock.hpp"
#include "core/systems/actuator/signals.hpp"
#include "core/systems/actuator/valves.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/rig/faulty_plant.hpp"
#include "experiments/systems/actuator/commission/commission_record.hpp"
#include "experiments/systems/actuator/commission/steps.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"

#include <algorithm>
#include <limits>
#include <new>
#include <random>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using testing::HasSubstr;

/// A rig on the twin's physics, in time that jumps.
struct SimulatedRig {
  struct Options {
    std::string valves = "two_way", scenario = "bench";
    std::vector<std::string> faults = {};
    Mismatch mismatch = {};
    std::uint64_t seed = 1;
    double start_m = 0.055;
    bool noise = true;
  };
  explicit SimulatedRig(const Options& options) {
    const Campaign campaign = read_campaign("identify", {{"nine_state"}, {options.scenario}});
    ScenarioConfig scenario = campaign.scenarios.front();
    actuator(scenario).mismatch = options.mismatch;
    scenario.noise = options.noise;
    variant = campaign.variants.front();
    variant.modes = options.valves;
    variant = told(variant, scenario);
    settings.variant = &variant;
    settings.plausibility = actuator_ladder().plausibility;
    settings.plane = actuator(scenario).plane;
    plant = std::make_unique<FaultyPlant>(make_plant(variant, scenario, options.seed),
                                          parse_faults(options.faults, actuator_simulation()), variant, options.seed);
    bench = std::make_unique<Bench>(*plant, clock, valve_modes(options.valves, actuator(variant).nominal),
                                    actuator(variant).nominal.motor_force_limit_n(), variant.timing.tick_s,
                                    [this] { return interrupt_after-- == 0; });
  }
  /// All steps; what each became.
  const std::vector<StepOutcome>& commission() {
    CommissionState state = new_commission(*bench, settings);
    for (const StepInfo& step : commission_steps()) outcomes.push_back(carry_out(step.name, state, outcomes));
    return outcomes;
  }
  std::vector<std::string> findings() const {
    std::vector<std::string> all;
    for (const StepOutcome& o : outcomes) all.insert(all.end(), o.findings.begin(), o.findings.end());
    return all;
  }
  std::string told_all() const {
    std::string text;
    for (const StepOutcome& o : outcomes) {
      text += fmt::format("{}: {} ({:.1f} s) {} [{}]\n", o.name, to_string(o.verdict), o.seconds, o.note,
                          fmt::join(o.findings, " | "));
      for (const Measured& m : o.measured)
        text += fmt::format("    {} = {:.3f} {}{}\n", m.name, m.value, m.unit, m.good() ? "" : " BAD");
    }
    return text;
  }

  VariantConfig variant;
  CommissionSettings settings;
  std::unique_ptr<FaultyPlant> plant;
  BenchClockOf<FakeClock> clock;
  std::unique_ptr<Bench> bench;
  std::vector<StepOutcome> outcomes;
  std::int64_t interrupt_after = -1;
};

/// Plants that nobody knows: what they differ by is drawn.
class UnknownPlants {
 public:
  Mismatch next() {
    Mismatch m;
    m.flow = between(0.85, 1.15);
    m.friction = between(0.7, 1.5);
    m.inertia = between(0.8, 1.25);
    return m;
  }

 private:
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  std::mt19937_64 random_{3};
};

/// Lying flat and upright in turn.
TEST(Commission, ASoundRigPassesWhateverItsPlantIs) {
  UnknownPlants plants;
  for (const std::string valves : {"two_way", "three_way"})
    for (std::uint64_t seed = 1; seed <= 20 / SOLENOID_TEST_ONE_IN; ++seed) {
      const bool flat = seed % 2 == 1, shut = valves == "two_way";
      SimulatedRig rig({.valves = valves,
                        .scenario = flat ? "bench" : "upright",
                        .mismatch = plants.next(),
                        .seed = seed,
                        .noise = seed % 5 != 0});
      SCOPED_TRACE(fmt::format("{} {}\n{}", valves, seed, (rig.commission(), rig.told_all())));
      for (const StepOutcome& o : rig.outcomes) {
        const bool by_hand = o.name == "position" || o.name == "identify" || o.name == "motion" ||
                             (o.name == "end_stops" && !flat) || (o.name == "leak" && !shut);
        EXPECT_EQ(o.verdict, by_hand ? StepVerdict::skipped : StepVerdict::passed) << o.name;
      }
      EXPECT_THAT(rig.findings(), testing::IsEmpty());
    }
}

/// A wrong wiring, and what has to be said of it.
struct WrongWiring {
  const char *fault, *found;
  const char* valves = "";  ///< those that can have it; empty: both
  const char* scenario = "";
};

const WrongWiring wrong_wirings[] = {
    {"valves:swapped@0", "the valves of chambers A and B are swapped"},
    {"pressure_a:swapped=pressure_b@0", "the pressure sensors A and B are swapped"},
    {"pressure_a:inverted@0", "pressure sensor A is inverted"},
    {"pressure_b:inverted@0", "pressure sensor B is inverted"},
    {"position:inverted@0", "the position sensor is inverted"},
    {"motor:inverted@0", "the motor has the wrong sign"},
    {"motor:lost@0", "the motor does nothing"},
    {"supply:lost@0", "there is no supply pressure"},
    {"position:stuck@0.5", "the position sensor shows nothing, or the slide is stuck"},
    {"pressure_a:off@0", "pressure sensor A shows nothing"},
    {"pressure_b:stuck@0.5", "pressure sensor B shows nothing"},
    {"coil_supply_a:stuck_open@0", "its supply valve is stuck open or leaks", "two_way"},
    {"coils_a:swapped@0", "the supply and exhaust coils of chamber A are swapped", "two_way"},
    {"coils_b:swapped@0", "the supply and exhaust coils of chamber B are swapped", "two_way"},
    {"coils_a:swapped@0", "supply and exhaust are swapped at the valve of chamber A", "three_way"},
    {"coils_b:swapped@0", "supply and exhaust are swapped at the valve of chamber B", "three_way"},
    {"coil_supply_a:stuck_closed@0", "coil supply A is dead", "two_way"},
    {"coil_exhaust_a:stuck_closed@0", "coil exhaust A is dead", "two_way"},
    {"coil_supply_b:stuck_closed@0", "coil supply B is dead", "two_way"},
    {"coil_exhaust_b:stuck_closed@0", "coil exhaust B is dead", "two_way"},
    {"coil_a:stuck_closed@0", "coil A is dead", "three_way"},
    {"coil_b:stuck_closed@0", "coil B is dead", "three_way"},
    {"supply:factor=0.6@0", "the supply is at 9"},  // 90 kPa
    {"supply:factor=1.3@0", "the supply is at 19"},
    {"chamber_a:leaking=0.02@0", "chamber A leaks", "two_way"},
    {"chamber_b:leaking=0.02@0", "chamber B leaks", "two_way"},
    {"chamber_a:leaking=0.2@0", "chamber A leaks", "two_way"},
    {"chamber_b:leaking=0.2@0", "chamber B leaks", "two_way"},
    {"position:gain=0.9@0", "a gain of 0.90", "", "bench"},
    {"pressure_a:gain=0.8@0", "a sensor's gain is wrong"},
    {"coil_supply_a:slow=0.006@0", "the valve that fills chamber A opens", "two_way"},
    {"coil_b:slow=0.006@0", "the valve that fills chamber B opens", "three_way"}};

TEST(Commission, EachThingThatIsWiredWronglyIsNamed) {
  UnknownPlants plants;
  for (const WrongWiring& wrong : wrong_wirings)
    for (const std::string valves : {"two_way", "three_way"})
      for (const std::string scenario : {"bench", "upright"})
        for (std::uint64_t seed = 1; seed <= (SOLENOID_TEST_ONE_IN == 1 ? 2 : 1); ++seed) {
          const Mismatch mismatch = plants.next();
          if ((*wrong.valves && valves != wrong.valves) || (*wrong.scenario && scenario != wrong.scenario)) continue;
          SimulatedRig rig(
              {.valves = valves, .scenario = scenario, .faults = {wrong.fault}, .mismatch = mismatch, .seed = seed});
          SCOPED_TRACE(
              fmt::format("{} {} {} {}\n{}", wrong.fault, valves, scenario, seed, (rig.commission(), rig.told_all())));
          EXPECT_THAT(rig.findings(), testing::Contains(HasSubstr(wrong.found)));
          // Nothing else is called wrong that would be turned round or replaced for it.
          for (const WrongWiring& other : wrong_wirings)
            if (wrong.found != std::string(other.found)) {
              EXPECT_THAT(rig.findings(), testing::Not(testing::Contains(testing::StrEq(other.found)))) << other.found;
            }
        }
}

TEST(Commission, FindsTwoThingsAtOnce) {
  SimulatedRig rig({.faults = {"valves:swapped@0", "pressure_a:inverted@0"}});
  rig.commission();
  EXPECT_THAT(rig.findings(), testing::Contains(HasSubstr("the valves of chambers A and B are swapped")));
  EXPECT_THAT(rig.findings(), testing::Contains(HasSubstr("is inverted")));
  SimulatedRig other({.faults = {"motor:inverted@0", "coils_b:swapped@0"}});
  other.commission();
  EXPECT_THAT(other.findings(), testing::Contains(HasSubstr("the motor has the wrong sign")));
  EXPECT_THAT(other.findings(), testing::Contains(HasSubstr("coils of chamber B are swapped")));
}

/// Whatever is wrong, commands stay within what is allowed, the slide within what a step may move it, and each step
/// leaves safe outputs behind.
TEST(Commission, StaysWithinItsBoundsAndLeavesSafeOutputs) {
  for (const WrongWiring& wrong : wrong_wirings) {
    const std::string valves = *wrong.valves ? wrong.valves : "two_way";
    if (std::string_view(wrong.fault).starts_with("coils_") && valves == "three_way")
      continue;  // fills with its coil off
    SCOPED_TRACE(wrong.fault);
    SimulatedRig rig({.valves = valves, .faults = {wrong.fault}});
    CommissionState state = new_commission(*rig.bench, rig.settings);
    for (const StepInfo& step : commission_steps()) {
      rig.outcomes.push_back(carry_out(step.name, state, rig.outcomes));
      const SwitchPattern left = rig.plant->outputs().switches;
      const bool turned =
          std::string_view(wrong.fault).starts_with("valves") || std::string_view(wrong.fault).starts_with("coils_");
      EXPECT_TRUE(left == 0 || turned) << step.name;
      EXPECT_EQ(rig.plant->outputs().continuous[0], 0.0) << step.name;
    }
  }
}

TEST(Commission, ASensorThatFailsStopsTheStepWithSafeOutputs) {
  struct Broken final : Plant {
    explicit Broken(FaultyPlant& of) : plant(of) {}
    Measurement read(double time_s) noexcept override {
      Measurement s = plant.read(time_s);
      if (++reads > 1300) s.value[pressure_b_channel] = std::numeric_limits<double>::quiet_NaN();
      return s;
    }
    void write(const Command& c) noexcept override { plant.write(c); }
    FaultyPlant& plant;
    int reads = 0;
  };
  SimulatedRig rig({});
  Broken broken(*rig.plant);
  Bench bench(broken, rig.clock, valve_modes("two_way", {}), 8.0, 1e-3, [] { return false; });
  CommissionState state = new_commission(bench, rig.settings);
  std::vector<StepOutcome> outcomes;
  for (const char* step : {"link", "sensors", "motor", "coils"}) outcomes.push_back(carry_out(step, state, outcomes));
  EXPECT_EQ(outcomes[1].verdict, StepVerdict::passed);
  EXPECT_EQ(outcomes[2].verdict, StepVerdict::stopped);
  EXPECT_THAT(outcomes[2].note, HasSubstr("pressure B is no number"));
  EXPECT_EQ(rig.plant->outputs(), Command{});
}

TEST(Commission, AnInterruptionLeavesSafeOutputsAndGoesOnFromTheRecord) {
  SimulatedRig rig({});
  rig.interrupt_after = 2400;  // ticks: within the coils
  CommissionState state = new_commission(*rig.bench, rig.settings);
  CommissionRecord record{"nine_state", "sim", "horizontal", {}};
  try {
    for (const StepInfo& step : commission_steps()) record.add(carry_out(step.name, state, record.steps));
    FAIL() << "not interrupted";
  } catch (const BenchInterrupted&) {
  }
  EXPECT_EQ(rig.plant->outputs(), Command{});
  ASSERT_EQ(record.steps.back().name, "motor");
  // Another process, which has nothing but what was written.
  CommissionRecord again = CommissionRecord::parse(record.json(), "commission.json");
  EXPECT_EQ(again.json(), record.json());
  CommissionState later = new_commission(*rig.bench, rig.settings);
  again.add(carry_out("coils", later, again.steps));
  EXPECT_EQ(again.steps.back().verdict, StepVerdict::passed);
  EXPECT_TRUE(later.wiring_is_known);
  again.forget_from("motor");
  EXPECT_EQ(again.steps.back().name, "position");
}

TEST(Commission, StepsThatNeedOthersSaySo) {
  SimulatedRig rig({});
  CommissionState state = new_commission(*rig.bench, rig.settings);
  for (const char* step : {"coils", "leak", "supply", "delays", "end_stops"}) {
    const StepOutcome outcome = carry_out(step, state, {});
    EXPECT_EQ(outcome.verdict, StepVerdict::skipped) << step;
    EXPECT_THAT(outcome.note, HasSubstr(step == std::string("coils") ? "step motor" : "step coils")) << step;
  }
  EXPECT_THROW(carry_out("valves", state, {}), std::invalid_argument);
}

/// The operator's hand: the slide is where it was put when Enter is pressed.
TEST(Commission, AHandTellsAnInvertedPositionAndItsGain) {
  for (const auto& [fault, found] : {std::pair{"position:inverted@0", "the position sensor is inverted"},
                                     {"position:gain=0.9@0", "gain is wrong: 0.9"},
                                     {"position:offset=0@0", ""}}) {
    SCOPED_TRACE(fault);
    /// Shows a slide that a hand has moved.
    struct ByHand final : SimulatedPlant {
      Measurement read(double time_s) noexcept override { return {time_s, at_m, 101325.0, 101325.0}; }
      void write(const Command&) noexcept override {}
      double consumed() const override { return 0.0; }
      double at_m = 0.03;
    };
    SimulatedRig rig({});
    auto owned = std::make_unique<ByHand>();
    ByHand& hand = *owned;
    FaultyPlant plant(std::move(owned), parse_faults({fault}, actuator_simulation()), rig.variant, 1);
    Bench bench(plant, rig.clock, valve_modes("two_way", {}), 8.0, 1e-3, [] { return false; });
    int asked = 0;
    rig.settings.beside = {true, [&](const std::string&) { ++asked; },
                           [&]() -> std::optional<std::string> {
                             hand.at_m = asked == 1 ? -0.0065 : 0.11;
                             return "";
                           }};
    CommissionState state = new_commission(bench, rig.settings);
    const StepOutcome outcome = carry_out("position", state, {});
    EXPECT_EQ(asked, 2);
    if (*found) {
      EXPECT_THAT(outcome.findings, testing::Contains(HasSubstr(found)));
    } else {
      EXPECT_EQ(outcome.verdict, StepVerdict::passed) << outcome.note;
    }
  }
}

TEST(CommissionRecord, RefusesWhatItHasNotWritten) {
  const std::string good = CommissionRecord{"nine_state", "sim", "horizontal", {}}.json();
  EXPECT_NO_THROW(CommissionRecord::parse(good, "record"));
  for (const char* bad :
       {"", "{}", "[1]", R"({"variant": 1, "plant": "sim", "plane": "horizontal", "steps": []})",
        R"({"variant": "v", "plant": "sim", "plane": "horizontal", "steps": [{"name": "nothing"}]})",
        R"({"variant": "v", "plant": "sim", "plane": "horizontal", "steps": [{"name": "link", "verdict": "fine"}]})",
        R"({"variant": "v", "plant": "sim", "plane": "horizontal", "steps": 3})"})
    EXPECT_THROW(CommissionRecord::parse(bad, "record"), ConfigError) << bad;
}

/// The first motion is made on a rig of which nothing is wrong, and nothing moves where the position cannot be read.
TEST(Commission, WhatWentWrongKeepsWhatWouldMove) {
  const auto motions = [](std::vector<std::string> faults) {
    SimulatedRig rig({.faults = std::move(faults)});
    int made = 0;
    rig.settings.motion = [&](Plant&) { return ++made, MotionOutcome{true, 0.5, 1.0, ""}; };
    rig.commission();
    return std::pair(made, rig.outcomes);
  };
  EXPECT_EQ(motions({}).first, 1);
  const auto [made, after_supply] = motions({"supply:factor=0.6@0"});
  EXPECT_EQ(made, 0);
  EXPECT_EQ(after_supply.back().note, "step supply has not passed");
  const auto [none, unread] = motions({"position:garbage@0"});
  EXPECT_EQ(none, 0);
  for (const StepOutcome& o : unread) {
    if (o.name == "motor" || o.name == "coils" || o.name == "end_stops") {
      EXPECT_EQ(o.note, "step sensors has not passed") << o.name;
    }
  }
}

TEST(Commission, LeavesSafeOutputsWhateverAStepThrows) {
  SimulatedRig rig({});
  rig.commission();
  rig.outcomes.pop_back();
  rig.settings.motion = [&](Plant& plant) -> MotionOutcome {
    plant.write(actuator_command(0b1001, 3.0));
    throw std::bad_alloc();
  };
  CommissionState state = new_commission(*rig.bench, rig.settings);
  EXPECT_THROW(carry_out("motion", state, rig.outcomes), std::bad_alloc);
  EXPECT_EQ(rig.plant->outputs(), Command{});
}

TEST(Commission, OnlyAnEmptyLineMeansGo) {
  SimulatedRig rig({});
  std::vector<std::string> answers = {"no", "quit", "", "s", "x", "q"};
  int asked = 0;
  rig.settings.beside = {true, [&](const std::string&) { ++asked; },
                         [&]() -> std::optional<std::string> {
                           const std::string next = answers.front();
                           answers.erase(answers.begin());
                           return next;
                         }};
  CommissionState state = new_commission(*rig.bench, rig.settings);
  EXPECT_TRUE(asked_and_done(state, "go on"));
  EXPECT_EQ(asked, 3);
  EXPECT_FALSE(asked_and_done(state, "go on"));
  EXPECT_THROW(asked_and_done(state, "go on"), BenchInterrupted);
  EXPECT_EQ(asked, 6);
}

}  // namespace
}  // namespace solenoid
