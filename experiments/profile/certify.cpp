#include "experiments/profile/certify.hpp"

#include "controllers/factory.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/processes.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/profile/replay.hpp"
#include "experiments/profile/stopwatch.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

constexpr int repeats = 7;                         // of a solve whose time is to be sure
constexpr std::size_t timed_problems = 48;         // from which work's costs come,
constexpr double timed_s = 2.0;                    // or so many as that takes,
constexpr double whole_s = 0.25;                   // each cut off after this
constexpr std::uint64_t first_timed = 1ull << 40;  // problems of their own
constexpr std::size_t deadline_checks = 2000;      // spread over the problems
constexpr double rounding = 1e-9;                  // of sums in another order
constexpr std::size_t told_every = 64;

/// What a worker has found.
struct Findings {
  std::vector<MeasuredSolve> solves;
  double factor = 0.0;
  DeadlineChecks deadline;

  void add(const Findings& more) {
    solves.insert(solves.end(), more.solves.begin(), more.solves.end());
    factor = std::max(factor, more.factor);
    deadline.solves += more.deadline.solves;
    deadline.cut += more.deadline.cut;
    deadline.worse_than_hold += more.deadline.worse_than_hold;
    deadline.wrong_bounds += more.deadline.wrong_bounds;
    deadline.latest_us = std::max(deadline.latest_us, more.deadline.latest_us);
  }
  /// As bytes, for another process of this program.
  std::string bytes() const {
    std::string text(sizeof factor + sizeof deadline + solves.size() * sizeof(MeasuredSolve), '\0');
    std::memcpy(text.data(), &factor, sizeof factor);
    std::memcpy(text.data() + sizeof factor, &deadline, sizeof deadline);
    if (!solves.empty())
      std::memcpy(text.data() + sizeof factor + sizeof deadline, solves.data(), solves.size() * sizeof(MeasuredSolve));
    return text;
  }
  static Findings of(const std::string& text) {
    Findings f;
    constexpr std::size_t head = sizeof f.factor + sizeof f.deadline;
    std::memcpy(&f.factor, text.data(), sizeof f.factor);
    std::memcpy(&f.deadline, text.data() + sizeof f.factor, sizeof f.deadline);
    f.solves.resize((text.size() - head) / sizeof(MeasuredSolve));
    if (!f.solves.empty()) std::memcpy(f.solves.data(), text.data() + head, f.solves.size() * sizeof(MeasuredSolve));
    return f;
  }
};

/// The variant's solver on random problems.
class Certifier {
 public:
  Certifier(const VariantConfig& variant, const ScenarioList& tasks, std::uint64_t seed)
      : problems_(variant, tasks, seed),
        tools_(system_of(variant).tools(problems_.variant())),
        solver_(make_solver(problems_.variant())),
        start_(problems_.shape().new_plan()),
        plan_(problems_.shape().new_plan()) {
    solver_->prepare(problems_.shape());
  }

  const RandomProblems& problems() const { return problems_; }
  std::optional<MostWork> most_work() const { return solver_->most_work(problems_.shape()); }

  /// Times solves that leave nothing out, their phases apart, and solves without time for more than they begin with.
  WorkCosts costs(const std::function<bool()>& interrupted);
  /// Solves problems [first, end), whose deadlines are checked every so often.
  Findings measure(std::size_t first, std::size_t end, std::size_t every, WorkCosts costs,
                   const std::function<bool()>& interrupted, const std::function<void(std::size_t)>& progress);

 private:
  struct Timed {
    SolveReport report;
    double us = 0.0;
  };
  template <class MakeDeadline>
  Timed solve(const AnyProblem& problem, MakeDeadline deadline) {
    plan_->assign(*start_);
    const Deadline until = deadline();
    const Stopwatch watch;
    const SolveReport report = solver_->solve(problem, *plan_, until);
    return {report, watch.us()};
  }
  template <class MakeDeadline>
  Timed least_of(int passes, const AnyProblem& problem, MakeDeadline deadline) {
    Timed least = solve(problem, deadline);
    for (int i = 1; i < passes; ++i)
      if (const Timed again = solve(problem, deadline); again.us < least.us) least = again;
    return least;
  }
  void check_deadline(std::uint64_t number, AnyProblem& problem, const Timed& full, DeadlineChecks& checks);

  RandomProblems problems_;
  const ModelTools& tools_;
  AnySolverPtr solver_;
  std::unique_ptr<AnyPlan> start_, plan_;
};

/// Sums over the problems that costs come from.
struct TimedSums {
  double us = 0, nodes = 0, model_steps = 0, bound_steps = 0, problems = 0;
  void add(double time_us, const SolveWork& work) {
    us += time_us;
    nodes += static_cast<double>(work.nodes);
    model_steps += static_cast<double>(work.model_steps);
    bound_steps += static_cast<double>(work.bound_steps);
    ++problems;
  }
};

double ratio(double a, double b) { return a > 0 && b > 0 ? a / b : 0.0; }

