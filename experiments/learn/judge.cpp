#include "experiments/learn/judge.hpp"

#include "controllers/networks.hpp"
#include "core/config/reader.hpp"
#include "core/metrics/metrics.hpp"
#include "experiments/base/gap.hpp"
#include "experiments/base/result.hpp"
#include "experiments/learn/held_out.hpp"
#include "experiments/profile/record.hpp"
#include "experiments/profile/stopwatch.hpp"

#include <algorithm>
#include <memory>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Column = Table::Column;

/// What a solver starts from.
enum class Start { warm, holding };

/// The problems of a set under one solver.
class Judge {
 public:
  Judge(const InstanceSet& set, int passes) : set_(set), records_(set.variants.front().records), passes_(passes) {}

  JudgedSolver judge(const std::string& name, const VariantConfig& config, Start start) const {
    std::vector<double> us(records_.size(), 1e300), gap, nodes;
    double cost = 0.0, optimum = 0.0, all_nodes = 0.0;
    std::size_t optima = 0;
    const auto solver = make_solver(config);
    std::unique_ptr<AnyProblem> problem;
    std::unique_ptr<AnyPlan> plan;
    JudgedSolver judged{.name = name};
    for (int pass = 0; pass < passes_; ++pass) {
      std::uint32_t motion = ~0u;
      for (std::size_t i = 0; i < records_.size(); ++i) {
        const InstanceRecord& record = records_[i];
        if (record.motion != motion) {
          motion = record.motion;
          problem = system_of(config).problem(told(config, set_.motions[motion]));
          plan = problem->new_plan();
          solver->prepare(*problem);
        }
        pose(set_, record, *problem, *plan);
        if (start == Start::holding)
          std::ranges::fill(plan->modes, std::max(0, problem->modes.find(record.lines.commanded())));
        const Stopwatch watch;
        const SolveReport report = solver->solve(*problem, *plan, Deadline::never());
        us[i] = std::min(us[i], watch.us());
        if (pass > 0) continue;
        gap.push_back(gap_above(report.cost, record.plan_cost));
        nodes.push_back(static_cast<double>(report.nodes));
        all_nodes += nodes.back();
        optima += gap.back() <= 0.0;
        cost += report.cost;
        optimum += record.plan_cost;
      }
    }
    const auto count = static_cast<double>(records_.size());
    judged.optimal = static_cast<double>(optima) / count;
    judged.nodes_mean = all_nodes / count;
    judged.ratio = 1.0 + gap_above(cost, optimum);
    const Percentiles g = percentiles(gap), t = percentiles(us), n = percentiles(nodes);
    judged.gap_p50 = g.p50, judged.gap_p90 = g.p90, judged.gap_p99 = g.p99, judged.gap_max = g.max;
    judged.us_p50 = t.p50, judged.us_p99 = t.p99, judged.us_p999 = t.p999, judged.us_max = t.max;
    judged.nodes_p50 = n.p50, judged.nodes_p999 = n.p999, judged.nodes_max = n.max;
    return judged;
  }

 private:
  const InstanceSet& set_;
  const std::vector<InstanceRecord>& records_;
  int passes_;
};

/// The variant's teacher with the network of a file in its place.
VariantConfig taught_by_file(VariantConfig v, const JudgeTask& task) {
  if (!is_network_file(task.network))
    throw ConfigError(fmt::format("--network: '{}' (allowed: a file NAME.toml)", task.network));
  try {
    take_in_network_file(task.network);
  } catch (const ConfigError& wrong) {
    throw ConfigError(fmt::format("--network: {}", wrong.what()));
  }
  v.learned = {task.network, task.searched_blocks};
  v.solver = find_network(task.network)->data().kind == "cost" ? "learned_tail" : "policy";
  return v;
}

/// The variant as it is taught, at the sampling of the problems.
VariantConfig taught(const JudgeTask& task, const VariantConfig& teacher) {
  VariantConfig v = teacher;
  if (!task.network.empty()) {
    v = taught_by_file(v, task);
  } else {
    const VariantConfig own = read_campaign(task.campaign, {.variants = {task.variant}}).variants.front();
    if (own.learned.network.empty())
      throw ConfigError(
          fmt::format("variant '{}' has no learned.network (allowed: one that has, or --network)", own.name));
    v.solver = own.solver;
    v.learned = own.learned;
  }
  if (const ReadySolver ready = ready_solver(v, *system_of(v).problem(v)); !ready.solver)
    throw ConfigError(fmt::format("{}: '{}' {}", task.network.empty() ? "learned.network" : "--network",
                                  v.learned.network, ready.misfit));
  return v;
}

