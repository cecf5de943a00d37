#pragma once

#include "core/mpc/broken_limit.hpp"
#include "core/mpc/problem.hpp"

#include <cstdint>
#include <limits>
#include <string_view>

namespace solenoid {

/// How a solve ended, and whether its plan may be applied.
enum class Status : std::uint8_t {
  optimal,            ///< proven to the solver's tolerance; apply
  feasible,           ///< a local or rounded solution without a certificate; apply
  deadline_reached,   ///< stopped by the deadline with its best plan; apply, the bound says what may be missing
  iteration_limit,    ///< stopped by its iteration limit with its best plan; apply with care
  infeasible,         ///< no sequence found keeps to the limits; the plan holds the current mode: fall back
  numerical_failure,  ///< a non-finite number or a failed factorisation; the plan is not to be applied: fall back
};

/// Whether the plan of a solve that ended so may be applied.
constexpr bool usable(Status status) { return status != Status::infeasible && status != Status::numerical_failure; }

/// The status as JSON, CSV and logs spell it.
constexpr std::string_view to_string(Status status) {
  switch (status) {
    case Status::optimal:
      return "optimal";
    case Status::feasible:
      return "feasible";
    case Status::deadline_reached:
      return "deadline_reached";
    case Status::iteration_limit:
      return "iteration_limit";
    case Status::infeasible:
      return "infeasible";
    case Status::numerical_failure:
      return "numerical_failure";
  }
  return "unknown";
}

/// The plan as it looks `steps` later: each block takes what the old plan holds where the block begins.
void shift_plan(const Horizon& horizon, int steps, AnyPlan& plan) noexcept;

/// The work of a solve, counted and not timed: the same on every machine with registers of one width.
struct SolveWork {
  std::int64_t nodes = 0;        ///< blocks rolled out, or iterations
  std::int64_t model_steps = 0;  ///< steps of the model's prediction, those of a register's unused lanes included
  std::int64_t bound_steps = 0;  ///< the same of the sets of states that lower bounds are found by
  bool operator==(const SolveWork&) const = default;
  /// Whether there is no more of anything than in `most`.
  constexpr bool within(const SolveWork& most) const {
    return nodes <= most.nodes && model_steps <= most.model_steps && bound_steps <= most.bound_steps;
  }
};

/// The most work that a solve can take, whatever is asked (AnySolver::most_work).
struct MostWork {
  SolveWork solve;  ///< of a solve to its end
  SolveWork late;   ///< after its deadline: between two looks at the clock, and to conclude
};

/// How it went. bound <= optimum <= cost at every status for which the plan is usable.
struct SolveReport {
  Status status = Status::numerical_failure;
  double cost = std::numeric_limits<double>::infinity();
  double bound = -std::numeric_limits<double>::infinity();
  int switches = 0;        ///< switch changes of the plan, the first against the command in force
  std::int64_t nodes = 0;  ///< blocks rolled out, or iterations
  double time_us = 0.0;
  bool anticipated = false;  ///< whether the solve began from what anticipate() had prepared
  /// Steps asked for, as of SolveWork, by a solver that knows the most of them (AnySolver::most_work): one that stops a
  /// rollout early has asked for all of it.
  std::int64_t model_steps = 0, bound_steps = 0;
  BrokenLimit broken{};  ///< of an infeasible problem: why holding the current mode is no plan

  /// What was done, as it compares with MostWork.
  SolveWork work() const { return {nodes, model_steps, bound_steps}; }

  /// (cost - bound) / cost, 0 when proven.
  double gap() const { return cost > bound ? (cost - bound) / cost : 0.0; }
};
/// What programs written for version 0.1 call a SolveReport.
using Report = SolveReport;

}  // namespace solenoid