WorkCosts Certifier::costs(const std::function<bool()>& interrupted) {
  struct Pair {
    Timed begun, whole;
  };
  std::vector<Pair> timed;
  TimedSums begun, whole;
  double roll_us = 0.0, bound_us = 0.0;
  const double us_per_tick = measured_us_per_phase_tick();
  PhaseTimes phases;
  const bool apart = solver_->time_phases(&phases);
  const auto began = Deadline::Clock::now();
  for (std::size_t i = 0; i < timed_problems && us_since(began) < 1e6 * timed_s && !interrupted(); ++i) {
    const AnyProblem& problem = problems_.pose(first_timed + i, *start_);
    Pair& pair = timed.emplace_back();
    pair.begun = least_of(repeats, problem, [] { return Deadline(Deadline::Clock::now()); });
    solver_->do_most_work(true);
    pair.whole.us = 1e300;
    PhaseTimes parts;
    for (int k = 0; k < repeats; ++k) {
      phases = {};
      const Timed again = solve(problem, [] { return Deadline::after_s(whole_s); });
      if (again.us < pair.whole.us) pair.whole = again, parts = phases;
    }
    solver_->do_most_work(false);
    begun.add(pair.begun.us, pair.begun.report.work());
    whole.add(pair.whole.us, pair.whole.report.work());
    roll_us += us_per_tick * static_cast<double>(parts.ticks[static_cast<std::size_t>(Phase::rollout)]);
    bound_us += us_per_tick * static_cast<double>(parts.ticks[static_cast<std::size_t>(Phase::bound)]);
  }
  solver_->time_phases(nullptr);
  WorkCosts c;
  if (timed.empty()) return c;
  // begun = fixed + node n0 + step s0 and whole - roll - bound = fixed + node n, summed over the problems. A solver that
  // does not tell its phases apart rolls all the time after it has begun.
  c.model_step_us = ratio(apart ? roll_us : whole.us - begun.us, whole.model_steps);
  c.bound_step_us = apart ? ratio(bound_us, whole.bound_steps) : 0.0;
  const double rolled_first = c.model_step_us * begun.model_steps;
  if (apart) c.node_us = ratio(whole.us - roll_us - bound_us - begun.us + rolled_first, whole.nodes - begun.nodes);
  c.fixed_us = std::max(0.0, begun.us - rolled_first - c.node_us * begun.nodes) / begun.problems;
  c.whole = true;
  for (const Pair& pair : timed) {
    for (const Timed& t : {pair.begun, pair.whole}) c.factor = std::max(c.factor, t.us / c.us(t.report.work()));
    c.whole_us = std::max(c.whole_us, pair.whole.us);
    c.whole = c.whole && pair.whole.report.status != Status::deadline_reached;
  }
  return c;
}

Findings Certifier::measure(std::size_t first, std::size_t end, std::size_t every, WorkCosts costs,
                            const std::function<bool()>& interrupted,
                            const std::function<void(std::size_t)>& progress) {
  Findings found;
  found.solves.reserve(end - first);
  double longest_us = 0.0;
  for (std::size_t number = first; number < end; ++number) {
    if (number % told_every == 0) {
      if (interrupted()) break;
      progress(number);
    }
    AnyProblem& problem = problems_.pose(number, *start_);
    Timed t = solve(problem, Deadline::never);
    const double usual_us = costs.us(t.report.work());
    if (t.us > longest_us || t.us > costs.factor * usual_us)
      t.us = std::min(t.us, least_of(repeats, problem, Deadline::never).us);
    longest_us = std::max(longest_us, t.us);
    costs.factor = std::max(costs.factor, t.us / usual_us);
    found.solves.push_back({t.report.work(), t.us});
    if (number % every == 0) check_deadline(number, problem, t, found.deadline);
  }
  found.factor = costs.factor;
  return found;
}

void Certifier::check_deadline(std::uint64_t number, AnyProblem& problem, const Timed& full, DeadlineChecks& checks) {
  if (!usable(full.report.status)) return;  // there is no optimum
  const double share = static_cast<double>(number * 0x9e3779b97f4a7c15u >> 11) * 0x1p-53;
  const double budget_us = share * full.us;
  const Timed kept = solve(problem, [&] { return Deadline::after_s(1e-6 * budget_us); });
  const SolveReport& report = kept.report;
  ++checks.solves;
  checks.cut += report.status == Status::deadline_reached;
  const double optimum = full.report.cost, unsure = rounding * std::abs(optimum);
  checks.wrong_bounds += report.bound > optimum + unsure || report.cost < optimum - unsure;
  if (const int hold = problem.modes.find(problem.lines.commanded()); hold >= 0 && usable(report.status)) {
    // The plan itself, not what is reported of it.
    const double cost = tools_.evaluate(problem, *plan_).cost;
    plan_->assign(*start_);
    std::ranges::fill(plan_->modes, hold);
    const SolveReport held = tools_.evaluate(problem, *plan_);
    checks.worse_than_hold += usable(held.status) && cost > held.cost * (1 + rounding);
  }
  // Later than any solve before: again, for it may have been the machine.
  double late_us = kept.us - budget_us;
  for (int i = 1; i < repeats && late_us > checks.latest_us; ++i)
    late_us = std::min(late_us, solve(problem, [&] { return Deadline::after_s(1e-6 * budget_us); }).us - budget_us);
  checks.latest_us = std::max(checks.latest_us, late_us);
}

