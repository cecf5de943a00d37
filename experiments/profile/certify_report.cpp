#include "experiments/base/machine.hpp"
#include "experiments/base/result.hpp"
#include "experiments/profile/certify.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Column = Table::Column;

constexpr const char* covered[] = {
    "Counted, and so true of every state, reference, set-point, command in flight, warm start and weight: nodes, model "
    "steps and bound steps of a solve of this mode set and grid, in registers of this machine.",
    "Measured, and so no proof: what work costs, on this machine, now, with what else runs on it; caches are warmer "
    "than in "
    "a loop that sleeps between solves. Interrupts and a clock that slows down come on top."};
constexpr const char* not_covered =
    "Not covered: other machines and builds; the estimator, posing the problem, and the plant's I/O (`profile` has "
    "them).";

/// One kind of work, or time: the bound and what was measured. Work is whole.
struct Line {
  const char *name, *heading;
  Json bound;
  std::vector<double> measured;

  Json number(double value) const {
    return bound.is_number_integer() ? Json(static_cast<std::int64_t>(value)) : Json(value);
  }
};

Table::Row row_of(const Line& line) {
  std::vector<double> sample = line.measured;  // not empty: without a solve nothing is printed
  const Percentiles p = percentiles(sample);
  const double bound = line.bound.get<double>();
  return {line.name,
          line.heading,
          line.bound,
          line.number(p.max),
          bound > 0 ? Json(p.max / bound) : Json(),
          line.number(sample.front()),
          line.number(p.p50),
          line.number(p.p99),
          line.number(p.p999),
          std::ranges::max_element(line.measured) - line.measured.begin()};
}

Table work_table(const Certificate& c) {
  const auto measured = [&](const auto& of) {
    std::vector<double> values;
    for (const MeasuredSolve& s : c.solves) values.push_back(static_cast<double>(of(s)));
    return values;
  };
  Table table{.name = "work",
              .columns = {Column("quantity"), Column("", "one solve", "<"), Column("bound", "bound"),
                          Column("largest", "largest measured"), Column("share", "of the bound %", ".1f%"),
                          Column("least", "least"), Column("p50", "p50"), Column("p99", "p99"), Column("p999", "p99.9"),
                          Column("problem", "largest in problem")}};
  const SolveWork& most = c.most.solve;
  for (const Line& line :
       {Line{"nodes", "nodes", most.nodes, measured([](const MeasuredSolve& s) { return s.work.nodes; })},
        Line{"model_steps", "model steps", most.model_steps,
             measured([](const MeasuredSolve& s) { return s.work.model_steps; })},
        Line{"bound_steps", "bound steps", most.bound_steps,
             measured([](const MeasuredSolve& s) { return s.work.bound_steps; })},
        Line{"time_us", "time us", 1e3 * c.bound_ms(), measured([](const MeasuredSolve& s) { return s.us; })}})
    table.add(row_of(line));
  return table;
}

Table set_table(const Certificate& c) {
  Table table{.name = "set",
              .title = "The set of states, each drawn uniformly",
              .columns = {Column("state", "state", "<"), Column("unit", "unit", "<"), Column("low", "from"),
                          Column("high", "to")}};
  const std::vector<Signal>& states = system_of(c.variant).description().states;
  for (std::size_t i = 0; i < c.ranges.size(); ++i)
    table.add({states[i].name, states[i].unit, c.ranges[i].low, c.ranges[i].high});
  return table;
}

Json json_of(const SolveWork& w) {
  return {{"nodes", w.nodes}, {"model_steps", w.model_steps}, {"bound_steps", w.bound_steps}};
}

Json costs_json(const WorkCosts& c) {
  return {
      {"fixed_us", c.fixed_us},           {"node_us", c.node_us}, {"model_step_us", c.model_step_us},
      {"bound_step_us", c.bound_step_us}, {"factor", c.factor},   {"whole_us", c.whole ? Json(c.whole_us) : Json()}};
}

Json deadline_json(const Certificate& c) {
  const DeadlineChecks& d = c.deadline;
  return {{"deadline_ms", c.deadline_ms},
          {"late_work", json_of(c.most.late)},
          {"late_us", c.costs.most_us(c.most.late)},
          {"checked", d.solves},
          {"cut", d.cut},
          {"worse_than_hold", d.worse_than_hold},
          {"wrong_bounds", d.wrong_bounds},
          {"latest_us", d.latest_us}};
}

std::vector<std::string> notes_of(const Certificate& c) {
  const WorkCosts& w = c.costs;
  const DeadlineChecks& d = c.deadline;
  std::vector<std::string> notes;
  notes.push_back(
      fmt::format("Time: at most {:.3g} ms, which is {} the period of {:g} ms: {:.3g} x ({:.3g} us + {:.3g} ns a node "
                  "+ {:.3g} ns a "
                  "model step + {:.3g} ns a bound step), a factor that no measured solve exceeds.",
                  c.bound_ms(), c.fits() ? "within" : "beyond", c.period_ms, w.factor, w.fixed_us, 1e3 * w.node_us,
                  1e3 * w.model_step_us, 1e3 * w.bound_step_us));
  if (w.whole)
    notes.push_back(fmt::format("The whole of it, nothing left out, really takes up to {:.3g} ms.", 1e-3 * w.whole_us));
  notes.push_back(fmt::format(
      "Deadline: of {:g} ms a solve ends at most {:.3g} us after, {} nodes, {} model steps and {} bound "
      "steps between two "
      "looks at the clock. Of {} solves, {} of which were cut short at a random moment: {} worse than "
      "holding the command "
      "in force, {} wrong bounds; the latest by {:.3g} us{}.",
      c.deadline_ms, c.costs.most_us(c.most.late), c.most.late.nodes, c.most.late.model_steps, c.most.late.bound_steps,
      d.solves, d.cut, d.worse_than_hold, d.wrong_bounds, d.latest_us,
      d.latest_us > c.costs.most_us(c.most.late) ? ", beyond that bound: the machine was busy, or work is dearer there"
                                                 : ""));
  notes.push_back(c.broken() ? fmt::format("BROKEN: {} solves did more than the bound.", c.exceeded())
                             : "No solve did more than the bound.");
  for (const char* line : covered) notes.emplace_back(line);
  notes.emplace_back(not_covered);
  return notes;
}

}  // namespace

Result result_of(const Certificate& c) {
  const System& system = system_of(c.variant);
  const std::string where = c.jobs == 1 ? fmt::format("core {}", c.core) : fmt::format("{} processes", c.jobs);
  return {.title = fmt::format("{}: the most that one solve can cost, and {} random problems (seed {}, {})",
                               c.variant.name, c.solves.size(), c.seed, where),
          .facts = {{"variant", c.variant.name},
                    {"system", system.name()},
                    {"solver", c.variant.solver},
                    {"states", c.solves.size()},
                    {"asked", c.asked},
                    {"seed", c.seed},
                    {"jobs", c.jobs},
                    {"core", c.core},
                    {"cpu", this_machine().cpu},
                    {"period_ms", c.period_ms},
                    {"bound_ms", c.bound_ms()},
                    {"fits", c.fits()},
                    {"exceeded", c.exceeded()},
                    {"broken", c.broken()},
                    {"costs", costs_json(c.costs)},
                    {"deadline", deadline_json(c)},
                    {"covers", covered},
                    {"not_covered", not_covered}},
          .tables = {work_table(c), set_table(c)},
          .notes = notes_of(c)};
}

}  // namespace solenoid
