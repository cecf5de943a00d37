#include "controllers/instances/instance_set.hpp"
#include "controllers/instances/recording_solver.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/reader.hpp"
#include "core/mpc/rollout.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/profile/record.hpp"
#include "experiments/profile/replay.hpp"
#include "experiments/profile/shipped_instances.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <cmath>
#include <set>

#include <gmock/gmock.h>

namespace solenoid {
namespace {

using testing::HasSubstr;

const char* const campaign_text = R"(
variants = ["thesis_pd", "nine_state_2", "own"]
[variant.own]
model = "own.toml"
valves = "two_way"
solver = "branch_and_bound"
integral = { gain = 0.005 }
[[scenario]]
name = "sine"
trajectory = { kind = "sine", lead_s = 0.2, periods = 0.5 }
noise = true
duration_s = 0.5
[[scenario]]
name = "flat"
plane = "horizontal"
trajectory = { kind = "cycloidal" }
kick = { at_s = 0.1, speed_m_s = 0.4 }
duration_s = 0.3
)";

Campaign small_campaign(const test::Folder& folder) {
  folder.write("own.toml", "block_mass_kg = 1.3\n");
  return read_campaign(folder.write("c.toml", campaign_text));
}

const InstanceSet& small_set() {
  static const InstanceSet set = [] {
    const test::Folder folder;
    return record_instances(small_campaign(folder), 60);
  }();
  return set;
}

const InstanceSet& shipped() {
  static const InstanceSet set = parse_instances(shipped_instance_bytes(), "shipped");
  return set;
}

/// Every instance of a variant solved and judged: the plan of the record, with the cost the plan really has.
template <HybridModel Model>
void expect_recorded_plans(const InstanceSet& set, const VariantInstances& variant, std::size_t every) {
  for (std::size_t i = 0; i < variant.records.size(); i += every) {
    const InstanceRecord& record = variant.records[i];
    auto problem = make_problem<Model>(told(variant.config, set.motions[record.motion]));
    const auto solver = make_solver<Model>(variant.config.solver);
    solver->prepare(problem);
    Plan<Model> plan(problem);
    pose(set, record, problem, plan);
    const SolveReport report = solver->solve(problem, plan, Deadline::never());
    EXPECT_TRUE(same_plan(record, plan)) << variant.name << " " << i;
    EXPECT_EQ(report.cost, record.plan_cost);
    EXPECT_EQ(evaluate(problem, plan).cost, record.plan_cost);
  }
}

TEST(ProfileInstances, BytesReadBackToTheSameBytes) {
  for (const InstanceSet* set : {&small_set(), &shipped()}) {
    const std::string bytes = instance_bytes(*set);
    const InstanceSet again = parse_instances(bytes, "again");
    EXPECT_EQ(instance_bytes(again), bytes);
    ASSERT_EQ(again.variants.size(), set->variants.size());
    for (std::size_t v = 0; v < again.variants.size(); ++v) {
      ASSERT_EQ(again.variants[v].records.size(), set->variants[v].records.size());
      for (std::size_t i = 0; i < again.variants[v].records.size(); ++i)
        EXPECT_EQ(again.variants[v].records[i].lines, set->variants[v].records[i].lines);
    }
  }
}

TEST(ProfileInstances, RecordingIsRepeatableToTheLastBit) {
  const test::Folder folder;
  EXPECT_EQ(instance_bytes(record_instances(small_campaign(folder), 60)), instance_bytes(small_set()));
}

TEST(ProfileInstances, AnInstanceIsWhatTheClosedLoopPosed) {
  const test::Folder folder;
  const Campaign campaign = small_campaign(folder);
  std::vector<PosedInstance> all;
  const SolverDecorator keep_all = [&](AnySolverPtr solver) {
    return std::make_unique<RecordingSolver>(std::move(solver), all, 1000);
  };
  const RunResult run = simulate(campaign.variants[0], campaign.scenarios[0], 1, keep_all);
  std::vector<const TickRecord*> solved;
  for (const TickRecord& t : run.ticks)
    if (t.decision.solved) solved.push_back(&t);
  const VariantInstances& variant = small_set().variants[0];
  const std::size_t every = 100 / 30;
  int followed = 0;
  for (std::size_t i = 0; i < variant.records.size() && variant.records[i].motion == 0; ++i) {
    const InstanceRecord& record = variant.records[i];
    const PosedInstance& was = all.at(i * every);
    const auto& posed = dynamic_cast<const Problem<PneumaticActuator>&>(*was.problem);
    EXPECT_TRUE(record.reference.empty()) << "no window of the motion";
    EXPECT_NEAR(record.offset[0], solved.at(i * every)->decision.offset[0], 1e-12);
    EXPECT_EQ(record.initial, padded<max_states>(posed.initial));
    EXPECT_EQ(record.lines, posed.lines);
    EXPECT_EQ(record.warm_modes, was.warm_start->modes);
    auto problem = make_problem<PneumaticActuator>(variant.config);
    Plan<PneumaticActuator> plan(problem);
    pose(small_set(), record, problem, plan);
    for (std::size_t j = 0; j < problem.reference.size(); ++j)
      EXPECT_NEAR(problem.reference[j][0], posed.reference[j][0], 2e-12);
    followed += problem.modes.pattern(record.plan_modes[0]) == solved.at(i * every)->decision.command.switches;
  }
  EXPECT_EQ(followed, 30);
}

TEST(ProfileInstances, SetsHoldTheirOwnPlans) {
  for (const VariantInstances& v : small_set().variants) {
    EXPECT_GE(v.records.size(), 50u);
    if (actuator(v.config).motor == "in_prediction")
      expect_recorded_plans<PrestabilisedActuator>(small_set(), v, 1);
    else
      expect_recorded_plans<PneumaticActuator>(small_set(), v, 1);
  }
}

TEST(ProfileInstances, AFileOfParametersTravelsAlong) {
  EXPECT_EQ(actuator(small_set().variants[2].config).nominal.block_mass_kg, 1.3);
  EXPECT_EQ(actuator(parse_instances(instance_bytes(small_set()), "x").variants[2].config).nominal.block_mass_kg, 1.3);
}

TEST(ProfileInstances, TheShippedSetIsSmallAndVaried) {
  EXPECT_LT(shipped_instance_bytes().size(), 1'000'000u);
  std::set<std::string> names;
  for (const RecordedMotion& s : shipped().motions) names.insert(s.name);
  EXPECT_EQ(names, (std::set<std::string>{"nominal", "mismatched", "noisy", "saturated", "kicked"}));
  EXPECT_GE(shipped().variants.size(), 12u);
  for (const VariantInstances& v : shipped().variants) {
    EXPECT_GE(v.records.size(), 500u) << v.name;
    if (actuator(v.config).motor == "in_prediction")
      expect_recorded_plans<PrestabilisedActuator>(shipped(), v, 50);
    else
      expect_recorded_plans<PneumaticActuator>(shipped(), v, 50);
  }
}

TEST(ProfileInstances, OwnRowsAreKeptWhereAReferenceIsNoWindow) {
  InstanceSet set = small_set();
  InstanceRecord& record = set.variants[0].records[0];
  for (int j = 0; j < 100; ++j) record.reference.insert(record.reference.end(), {0.05, 0.01});
  record.warm_continuous.assign(record.warm_modes.size(), 1.5);
  const InstanceSet again = parse_instances(instance_bytes(set), "own");
  EXPECT_EQ(again.variants[0].records[0].reference, record.reference);
  EXPECT_EQ(again.variants[0].records[0].warm_continuous, record.warm_continuous);
  auto problem = make_problem<PneumaticActuator>(again.variants[0].config);
  Plan<PneumaticActuator> plan(problem);
  pose(again, again.variants[0].records[0], problem, plan);
  EXPECT_EQ(problem.reference[99], (OutputOf<PneumaticActuator>{0.05, 0.01}));
  EXPECT_EQ(plan.continuous[0][0], 1.5);
}

std::string refusal(const std::string& bytes) {
  try {
    parse_instances(bytes, "file");
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("file: "));
    EXPECT_THAT(error.what(), testing::Not(HasSubstr("\n")));
    return error.what();
  }
  return "";
}

