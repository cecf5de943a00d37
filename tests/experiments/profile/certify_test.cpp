#include "experiments/profile/certify.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/result.hpp"
#include "experiments/campaign/campaign.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <set>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using nlohmann::json;
using test::Folder;
using test::ProgramRun;
using test::refusal_of;
using test::run_program;
using testing::HasSubstr;

json certified(const std::string& arguments) {
  const Folder folder;
  const ProgramRun run = run_program(folder, "certify " + arguments + " --format json");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return json::parse(run.out);
}

json row(const json& certificate, const std::string& quantity) {
  for (const json& line : certificate.at("work"))
    if (line.at("quantity") == quantity) return line;
  ADD_FAILURE() << "no " << quantity;
  return {};
}

TEST(Certify, CountsTheThesisFourStatesAndEveryProblemTakesThem) {
  const json c = certified("thesis_pd --states 2000");
  EXPECT_EQ(row(c, "nodes").at("bound"), 4);  // each once, over 100 steps, in one register
  EXPECT_EQ(row(c, "nodes").at("largest"), 4);
  EXPECT_EQ(row(c, "nodes").at("p50"), 4);
  EXPECT_EQ(row(c, "model_steps").at("bound").get<int>() % 400, 0);
  EXPECT_EQ(row(c, "bound_steps").at("bound"), 0);
  EXPECT_EQ(c.at("exceeded"), 0);
  EXPECT_EQ(c.at("states"), 2000);
}

TEST(Certify, NoProblemOfASearchExceedsItsBound) {
  for (const char* variant : {"nine_state_2", "nine_state", "flyer_single", "inverter_n3"}) {
    const json c =
        certified(std::string(variant) + " --states " + (std::string(variant) == "nine_state_2" ? "2000" : "300"));
    EXPECT_EQ(c.at("exceeded"), 0) << variant;
    EXPECT_EQ(c.at("broken"), false) << variant;
    for (const char* quantity : {"nodes", "model_steps", "bound_steps"}) {
      const json line = row(c, quantity);
      EXPECT_LE(line.at("largest"), line.at("bound")) << variant << " " << quantity;
      EXPECT_LE(line.at("p50"), line.at("p99"));
      EXPECT_LE(line.at("p999"), line.at("largest"));
    }
    EXPECT_GT(row(c, "nodes").at("largest"), row(c, "nodes").at("least")) << variant;
    const json& costs = c.at("costs");
    EXPECT_GT(costs.at("model_step_us"), 0.0);
    EXPECT_GE(costs.at("factor"), 1.0);
    EXPECT_GT(c.at("bound_ms"), 0.0);
    EXPECT_EQ(c.at("fits"), c.at("bound_ms") <= c.at("period_ms"));
    const json& deadline = c.at("deadline");
    EXPECT_GT(deadline.at("cut"), 0) << variant;
    EXPECT_EQ(deadline.at("worse_than_hold"), 0) << variant;
    EXPECT_EQ(deadline.at("wrong_bounds"), 0) << variant;
    EXPECT_LE(deadline.at("late_work").at("nodes"), row(c, "nodes").at("bound"));
    for (const json& state : c.at("set")) EXPECT_LT(state.at("low"), state.at("high"));
  }
}

TEST(Certify, AWholeSearchCountsTheTreeOfFourBlocks) {
  const json c = certified("nine_state_4 --states 50 --deadline-ms 1");
  EXPECT_EQ(row(c, "nodes").at("bound"), 9 + 81 + 729 + 6561 + (2 + 2 * 9) * 4);
  EXPECT_GT(row(c, "bound_steps").at("bound"), 0);
  EXPECT_GT(c.at("costs").at("whole_us"), 0.0);
  EXPECT_EQ(c.at("deadline").at("deadline_ms"), 1.0);
}

TEST(Certify, WorkersAndOneProcessCountTheSame) {
  const json one = certified("nine_state --states 1500"), two = certified("nine_state --states 1500 --jobs 2");
  for (const char* quantity : {"nodes", "model_steps", "bound_steps"})
    EXPECT_EQ(row(one, quantity), row(two, quantity));
  EXPECT_NE(row(one, "nodes"), row(certified("nine_state --states 1500 --seed 2"), "nodes"));
}

