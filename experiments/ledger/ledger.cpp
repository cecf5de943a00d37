#include "experiments/ledger/ledger.hpp"

#include "controllers/compiled_solvers.hpp"
#include "core/config/reader.hpp"
#include "solvers/minlp/bonmin.hpp"

#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

constexpr double most_sequences = 1e6;

/// A solver with a network in the place of the variant's own.
ReadySolver taught_solver(VariantConfig v, const AnyProblem& problem, const char* name, const std::string& network) {
  v.solver = name;
  v.learned.network = network;
  return ready_solver(v, problem);
}

class Keeper {
 public:
  Keeper(const InstanceSet& set, const VariantInstances& variant, const LedgerOptions& options)
      : set_(set),
        variant_(variant),
        options_(options),
        tools_(system_of(variant.config).tools(variant.config)),
        problem_(system_of(variant.config).problem(variant.config)),
        warm_(problem_->new_plan()) {
    search_->prepare(*problem_);
    enumerate_->prepare(*problem_);
    for (const Contender& c : contenders_) c.solver->prepare(*problem_);
    for (const RecordedMotion& motion : set.motions)
      problems_.push_back(system_of(variant.config).problem(told(variant.config, motion)));
    const std::string policy = options.policy_network.value_or("nine_policy");
    add_learned(M::policy, "policy", policy);
    add_learned(M::learned_tail, "learned_tail", options.cost_network.value_or("nine_tail"));
    add_learned(M::taught_search, "branch_and_bound", policy);
    if (options.bonmin_states > 0 && minlp::available()) {
      add_bonmin(M::bonmin, "branch_and_bound");
      add_bonmin(M::bonmin_outer_approximation, "outer_approximation");
      add_bonmin(M::bonmin_feasibility_pump, "feasibility_pump");
    }
  }

  LedgerOfVariant run() {
    LedgerOfVariant ledger{variant_.name, fmt::format("{}", fmt::join(problem_->horizon.blocks, "-")), {}, {}, 0};
    const std::size_t all = variant_.records.size(), count = std::min(all, options_.states);
    for (std::size_t i = 0; i < count; ++i) {
      if (options_.stop && options_.stop()) break;
      const bool with_bonmin = (i * options_.bonmin_states) / count != ((i + 1) * options_.bonmin_states) / count;
      ledger.states.push_back(keep((2 * i + 1) * all / (2 * count), with_bonmin));
      check_chain(ledger.states.back(), ledger);
      if (options_.progress) options_.progress(ledger.name, i + 1, count);
    }
    return ledger;
  }

 private:
  using M = LedgerMethod;

  LedgerState keep(std::size_t index, bool with_bonmin) {
    const InstanceRecord& record = variant_.records[index];
    AnyProblem& problem = *problems_[record.motion];
    pose(set_, record, problem, *warm_);
    LedgerState state;
    state.record = index;
    const auto entry = [&](M method) -> LedgerEntry& { return state.entries[static_cast<std::size_t>(method)]; };
    Held<AnyPlan> best(*warm_);
    SolveReport report = search_->solve(problem, *best, Deadline::never());
    entry(M::branch_and_bound) = {report.status, true, tools_.evaluate(problem, *best).cost, report.time_us};
    state.bound = report.bound;
    solve_plan(problem, {M::exhaustive, enumerate_}, entry(M::exhaustive));
    hold(problem, entry(M::held));
    for (const Contender& c : contenders_) solve_plan(problem, c, entry(c.method));
    if (with_bonmin)
      for (const Contender& c : bonmins_) solve_plan(problem, c, entry(c.method));
    report = relaxed_->solve(problem, *best);
    entry(M::relaxed) = {report.status, true, report.cost, report.time_us};
    return state;
  }

  /// Where the network fits the variant's problems; those that it does not fit have no such row.
  void add_learned(LedgerMethod method, const char* solver, const std::string& network) {
    ReadySolver taught = taught_solver(variant_.config, *problem_, solver, network);
    if (taught.solver) contenders_.push_back({method, std::move(taught.solver)});
  }