/// With a checksum that fits again, so that the reader itself must find the damage.
std::string sealed(std::string bytes) {
  bytes.resize(bytes.size() - 8);
  std::uint64_t hash = 14695981039346656037u;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  for (int i = 0; i < 8; ++i) bytes += static_cast<char>(hash >> (8 * i));
  return bytes;
}

TEST(ProfileInstances, EveryTruncationIsRefused) {
  InstanceSet set = small_set();
  set.motions.resize(1);
  set.variants.resize(1);
  set.variants[0].records.resize(2);
  const std::string bytes = instance_bytes(set);
  ASSERT_EQ(refusal(bytes), "");
  for (std::size_t size = 0; size < bytes.size(); size += size < 100 ? 1 : 37) {
    EXPECT_NE(refusal(bytes.substr(0, size)), "") << size;
    if (size <= 20) continue;
    EXPECT_NE(refusal(sealed(bytes.substr(0, size))), "") << size;
  }
  EXPECT_THAT(refusal(sealed(bytes + "x")), HasSubstr("nothing behind the last record"));
}

TEST(ProfileInstances, DamageBelowAFittingChecksumIsRefusedOrReadable) {
  InstanceSet set = small_set();
  set.motions.resize(1);
  set.variants.resize(1);
  set.variants[0].records.resize(3);
  const std::string bytes = instance_bytes(set);
  const std::size_t first_record = bytes.find("valves");
  ASSERT_NE(first_record, std::string::npos);
  int refused = 0;
  for (std::size_t i = first_record; i + 8 < bytes.size(); ++i) {
    std::string damaged = bytes;
    damaged[i] = static_cast<char>(damaged[i] ^ (1 << (i % 8)));
    EXPECT_THAT(refusal(damaged), HasSubstr("checksum"));
    refused += refusal(sealed(damaged)) != "";  // no crash, and no exception of another kind
  }
  EXPECT_GE(refused, 20);
}

