#pragma once

#include <cstdint>
#include <string_view>

namespace solenoid::qp {

/// How a solve ended, and what the solution then holds.
enum class Status : std::uint8_t {
  optimal,            ///< every KKT residual within the tolerance; primal and dual may be used
  iteration_limit,    ///< the last iterate, inside its bounds as far as the step rule kept it; apply with care
  deadline_reached,   ///< the same, stopped by the clock
  primal_infeasible,  ///< no point satisfies the constraints; the duals hold a Farkas certificate, the primal is void
  dual_infeasible,    ///< unbounded below where feasible; the primal holds a direction of descent without end
  numerical_failure,  ///< a factorisation or a step was not finite, or no progress was possible; nothing may be used
  invalid_problem,    ///< data not finite, or of another shape than setup saw; nothing was computed
};

/// The status as tests and benchmarks print it.
constexpr std::string_view to_string(Status status) {
  switch (status) {
    case Status::optimal:
      return "optimal";
    case Status::iteration_limit:
      return "iteration_limit";
    case Status::deadline_reached:
      return "deadline_reached";
    case Status::primal_infeasible:
      return "primal_infeasible";
    case Status::dual_infeasible:
      return "dual_infeasible";
    case Status::numerical_failure:
      return "numerical_failure";
    case Status::invalid_problem:
      return "invalid_problem";
  }
  return "unknown";
}

/// Which instruction set the kernels use. `best` asks the processor; a wish it cannot fulfil falls back to baseline.
enum class Isa : std::uint8_t { best, baseline, avx2, avx512 };

/// Whether `solution` comes in as a guess (its active bounds count most) or is only written.
enum class Start : std::uint8_t { cold, warm };

/// All tolerances are absolute, in the units of the problem; scaling inside the solver does not change their meaning.
struct Settings {
  int max_iterations = 100;     ///< factorisations, interior-point and active-set steps alike
  double tolerance = 5e-9;      ///< stationarity, feasibility, complementarity: largest entry
  double gap_relative = 1e-7;   ///< sum of complementarity products against |objective| ...
  double gap_absolute = 1e-12;  ///< ... plus this
  double certificate = 1e-7;    ///< accepted error of an infeasibility certificate of largest entry 1
  double primal_shift = 1e-10;  ///< proximal weight on x: makes P + shift positive definite  [theory-qp.md, eq. 6]
  double dual_shift = 1e-10;    ///< proximal weight on the multipliers (sparse back end)     [theory-qp.md, eq. 6]
  int refinement_steps = 3;     ///< at most, per linear solve, and only where a residual asks for it
  int active_set_steps = 5;     ///< at most, per attempt to finish on a guessed active set; 0: interior point only
  Isa isa = Isa::best;
};

/// What a solve reports beside its status.
struct Info {
  Status status = Status::numerical_failure;
  int iterations = 0;        ///< KKT factorisations
  int active_set_steps = 0;  ///< of these, steps on a guessed active set
  double objective = 0.0;
  double stationarity = 0.0;     ///< largest entry, as the solver saw it
  double feasibility = 0.0;      ///< largest entry
  double complementarity = 0.0;  ///< largest product of slack and multiplier
};

}  // namespace solenoid::qp
