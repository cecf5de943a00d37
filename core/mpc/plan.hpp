#pragma once

#include "core/mpc/problem.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

namespace solenoid {

/// How a solve ended, and whether its plan may be applied.
enum class Status : std::uint8_t {
  optimal,            ///< proven to the solver's tolerance; apply
  feasible,           ///< a local or rounded solution without a certificate; apply
  deadline_reached,   ///< stopped by the deadline with its best plan; apply, the bound says what may be missing
  iteration_limit,    ///< stopped by its iteration limit with its best plan; apply with care
  infeasible,         ///< no sequence satisfies bounds and dwell; the plan holds the current mode: fall back
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

/// What a rounded plan keeps of the relaxed one that it comes from: there the next solve starts.
/// shapes   weights: blocks x modes, block-major, convex combinations    owed: blocks
struct Relaxation {
  bool known = false;  ///< whether the rest says anything; solvers that relax nothing leave it false
  std::vector<double> weights;
  /// By how many steps each switch has been on for less than the relaxation wanted, as the block begins.
  std::vector<SwitchStates<double>> owed;
};

/// What to do. Solvers read it as their warm start and leave their best plan in it.
/// shapes   modes, continuous: blocks    outputs: empty, or steps (evaluate() fills it; outputs[j] after step j + 1)
template <HybridModel M>
struct Plan {
  std::vector<int> modes;
  std::vector<ContinuousOf<M>> continuous;
  std::vector<OutputOf<M>> outputs;
  Relaxation relaxation;

  Plan() = default;
  /// Sized for a problem: mode 0 and no continuous input in every block.
  explicit Plan(const Problem<M>& problem) : modes(problem.horizon.blocks.size()), continuous(modes.size()) {
    relaxation.weights.resize(modes.size() * static_cast<std::size_t>(problem.modes.size()));
    relaxation.owed.resize(modes.size());
  }
};

/// The plan as it looks `steps` later: each block takes what the old plan holds where the block begins.
template <HybridModel M>
void shift_plan(const Horizon& horizon, int steps, Plan<M>& plan) noexcept {
  const std::size_t blocks = plan.modes.size();
  const std::size_t row = blocks == 0 ? 0 : plan.relaxation.weights.size() / blocks;
  std::size_t from = 0;
  int begin = steps, from_end = horizon.blocks.empty() ? 0 : horizon.blocks[0];
  for (std::size_t b = 0; b < blocks; ++b) {
    while (begin >= from_end && from + 1 < blocks) from_end += horizon.blocks[++from];
    plan.modes[b] = plan.modes[from];
    plan.continuous[b] = plan.continuous[from];
    if (plan.relaxation.known) {
      std::copy_n(plan.relaxation.weights.begin() + static_cast<std::ptrdiff_t>(from * row), row,
                  plan.relaxation.weights.begin() + static_cast<std::ptrdiff_t>(b * row));
      plan.relaxation.owed[b] = plan.relaxation.owed[from];
    }
    begin += horizon.blocks[b];
  }
}

/// How it went. bound <= optimum <= cost at every status for which the plan is usable.
struct SolveReport {
  Status status = Status::numerical_failure;
  double cost = std::numeric_limits<double>::infinity();
  double bound = -std::numeric_limits<double>::infinity();
  int switches = 0;        ///< switch changes of the plan, the first against the command in force
  std::int64_t nodes = 0;  ///< blocks rolled out, or iterations
  double time_us = 0.0;
  bool anticipated = false;  ///< whether the solve began from what anticipate() had prepared

  /// (cost - bound) / cost, 0 when proven.
  double gap() const { return cost > bound ? (cost - bound) / cost : 0.0; }
};
/// What programs written for version 0.1 call a SolveReport.
using Report = SolveReport;

}  // namespace solenoid