TEST(ProfileInstances, AnEstimatedLoadIsPartOfTheProblem) {
  const test::Folder folder;
  const Campaign campaign = read_campaign(folder.write("c.toml", R"(
variants = ["nine_robust"]
[[scenario]]
name = "loaded"
plant = "twin"
noise = true
payload_kg = 0.2
trajectory = { kind = "sine", lead_s = 0.2, periods = 0.5 }
duration_s = 0.5
)"));
  const InstanceSet set = record_instances(campaign, 1000);
  const VariantInstances& variant = set.variants.front();
  ASSERT_EQ(variant.records.size(), 100u);
  std::size_t solve = 0;
  for (const TickRecord& t : simulate(campaign.variants.front(), campaign.scenarios.front(), 1).ticks) {
    if (!t.decision.solved) continue;
    const InstanceRecord& record = variant.records[solve++];
    ASSERT_EQ(record.load.size(), 2u);
    EXPECT_EQ(record.load[0], t.decision.detail.belief[payload_belief]);
    EXPECT_EQ(record.load[1], t.decision.detail.belief[disturbance_belief]);
  }
  expect_recorded_plans<PrestabilisedActuator>(set, variant, 1);
  std::string bytes = instance_bytes(set);
  const InstanceSet read = parse_instances(bytes, "loaded");
  EXPECT_EQ(read.variants[0].records[50].load, variant.records[50].load);
  InstanceSet nominal = set;  // without its load the same state is another problem
  for (InstanceRecord& r : nominal.variants[0].records) r.load.clear();
  Problem<PrestabilisedActuator> problem = make_problem<PrestabilisedActuator>(variant.config);
  Plan<PrestabilisedActuator> plan(problem);
  const auto cost = [&](const InstanceSet& from) {
    pose(from, from.variants[0].records[50], problem, plan);
    plan.modes = variant.records[50].plan_modes;
    return evaluate(problem, plan).cost;
  };
  const double without = cost(nominal);
  EXPECT_NE(cost(set), without);
}

/// Of any system: as many states, outputs, inputs and loads as its model has.
TEST(ProfileInstances, OtherSystemsInstancesRepeatToo) {
  for (const char* name : {"thrusters", "inverter"}) {
    Campaign campaign = read_campaign(name);
    ScenarioList shortened;
    for (ScenarioConfig s : campaign.scenarios) {
      s.duration_s = std::min(s.duration_s, 40 * s.system->description().timing.period_s());
      shortened.add(s, "");
    }
    campaign.scenarios = shortened;
    const InstanceSet set = record_instances(campaign, 60);
    const std::string bytes = instance_bytes(set);
    const InstanceSet again = parse_instances(bytes, name);
    EXPECT_EQ(instance_bytes(again), bytes);
    for (const VariantInstances& v : again.variants) {
      EXPECT_GE(v.records.size(), 3u) << v.name;  // one of them decides every tenth tick
      const auto replay = make_replay(again, v, 1e-3);
      std::vector<ReplaySample> samples(v.records.size());
      replay->pass(false, samples);
      EXPECT_EQ(replay->plans_as_recorded(), v.records.size()) << v.name;
    }
  }
}

/// A set has no scenarios: the sampling that they gave a variant is the variant's.
TEST(ProfileInstances, TheSamplingThatAScenarioSaidIsKept) {
  const test::Folder folder;
  const char* const scenario =
      "[[scenario]]\nname = \"s\"\nsystem = \"inverter\"\ntrajectory = { kind = \"rotating\", duration_s = 0.01 }\n"
      "timing = { tick_ms = 0.05, period_ms = 0.1 }\n";
  const std::string variants =
      "variants = [\"own\"]\n[variant.own]\nsystem = \"inverter\"\nhorizon = { steps = 2 }\n"
      "solver = \"branch_and_bound\"\n";
  const InstanceSet set = record_instances(read_campaign(folder.write("c.toml", variants + scenario)), 50);
  const InstanceSet again = parse_instances(instance_bytes(set), "again");
  const VariantInstances& v = again.variants.front();
  EXPECT_EQ(v.config.timing, (Timing{5e-5, 2}));
  const auto replay = make_replay(again, v, 1e-3);
  std::vector<ReplaySample> samples(v.records.size());
  replay->pass(false, samples);
  EXPECT_EQ(replay->plans_as_recorded(), v.records.size());
  const std::string two = "variants = [\"inverter_one_step\"]\n" + std::string(scenario) +
                          "[[scenario]]\nname = \"t\"\nsystem = \"inverter\"\n" +
                          "trajectory = { kind = \"rotating\", duration_s = 0.01 }\n" +
                          "timing = { tick_ms = 0.05, period_ms = 0.05 }\n";
  EXPECT_THROW(record_instances(read_campaign(folder.write("d.toml", two)), 50), ConfigError);
}

/// Relaxed variants start from what the plan before kept of its relaxation: with it in the record a solve repeats.
TEST(ProfileInstances, TheRelaxationOfAWarmStartIsKept) {
  const test::Folder folder;
  const Campaign campaign = read_campaign(folder.write("relaxed.toml", R"(
variants = ["relaxed_pwm", "joint_relaxed"]
[[scenario]]
name       = "quick"
trajectory = { kind = "cycloidal", move_s = 0.2, dwell_s = 0.1 }
)"));
  const InstanceSet set = record_instances(campaign, 20);
  const std::string bytes = instance_bytes(set);
  const InstanceSet again = parse_instances(bytes, "again");
  EXPECT_EQ(instance_bytes(again), bytes);
  for (const VariantInstances& v : again.variants) {
    EXPECT_GE(v.records.size(), 15u) << v.name;
    int known = 0;
    for (const InstanceRecord& r : v.records) known += !r.warm_weights.empty();
    EXPECT_GE(known, static_cast<int>(v.records.size()) - 1) << v.name;  // but the first of a run
    const auto replay = make_replay(again, v, 1e-3);
    std::vector<ReplaySample> samples(v.records.size());
    replay->pass(false, samples);
    EXPECT_EQ(replay->plans_as_recorded(), v.records.size()) << v.name;
  }
}

TEST(ProfileInstances, OtherFilesAndVersionsAreNamed) {
  EXPECT_THAT(refusal("[[scenario]]\nname = 'x'\n"), HasSubstr("no instance file"));
  std::string bytes = instance_bytes(small_set());
  bytes[8] = 5;
  EXPECT_THAT(refusal(sealed(bytes)), HasSubstr("version 5 (allowed: 1 to 4)"));
  // The shipped file is of an older version, which has what the ones before it have not.
  std::string older(shipped_instance_bytes());
  ASSERT_LT(older[8], 4);
  EXPECT_EQ(refusal(older), "");
  EXPECT_EQ(shipped().motions.front().setting, "vertical");
  older[8] = 1;
  EXPECT_THAT(refusal(sealed(older)), testing::AnyOf(std::string(), HasSubstr("flags 1, 2, 4, from version 2 on 8")));
  InstanceSet wrong = small_set();
  wrong.variants[0].records[0].warm_modes[0] = 4;
  EXPECT_THAT(refusal(instance_bytes(wrong)), HasSubstr("mode"));
  wrong = small_set();
  wrong.variants[0].records[0].start = 100000;
  EXPECT_THAT(refusal(instance_bytes(wrong)), HasSubstr("window"));
  wrong = small_set();
  wrong.variants[0].records[0].initial[0] = std::nan("");
  EXPECT_THAT(refusal(instance_bytes(wrong)), HasSubstr("finite"));
  wrong = small_set();
  wrong.variants[0].toml += "\nnonsense = 1\n";
  EXPECT_THAT(refusal(instance_bytes(wrong)), HasSubstr("nonsense"));
}

TEST(ProfileInstances, AKickIsAJumpOfTheSlidesVelocity) {
  const test::Folder folder;
  const Campaign campaign = small_campaign(folder);
  ScenarioConfig still = campaign.scenarios[1];
  actuator(still).kick.reset();
  const RunResult kicked = simulate(campaign.variants[0], campaign.scenarios[1], 1);
  const RunResult quiet = simulate(campaign.variants[0], still, 1);
  double largest_before = 0, jump = 0;
  for (std::size_t k = 0; k < kicked.ticks.size(); ++k) {
    const double apart = kicked.ticks[k].sensors.truth[velocity] - quiet.ticks[k].sensors.truth[velocity];
    if (k < 100) largest_before = std::max(largest_before, std::abs(apart));
    if (k == 100) jump = apart;
  }
  EXPECT_EQ(largest_before, 0.0);
  EXPECT_NEAR(jump, 0.4, 0.02);
}

}  // namespace
}  // namespace solenoid