TEST(Certify, ProblemsAreDrawnOverTheWholeSetAndRepeat) {
  const VariantConfig variant = shipped_variant("nine_state");
  const Campaign tasks = read_campaign("rig", {{"nine_state"}, {}});
  RandomProblems problems(variant, tasks.scenarios, 1), again(variant, tasks.scenarios, 1);
  const auto plan = problems.shape().new_plan(), other = problems.shape().new_plan();
  std::vector<double> low(4, 1e300), high(4, -1e300);
  std::set<SwitchPattern> commanded;
  int in_flight = 0, far = 0;
  for (std::uint64_t n = 0; n < 2000; ++n) {
    const AnyProblem& p = problems.pose(n, *plan);
    for (std::size_t i = 0; i < 4; ++i) {
      low[i] = std::min(low[i], p.initial_values()[i]);
      high[i] = std::max(high[i], p.initial_values()[i]);
    }
    commanded.insert(p.lines.commanded());
    in_flight += p.lines.settled_after() > 0;
    const double wanted = p.reference_values()[0];
    far += wanted < problems.ranges()[0].low || wanted > problems.ranges()[0].high;
    if (n % 500 != 7) continue;
    const AnyProblem& same = again.pose(n, *other);
    EXPECT_TRUE(std::ranges::equal(same.initial_values(), p.initial_values()));
    EXPECT_TRUE(std::ranges::equal(same.reference_values(), p.reference_values()));
    EXPECT_EQ(same.lines, p.lines);
    EXPECT_EQ(other->modes, plan->modes);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    const StateRange& range = problems.ranges()[i];
    EXPECT_GE(low[i], range.low);
    EXPECT_LE(high[i], range.high);
    EXPECT_GT(high[i] - low[i], 0.98 * (range.high - range.low));
  }
  EXPECT_EQ(commanded.size(), 9u);
  EXPECT_GT(in_flight, 400);
  EXPECT_GT(far, 200);
}

TEST(Certify, RefusesWhatHasNoBound) {
  const Folder folder;
  EXPECT_THAT(refusal_of(folder, "certify relaxed_pwm"), HasSubstr("allowed: variants whose solver is exhaustive or"));
  EXPECT_THAT(refusal_of(folder, "certify takemura_hybrid"), HasSubstr("is a law"));
  EXPECT_THAT(refusal_of(folder, "certify nobody"), HasSubstr("'nobody' is not known"));
  EXPECT_THAT(refusal_of(folder, "certify"), HasSubstr("variant"));
  EXPECT_THAT(refusal_of(folder, "certify thesis_pd --states 0"), HasSubstr("--states"));
  EXPECT_THAT(refusal_of(folder, "certify thesis_pd --deadline-ms -1"), HasSubstr("--deadline-ms"));
  EXPECT_THAT(refusal_of(folder, "certify thesis_pd --core 1000"), HasSubstr("--core"));
  EXPECT_THAT(refusal_of(folder, "certify thesis_pd --campaign none.toml"), HasSubstr("none.toml"));
}

TEST(Certify, ABoundThatDoesNotHoldIsToldAndWhatAnInterruptLeavesIsPrinted) {
  CertifyTask task{.variant = "nine_state_2", .states = 100000};
  std::size_t seen = 0;
  task.progress = [&](std::size_t done) { seen = done; };
  task.interrupted = [&] { return seen >= 500; };
  Certificate c = certify(task);
  EXPECT_FALSE(c.complete());
  EXPECT_GE(c.solves.size(), 500u);
  EXPECT_LT(c.solves.size(), 1000u);
  EXPECT_FALSE(c.broken());
  EXPECT_EQ(json::parse(result_of(c).json()).at("states"), c.solves.size());
  c.solves[3].work = c.most.solve;
  EXPECT_FALSE(c.broken());
  c.solves[3].work.nodes = c.most.solve.nodes + 1;
  EXPECT_EQ(c.exceeded(), 1u);
  EXPECT_TRUE(c.broken());
  EXPECT_THAT(result_of(c).text(false), HasSubstr("BROKEN: 1 "));
}

}  // namespace
}  // namespace solenoid
