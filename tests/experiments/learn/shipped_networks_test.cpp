#include "controllers/instances/instance_set.hpp"
#include "controllers/networks.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/embedded.hpp"
#include "experiments/base/files.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/profile/shipped_instances.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using testing::HasSubstr;

/// The 700 problems of nine_robust, each with its certified optimum.
const InstanceSet& recorded() {
  static const InstanceSet set = [] {
    InstanceSet all = parse_instances(shipped_instance_bytes(), "shipped");
    std::erase_if(all.variants, [](const VariantInstances& v) { return v.name != "nine_robust"; });
    return all;
  }();
  return set;
}

double judged(const System& system, const VariantConfig& v, const AnyProblem& problem, AnyPlan& plan) {
  return system.tools(v).evaluate(problem, plan).cost;
}

/// The shipped variant on every recorded problem; how many plans cost what the optimum does.
std::size_t optima_of(const std::string& name) {
  const VariantConfig taught = shipped_variant(name);
  const VariantInstances& instances = recorded().variants.front();
  VariantConfig v = instances.config;
  v.solver = taught.solver;
  v.learned = taught.learned;
  const System& system = system_of(v);
  const auto solver = make_solver(v);
  std::size_t optima = 0;
  std::uint32_t motion = ~0u;
  std::unique_ptr<AnyProblem> problem;
  for (const InstanceRecord& record : instances.records) {
    if (record.motion != motion) {
      motion = record.motion;
      problem = system.problem(told(v, recorded().motions[motion]));
      solver->prepare(*problem);
    }
    const auto plan = problem->new_plan(), other = problem->new_plan();
    pose(recorded(), record, *problem, *plan);
    other->assign(*plan);
    const double warm = judged(system, v, *problem, *other);
    std::ranges::fill(other->modes, std::max(0, problem->modes.find(problem->lines.commanded())));
    const double held = judged(system, v, *problem, *other);
    const SolveReport report = solver->solve(*problem, *plan, Deadline::never());
    EXPECT_EQ(report.status, Status::feasible);
    EXPECT_LE(report.cost, warm);
    EXPECT_LE(report.cost, held);
    EXPECT_GE(report.cost, record.plan_cost * (1 - 1e-12));
    EXPECT_LE(report.bound, record.plan_cost);
    EXPECT_EQ(report.cost, judged(system, v, *problem, *plan));
    optima += report.cost <= record.plan_cost * (1 + 1e-12);
  }
  EXPECT_EQ(instances.records.size(), 700u);
  return optima;
}

TEST(ShippedNetworks, ThePolicyIsNeverWorseThanHoldingOrTheWarmStartAndMostlyOptimal) {
  EXPECT_GE(optima_of("nine_policy"), 500u);
}

TEST(ShippedNetworks, SoIsTheSearchOfTwoBlocksWithALearnedCost) { EXPECT_GE(optima_of("nine_learned_tail"), 350u); }

TEST(ShippedNetworks, AreNetworksOfBoundedSize) {
  int networks = 0;
  for (const std::string& name : embedded_names())
    if (name.starts_with("networks/")) {
      ++networks;
      EXPECT_LE(embedded_text(name).size(), 300'000u) << name;
      EXPECT_NO_THROW(read_mlp(std::string(embedded_text(name)), name));
    }
  EXPECT_GE(networks, 2);
}

/// A manifest is of its network, and has everything that the network is made again with.
TEST(ShippedNetworks, HaveTheManifestsThatTheProgramWroteBesideThem) {
  const std::string folder = SOLENOID_SOURCE_DIR "/experiments/systems/actuator/data/networks/";
  for (const std::string name : {"nine_policy", "nine_tail"}) {
    const std::string text = test::text_of(folder + name + ".toml");
    const MlpData network = read_mlp(text, name);
    const nlohmann::json manifest = nlohmann::json::parse(test::text_of(folder + name + ".manifest.json"));
    EXPECT_EQ(manifest["network"], fingerprint(text)) << name;
    EXPECT_EQ(manifest["kind"], network.kind);
    EXPECT_EQ(manifest["layout"], network.layout);
    EXPECT_EQ(manifest["settings"]["activation"], "relu");
    EXPECT_EQ(manifest["interrupted"], false);
    ASSERT_TRUE(manifest["data"].contains("ways")) << name;
    EXPECT_EQ(manifest["data"]["ways"].is_number(), network.kind == "cost") << name;
    EXPECT_EQ(manifest["losses"].size(), manifest["settings"]["epochs"]);
  }
}

TEST(ShippedNetworks, OneThatThereIsNotIsRefusedWithItsName) {
  const auto refusal = [](const std::string& learned) {
    try {
      TableReader table = TableReader::from_text(
          "valves = \"two_way\"\nmotor = \"in_prediction\"\nsolver = \"policy\"\n" + learned, "mine.toml");
      read_variant(table, "mine");
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  const std::string blocks = "horizon = { steps = 40, blocks = [1, 1, 2, 4] }\n";
  EXPECT_THAT(refusal(blocks), HasSubstr("has no network"));
  EXPECT_THAT(refusal(blocks + "learned = { network = \"nobody\" }\n"), HasSubstr("'nobody' is no network"));
  EXPECT_THAT(refusal(blocks + "learned = { network = \"none.toml\" }\n"), HasSubstr("none.toml cannot be read"));
  EXPECT_THAT(refusal("learned = { network = \"nine_policy\" }\n"), HasSubstr("was taught on"));
  EXPECT_THAT(refusal(blocks + "learned = { network = \"nine_tail\" }\n"), HasSubstr("is of kind 'cost'"));
  EXPECT_EQ(refusal(blocks + "learned = { network = \"nine_policy\" }\n"), "accepted");
}

}  // namespace
}  // namespace solenoid