  /// Where the mode set is not beyond its equations.
  void add_bonmin(LedgerMethod method, const char* algorithm) {
    VariantConfig v = variant_.config;
    v.solver = "bonmin";
    v.minlp.algorithm = algorithm;
    ReadySolver ready = ready_solver(v, *problem_);
    if (ready.solver) bonmins_.push_back({method, std::move(ready.solver), options_.bonmin_limit_s});
  }

  /// A method, what solves by it, and how much time it has on each state.
  struct Contender {
    LedgerMethod method;
    std::shared_ptr<AnySolver> solver;
    double budget_s = std::numeric_limits<double>::infinity();
  };

  /// Judged by evaluate(), whatever the solver says of itself.
  void solve_plan(const AnyProblem& problem, const Contender& c, LedgerEntry& entry) {
    Held<AnyPlan> plan(*warm_);
    const SolveReport report = c.solver->solve(problem, *plan, Deadline::after_s(c.budget_s));
    entry = {report.status, true, tools_.evaluate(problem, *plan).cost, report.time_us};
  }

  void hold(const AnyProblem& problem, LedgerEntry& entry) {
    const auto start = Deadline::Clock::now();
    entry = {Status::feasible, true, std::numeric_limits<double>::infinity(), 0.0};
    Held<AnyPlan> plan(*warm_);
    for (int mode = 0; mode < problem.modes.size(); ++mode) {
      std::ranges::fill(plan->modes, mode);
      entry.cost = std::min(entry.cost, tools_.evaluate(problem, *plan).cost);
    }
    entry.time_us = us_since(start);
  }

  void check_chain(const LedgerState& state, LedgerOfVariant& ledger) {
    const auto violated = [&](const std::string& what) { ledger.violations.push_back({state.record, what}); };
    const LedgerEntry &bb = state.of(M::branch_and_bound), &all = state.of(M::exhaustive),
                      &relaxed = state.of(M::relaxed);
    const double allowance = cost_rounding * bb.cost;
    if (bb.status != Status::optimal) violated(fmt::format("branch and bound: {}", to_string(bb.status)));
    if (bb.cost != all.cost)
      violated(fmt::format("branch and bound {:.17g} is not exhaustive {:.17g}", bb.cost, all.cost));
    if (const LedgerEntry& taught = state.of(M::taught_search); taught.tried && taught.cost != bb.cost)
      violated(fmt::format("branch and bound {:.17g}, taught {:.17g}", bb.cost, taught.cost));
    if (relaxed.cost > bb.cost + allowance)
      violated(fmt::format("relaxed {:.17g} above branch and bound {:.17g}", relaxed.cost, bb.cost));
    ledger.relaxed_stationary += relaxed.status == Status::optimal;
    for (std::size_t m = 0; m < ledger_methods; ++m) {
      const LedgerEntry& entry = state.entries[m];
      if (m == static_cast<std::size_t>(M::relaxed) || !entry.tried) continue;
      if (!(entry.cost >= bb.cost - allowance))
        violated(fmt::format("{} {:.17g} below branch and bound {:.17g}", to_string(static_cast<M>(m)), entry.cost,
                             bb.cost));
    }
  }

  Contender rounder(LedgerMethod method, RoundingMethod rounding, bool improve) const {
    return {method, tools_.rounding({.most_iterations = 60, .tolerance = 1e-5},
                                    {.method = rounding, .improve = improve, .keep_start = improve})};
  }
  /// Draws 128 sequences an update, as many as there is time for.
  Contender sampler(LedgerMethod method, const char* name, double budget_s) const {
    VariantConfig endless = variant_.config;
    endless.sampling.samples = 1 << 20;
    endless.sampling.iterations = endless.sampling.samples / 128;
    return {method, solver_of(name, endless), budget_s};
  }
  /// The system's solver of this name.
  AnySolverPtr solver_of(const char* name, const VariantConfig& variant) const {
    return make_solver(*find_row(system_of(variant).solvers(), name), problem_->model_type(), variant);
  }

