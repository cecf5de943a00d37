// What is known of a plug-in before it is run, what may be added to a system while the program runs, and systems that are a
// model and what is said of it. Plug-ins themselves: tests/packaging/plugin.sh.
#include "controllers/described_system.hpp"
#include "controllers/systems.hpp"
#include "core/config/document.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/plugins.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/described/described.hpp"
#include "experiments/plugin/abi.hpp"
#include "experiments/plugin/plugin_file.hpp"

#include <string>

#include <gmock/gmock.h>

namespace solenoid {

/// A tank that a valve fills; it empties by itself: x' = -x/T + s.
class Tank {
 public:
  static constexpr std::size_t state_size = 1, switched_size = 1, continuous_size = 0, output_size = 1;
  explicit Tank(std::span<const double> p) : time_s_(p[0]) {}
  template <class S>
  Vector<S, 1> step(const Vector<S, 1>& x, const Vector<S, 1>& s, const Vector<S, 0>&, double dt) const {
    const double stays = std::exp(-dt / time_s_);
    return {S(S(stays) * x[0] + S(time_s_ * (1.0 - stays)) * s[0])};
  }
  template <class S>
  Vector<S, 1> output(const Vector<S, 1>& x) const {
    return x;
  }

 private:
  double time_s_;
};

}  // namespace solenoid

SOLENOID_COMPILE_MODEL(Tank)