/// Tasks of a campaign with the variant, or those of its system in real time.
Campaign tasks_of(const CertifyTask& task) {
  const Selection selection{{task.variant}, {}};
  const std::string name = task.campaign.empty()
                               ? simulation_of(system_of(shipped_variant(task.variant))).real_time_campaign()
                               : task.campaign;
  return read_campaign(name, selection);
}

/// Throws for a solver that knows no bound, naming those of the system that do.
[[noreturn]] void refuse(const VariantConfig& variant) {
  const System& system = system_of(variant);
  std::vector<std::string> able;
  for (const SolverRow& row : system.solvers()) {
    VariantConfig other = variant;
    other.solver = row.name;
    try {
      const auto shape = system.problem(other);
      if (make_solver(other)->most_work(*shape)) able.push_back(row.name);
    } catch (const std::exception&) {  // it is not made for this variant
    }
  }
  throw ConfigError(fmt::format(
      "variant '{}': the solver '{}' knows no bound of its work that holds for every problem: only a deadline "
      "ends it (allowed: variants whose solver is {})",
      variant.name, variant.solver, fmt::join(able, " or ")));
}

/// The same in worker processes; those that an interrupt ends leave nothing.
Findings measure_in_processes(const CertifyTask& task, const VariantConfig& variant, const ScenarioList& tasks,
                              std::size_t every, const WorkCosts& costs) {
  const auto jobs = static_cast<std::size_t>(task.jobs);
  const std::size_t share = std::clamp<std::size_t>(task.states / (8 * jobs), 500, 20000);
  std::vector<std::size_t> items((task.states + share - 1) / share);
  std::iota(items.begin(), items.end(), std::size_t{0});
  std::vector<Findings> parts(items.size());
  std::size_t done = 0;
  std::string trouble;
  PoolEvents events;
  events.ended = [&](std::size_t item, const Outcome& outcome) {
    if (!outcome.done) throw std::runtime_error("certify: a worker failed: " + outcome.text);
    parts[item] = Findings::of(outcome.text);
    task.progress(done += parts[item].solves.size());
  };
  events.interrupted = task.interrupted;
  work_in_processes(
      items, task.jobs,
      [&](std::size_t item) {
        Certifier own(variant, tasks, task.seed);
        return own
            .measure(
                item * share, std::min(task.states, (item + 1) * share), every, costs, [] { return false; },
                [](std::size_t) { work_goes_on(); })
            .bytes();
      },
      events);
  Findings all;
  for (const Findings& part : parts) {
    if (part.solves.empty()) break;  // problems after a gap are left out: solves[n] is problem n
    all.add(part);
  }
  return all;
}

}  // namespace

std::size_t Certificate::exceeded() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(solves, [&](const MeasuredSolve& s) { return !s.work.within(most.solve); }));
}

Certificate certify(const CertifyTask& task) {
  const Campaign campaign = tasks_of(task);
  const VariantConfig& variant = campaign.variants.front();
  if (find_row(system_of(variant).laws(), variant.solver))
    throw ConfigError(fmt::format("variant '{}': '{}' is a law, it solves nothing (allowed: variants with a solver)",
                                  variant.name, variant.solver));
  Certifier certifier(variant, campaign.scenarios, task.seed);
  const std::optional<MostWork> most = certifier.most_work();
  if (!most) refuse(variant);
  const VariantConfig& told = certifier.problems().variant();
  Certificate c;
  c.variant = told;
  c.ranges.assign(certifier.problems().ranges().begin(), certifier.problems().ranges().end());
  c.asked = task.states;
  c.seed = task.seed;
  c.jobs = task.jobs;
  c.period_ms = 1e3 * told.timing.period_s();
  c.deadline_ms = task.deadline_ms ? *task.deadline_ms : told.deadline_ms.value_or(c.period_ms);
  c.most = *most;
  const std::size_t every = std::max<std::size_t>(1, task.states / deadline_checks);
  Findings found;
  {
    const PinnedCore pinned(task.core);
    c.core = pinned.core();
    c.costs = certifier.costs(task.interrupted);
    if (task.jobs == 1) found = certifier.measure(0, task.states, every, c.costs, task.interrupted, task.progress);
  }
  if (task.jobs > 1) found = measure_in_processes(task, variant, campaign.scenarios, every, c.costs);
  c.solves = std::move(found.solves);
  c.deadline = found.deadline;
  c.costs.factor = std::max(c.costs.factor, found.factor);
  return c;
}

}  // namespace solenoid