  const InstanceSet& set_;
  const VariantInstances& variant_;
  const LedgerOptions& options_;
  const ModelTools& tools_;
  std::unique_ptr<AnyProblem> problem_;                // without a motion, for shapes
  std::vector<std::unique_ptr<AnyProblem>> problems_;  // of each motion
  std::unique_ptr<AnyPlan> warm_;
  AnySolverPtr search_ = solver_of("branch_and_bound", variant_.config);
  std::shared_ptr<AnySolver> enumerate_ = solver_of("exhaustive", variant_.config);
  std::unique_ptr<RelaxedBound> relaxed_ = tools_.relaxed_bound(*problem_);
  std::vector<Contender> contenders_{rounder(M::sum_up, RoundingMethod::sum_up, false),
                                     rounder(M::sum_up_improved, RoundingMethod::sum_up, true),
                                     rounder(M::cia, RoundingMethod::integral_approximation, false),
                                     rounder(M::cia_improved, RoundingMethod::integral_approximation, true),
                                     sampler(M::cross_entropy_100us, "cross_entropy", 1e-4),
                                     sampler(M::cross_entropy_500us, "cross_entropy", 5e-4),
                                     sampler(M::cross_entropy_2ms, "cross_entropy", 2e-3),
                                     sampler(M::mppi_100us, "mppi", 1e-4),
                                     sampler(M::mppi_500us, "mppi", 5e-4),
                                     sampler(M::mppi_2ms, "mppi", 2e-3)};
  std::vector<Contender> bonmins_;  // none where it is left out
};

/// The exhaustive search must come to an end, and knows modes alone.
void check_size(const std::string& name, const AnyProblem& problem) {
  bool joint = false;
  for (std::size_t i = 0; i < problem.input_lower().size(); ++i)
    joint = joint || problem.input_lower()[i] < problem.input_upper()[i];
  const auto modes = problem.modes.size();
  const auto blocks = problem.horizon.blocks.size();
  if (joint || std::pow(modes, blocks) > most_sequences)
    throw ConfigError(
        fmt::format("ledger: variant '{}' has {} modes in {} blocks{} (allowed: at most {:.0f} sequences "
                    "and no joint plan, for the exhaustive search)",
                    name, modes, blocks, joint ? ", joint" : "", most_sequences));
}

/// A network that somebody asked for must be of use somewhere.
void require_fit(const char* option, const std::optional<std::string>& network, const char* solver,
                 const InstanceSet& set) {
  if (!network) return;
  std::string misfits;
  try {
    for (const VariantInstances& v : set.variants) {
      const ReadySolver taught = taught_solver(v.config, *system_of(v.config).problem(v.config), solver, *network);
      if (taught.solver) return;
      misfits += fmt::format("{}for '{}' it {}", misfits.empty() ? "" : "; ", v.name, taught.misfit);
    }
  } catch (const ConfigError& wrong) {
    throw ConfigError(fmt::format("{}: {}", option, wrong.what()));
  }
  throw ConfigError(fmt::format("{}: '{}' fits no variant: {} (allowed: one that was taught on a variant's problems)",
                                option, *network, misfits));
}

}  // namespace

const char* to_string(LedgerMethod method) {
  static constexpr const char* names[ledger_methods] = {"relaxed",
                                                        "held",
                                                        "sum_up",
                                                        "sum_up_improved",
                                                        "cia",
                                                        "cia_improved",
                                                        "cross_entropy_100us",
                                                        "cross_entropy_500us",
                                                        "cross_entropy_2ms",
                                                        "mppi_100us",
                                                        "mppi_500us",
                                                        "mppi_2ms",
                                                        "policy",
                                                        "learned_tail",
                                                        "taught_search",
                                                        "branch_and_bound",
                                                        "exhaustive",
                                                        "bonmin",
                                                        "bonmin_outer_approximation",
                                                        "bonmin_feasibility_pump"};
  return names[static_cast<std::size_t>(method)];
}

std::vector<LedgerOfVariant> keep_ledger(const InstanceSet& set, const LedgerOptions& options) {
  std::vector<LedgerOfVariant> ledger;
  require_fit("--policy", options.policy_network, "policy", set);
  require_fit("--cost", options.cost_network, "learned_tail", set);
  for (const VariantInstances& variant : set.variants) {
    if (options.stop && options.stop()) break;
    check_size(variant.name, *system_of(variant.config).problem(variant.config));
    ledger.push_back(Keeper(set, variant, options).run());
  }
  return ledger;
}

}  // namespace solenoid