namespace solenoid {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

std::string file_with(const std::string& record) {
  return "\x7f"
         "ELF code " +
         record + " more code";
}
const std::string header = "SOLENOID PLUG-IN", good = header + "\nname=mine\nabi=" SOLENOID_ABI "\n\n";

TEST(PluginFile, ARecordIsFoundAmongCode) {
  const PluginRecord record = parse_plugin(file_with(header + " in a text\n" + good), "a.so");
  EXPECT_EQ(record.name, "mine");
  EXPECT_EQ(record.abi, SOLENOID_ABI);
  EXPECT_NO_THROW(require_same_abi(record, "a.so"));
}

TEST(PluginFile, WhatHasNoRecordOrADamagedOneIsRefusedInALine) {
  const auto refusal = [](const std::string& bytes) {
    try {
      parse_plugin(bytes, "a.so");
    } catch (const PluginError& error) {
      return std::string(error.what());
    }
    return std::string("taken");
  };
  EXPECT_THAT(refusal(""), HasSubstr("a.so: no shared object"));
  EXPECT_THAT(refusal(good), HasSubstr("a.so: no shared object"));
  EXPECT_THAT(refusal(file_with("")), HasSubstr("a.so: no plug-in"));
  for (std::size_t kept = header.size() + 6; kept < good.size(); ++kept)
    EXPECT_THAT(refusal("\x7f"
                        "ELF" +
                        good.substr(0, kept)),
                HasSubstr("damaged"))
        << kept;
  EXPECT_THAT(refusal(file_with(header + "\nname=\x1b[31m\nabi=x\n\n")), HasSubstr("damaged"));
  EXPECT_THAT(refusal(file_with(header + "\nname=" + std::string(81, 'a') + "\nabi=x\n\n")), HasSubstr("damaged"));
}

TEST(PluginFile, AnotherVersionIsRefusedAndBothAreNamed) {
  EXPECT_THAT(
      [] {
        require_same_abi({"mine", "an old one, gcc 3, alignment 8"}, "a.so");
      },
      ThrowsMessage<PluginError>(
          testing::AllOf(HasSubstr("a.so: plug-in 'mine' was made with solenoid an old one, gcc 3"),
                         HasSubstr("allowed: " SOLENOID_ABI "; build it again"))));
}

ModelDescription tank() {
  ModelDescription d;
  d.name = "tank_of_a_test";
  d.summary = "a tank that a valve fills";
  d.states = {{.name = "level", .unit = "m", .start = 0.5, .low = 0.0, .high = 10.0}};
  d.parameters = {{"time_s", 2.0, Range::positive(), "s"}};
  d.outputs = {{.state = "level", .weight = 1.0, .target = 1.0}};
  d.mode_sets = {{.name = "valve",
                  .switches = {{.name = "valve"}},
                  .modes = {{"shut", 0}, {"open", 1}},
                  .offset = {0.0},
                  .gain = {{1.0}}}};
  d.timing = {0.05, 2};
  d.steps = 20;
  d.blocks = {1, 1, 2, 2, 4};
  return d;
}

System& registered_tank() {
  static System& system = []() -> System& {
    program_registry().add<Tank>(tank());
    return system_to_extend("tank_of_a_test");
  }();
  return system;
}

Campaign tank_campaign(const std::string& scenario) {
  registered_tank();
  return read_campaign(
      Document::from_text("variants = ['search', 'every', 'rounded']\n"
                          "variant.search = { system = 'tank_of_a_test', summary = 'searches' }\n"
                          "variant.every = { system = 'tank_of_a_test', summary = 'all', solver = "
                          "'exhaustive', model = { time_s = 2.0 } }\n"
                          "variant.rounded = { system = 'tank_of_a_test', summary = 'rounds', solver = "
                          "'sum_up_rounding' }\n"
                          "[[scenario]]\nname = 'fill'\nsystem = 'tank_of_a_test'\n" +
                              scenario,
                          "tank.toml"));
}

TEST(DescribedSystem, HoldsItsTargetWithoutAMotionAndTheSearchIsTheExhaustiveOnes) {
  const Campaign campaign = tank_campaign("duration_s = 20.0\n");
  const RunResult search = simulate(campaign.variants[0], campaign.scenarios[0], 1),
                  every = simulate(campaign.variants[1], campaign.scenarios[0], 1),
                  rounded = simulate(campaign.variants[2], campaign.scenarios[0], 1);
  ASSERT_EQ(search.ticks.size(), 400u);
  for (std::size_t k = 0; k < search.ticks.size(); ++k) {
    EXPECT_EQ(search.ticks[k].applied.switches, every.ticks[k].applied.switches) << k;
    EXPECT_EQ(search.ticks[k].decision.reference.axis[0].value, 1.0);
  }
  // x' = -x/2 + s is held at 1 by a valve that is open half of the time, and swings by what a period lets it.
  double open = 0.0;
  for (std::size_t k = 200; k < 400; ++k) {
    open += search.ticks[k].applied.switches / 200.0;
    EXPECT_NEAR(search.ticks[k].sensors.truth[0], 1.0, 0.06);
  }
  EXPECT_NEAR(open, 0.5, 0.02);
  EXPECT_EQ(search.metrics.number("objective"), every.metrics.number("objective"));
  EXPECT_LT(rounded.metrics.number("objective"), 1.2 * search.metrics.number("objective"));
}

TEST(DescribedSystem, APlantMayDifferFromWhatItsControllersBelieve) {
  const Campaign same = tank_campaign("plant = { time_s = 2.0 }\nduration_s = 5.0\n"),
                 other = tank_campaign("plant = { time_s = 4.0 }\nstart = { level = 3.0 }\nduration_s = 5.0\n");
  const RunResult as_believed = simulate(same.variants[0], same.scenarios[0], 1),
                  slower = simulate(other.variants[0], other.scenarios[0], 1);
  EXPECT_NEAR(as_believed.ticks.front().sensors.truth[0], 0.5, 1e-12);
  // Shut from 3 on, a tank of 4 s falls as exp(-t/4).
  for (const TickRecord& tick : slower.ticks) {
    const double time_s = tick.sensors.time_s;
    if (time_s < 3.0) {
      EXPECT_NEAR(tick.sensors.truth[0], 3.0 * std::exp(-time_s / 4.0), 1e-9);
    }
  }
}

TEST(DescribedSystem, MistakesInAScenarioNameWhatIsAllowed) {
  const auto refused = [](const std::string& scenario) { return [scenario] { tank_campaign(scenario); }; };
  EXPECT_THAT(refused("duration_s = 1.0\nplant = { weight = 2.0 }\n"), ThrowsMessage<ConfigError>(HasSubstr("weight")));
  EXPECT_THAT(refused("duration_s = 1.0\nplant = { time_s = -2.0 }\n"),
              ThrowsMessage<ConfigError>(HasSubstr("time_s")));
  EXPECT_THAT(refused("duration_s = 1.0\nstart = { level = 11.0 }\n"), ThrowsMessage<ConfigError>(HasSubstr("level")));
  EXPECT_THAT(refused("trajectory = {}\n"), ThrowsMessage<ConfigError>(HasSubstr("duration_s")));
}

TEST(DescribedSystem, ADescriptionThatPointsNowhereIsRefused) {
  const auto refused = [](auto change) {
    return [change] {
      ModelDescription said = tank();
      change(said);
      DescribedParts parts(std::move(said));
    };
  };
  EXPECT_THAT(refused([](ModelDescription& d) { d.outputs[0].state = "depth"; }),
              ThrowsMessage<std::logic_error>(HasSubstr("no state 'depth'")));
  EXPECT_THAT(refused([](ModelDescription& d) { d.mode_sets.clear(); }),
              ThrowsMessage<std::logic_error>(HasSubstr("no mode set")));
  EXPECT_THAT(refused([](ModelDescription& d) {
                d.states.push_back({.name = "flow"});
                d.channels = {{"flow"}};
              }),
              ThrowsMessage<std::logic_error>(HasSubstr("output 'level' is not measured")));
}

TEST(Registry, ASystemThatIsThereIsAddedToAndNamesAreThereOnce) {
  System& system = registered_tank();
  const auto idle = [](const VariantConfig&) -> AnySolverPtr { return nullptr; };
  const SolverRow row{
      .name = "a_solver_of_a_test", .summary = "none", .groups = {}, .make = SolverMakers::of_any(idle)};
  system.add(row, {{"a_solver_of_a_test.depth", 3.0, {1.0, 5.0}, "", "how deep"}});
  EXPECT_THAT([&] { system.add(row); }, ThrowsMessage<ConfigError>(HasSubstr("'a_solver_of_a_test' is there twice")));
  const auto variant = [](const std::string& more) {
    TableReader table = TableReader::from_text("system = 'tank_of_a_test'\nsummary = 's'\n" + more, "variant");
    return read_variant(table, "v");
  };
  EXPECT_EQ(variant("solver = 'a_solver_of_a_test'\n").added.at("a_solver_of_a_test.depth"), 3.0);
  EXPECT_EQ(
      variant("solver = 'a_solver_of_a_test'\na_solver_of_a_test.depth = 4.0\n").added.at("a_solver_of_a_test.depth"),
      4.0);
  EXPECT_THAT([&] { variant("solver = 'a_solver_of_a_test'\na_solver_of_a_test.depth = 6.0\n"); },
              ThrowsMessage<ConfigError>(HasSubstr("depth")));
  EXPECT_THAT([&] { program_registry().add<Tank>(tank()); },
              ThrowsMessage<ConfigError>(HasSubstr("system 'tank_of_a_test' is there twice")));

  system.add(
      ModeSetRow{"twice_as_fast", [](const VariantConfig&) {
                   return ModeSet("twice_as_fast", {{.name = "valve"}}, {{"shut", 0}, {"open", 1}}, {0.0}, {{2.0}});
                 }});
  EXPECT_EQ(system.modes(variant("modes = 'twice_as_fast'\n")).name(), "twice_as_fast");
  EXPECT_EQ(system.modes(variant("")).name(), "valve");
}

}  // namespace
}  // namespace solenoid