Table times_and_gaps(const JudgeResult& r) {
  Table table{.name = "solvers",
              .title = fmt::format("{} problems of held-out plants, each with a certified optimum", r.states),
              .columns = {Column("name", "solver", "<"), Column("optimal_share", "at the optimum %", ".1f%"),
                          Column("gap_p50", "gap p50 %", ".2f%"), Column("gap_p90", "p90", ".2f%"),
                          Column("gap_p99", "p99", ".2f%"), Column("gap_max", "max", ".3g%"),
                          Column("cost_ratio", "sum of costs", ".4f"), Column("p50_us", "p50 us", ".2f"),
                          Column("p99_us", "p99", ".2f"), Column("p999_us", "p99.9", ".2f"),
                          Column("max_us", "max", ".2f"), Column("nodes_mean", "nodes mean", ".1f"),
                          Column("nodes_p50", "p50"), Column("nodes_p999", "p99.9"), Column("nodes_max", "max")}};
  for (const JudgedSolver& s : r.solvers)
    table.add({s.name, s.optimal, s.gap_p50, s.gap_p90, s.gap_p99, s.gap_max, s.ratio, s.us_p50, s.us_p99, s.us_p999,
               s.us_max, s.nodes_mean, s.nodes_p50, s.nodes_p999, s.nodes_max});
  return table;
}

}  // namespace

std::optional<JudgeResult> judge(const JudgeTask& task) {
  const SplitCampaign split = split_campaign(task.campaign, task.variant);
  JudgeResult r;
  r.task = task;
  VariantConfig student = taught(task, split.held_out.variants.front());
  r.kind = find_network(student.learned.network)->data().kind;
  task.tell("learn: recording the teacher's closed loops, held-out plants");
  const InstanceSet set = record_instances(split.held_out, task.states, task.interrupted);
  const VariantInstances& variant = set.variants.front();
  if (task.interrupted()) return std::nullopt;
  if (variant.records.empty()) throw ConfigError("--states: no problem was recorded (allowed: more)");
  r.states = variant.records.size();
  VariantConfig timed_student = variant.config;
  timed_student.solver = student.solver;
  timed_student.learned = student.learned;
  const Judge judge(set, task.passes);
  const auto add = [&](const std::string& name, const VariantConfig& config, Start start) {
    if (!task.interrupted()) r.solvers.push_back(judge.judge(name, config, start));
  };
  task.tell("learn: judging");
  add("branch_and_bound", variant.config, Start::warm);
  add(student.solver, timed_student, Start::warm);
  add(student.solver + " from holding", timed_student, Start::holding);
  if (r.kind == "policy") {
    VariantConfig helped = timed_student;
    helped.solver = "branch_and_bound";
    add("branch_and_bound, helped", helped, Start::warm);
  } else {
    const SampleSettings samples{
        .taught = Taught::cost, .perturbed = 0.0, .searched_blocks = student.learned.searched_blocks};
    r.learned =
        quality_on(training_set(set, variant, samples, task.interrupted), *find_network(student.learned.network));
  }
  if (task.interrupted()) return std::nullopt;
  return r;
}

Result result_of(const JudgeResult& r) {
  Result result{
      .facts = {{"variant", r.task.variant}, {"campaign", r.task.campaign}, {"kind", r.kind}, {"states", r.states}},
      .tables = {times_and_gaps(r)},
      .notes = {fmt::format("Gap: cost above the optimum. Times: the least of {} passes. 'from holding': without "
                            "the warm start that the closed loop has. 'helped': with the network's best proposal "
                            "among the search's incumbents.",
                            r.task.passes)}};
  if (!r.learned) return result;
  const TaughtQuality& q = *r.learned;
  Table learned{.name = "learned_cost",
                .title = "The learned cost where the searched blocks end, relative to the true one",
                .columns = {Column("samples", "samples"), Column("error_p50", "error p50 %", ".2f%"),
                            Column("error_p90", "p90", ".2f%"), Column("error_max", "max", ".3g"),
                            Column("overestimated_share", "overestimated %", ".1f%"),
                            Column("overestimate_p50", "by p50 %", ".2f%"), Column("overestimate_p90", "p90", ".2f%"),
                            Column("overestimate_max", "max", ".3g")}};
  learned.add({q.samples, q.error_p50, q.error_p90, q.error_max, q.violations, q.violation_p50, q.violation_p90,
               q.violation_max});
  result.tables.push_back(std::move(learned));
  return result;
}

}  // namespace solenoid
