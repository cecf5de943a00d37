#pragma once

#include "core/metrics/metrics.hpp"
#include "core/mpc/plan.hpp"
#include "experiments/profile/random_problems.hpp"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

struct Result;

/// What a certificate is asked for.
struct CertifyTask {
  std::string variant;        ///< a shipped one, or of `campaign`
  std::string campaign{};     ///< whose motions are drawn from; empty: the system's tasks in real time
  std::size_t states = 5000;  ///< random problems to solve
  std::uint64_t seed = 1;     ///< of them
  int jobs = 1;               ///< worker processes; what they count is the same, they disturb each other's times
  int core = -1;              ///< of one worker; -1: the last one allowed
  std::optional<double> deadline_ms{};  ///< in place of the variant's; where it has none: its period
  std::function<bool()> interrupted = [] { return false; };
  std::function<void(std::size_t done)> progress = [](std::size_t) {};
};

/// One solve of a random problem.
struct MeasuredSolve {
  SolveWork work;
  double us = 0.0;
};

/// What work costs here: us(w) = fixed + node w.nodes + model_step w.model_steps + bound_step w.bound_steps, as it is
/// where nothing is left out. Solves cost up to `factor` of it.
struct WorkCosts {
  double fixed_us = 0, node_us = 0, model_step_us = 0, bound_step_us = 0;
  double factor = 1.0;    ///< the largest of any solve that was measured
  double whole_us = 0.0;  ///< the longest solve in which nothing was left out...
  bool whole = false;     ///< ... to its end

  double us(const SolveWork& work) const {
    return fixed_us + node_us * static_cast<double>(work.nodes) +
           model_step_us * static_cast<double>(work.model_steps) +
           bound_step_us * static_cast<double>(work.bound_steps);
  }
  /// That no measured solve of so much work exceeded.
  double most_us(const SolveWork& work) const { return factor * us(work); }
};

/// What was found of solves that a deadline cut short, at a random moment of theirs.
struct DeadlineChecks {
  std::size_t solves = 0, cut = 0;
  std::size_t worse_than_hold = 0;  ///< plans that cost more than holding the command in force
  std::size_t wrong_bounds = 0;     ///< report.bound above, or report.cost below the optimum
  double latest_us = 0.0;           ///< after the deadline; the least of several where it would be the latest
};

/// How much work, and how long, a solve of a variant can take at most.
struct Certificate {
  VariantConfig variant;
  std::vector<StateRange> ranges;
  std::size_t asked = 0;
  std::uint64_t seed = 1;
  int jobs = 1, core = -1;
  double period_ms = 0, deadline_ms = 0;
  MostWork most;                      ///< counted: of every problem
  WorkCosts costs;                    ///< measured: of this machine
  std::vector<MeasuredSolve> solves;  ///< of problem 0, 1, ...
  DeadlineChecks deadline;

  /// Solves with more work than there can be.
  std::size_t exceeded() const;
  /// A bound that does not hold: of the work, or of a plan that a deadline cut short.
  bool broken() const { return exceeded() + deadline.worse_than_hold + deadline.wrong_bounds > 0; }
  bool complete() const { return solves.size() == asked; }
  /// The longest solve of any problem [ms].
  double bound_ms() const { return 1e-3 * costs.most_us(most.solve); }
  bool fits() const { return bound_ms() <= period_ms; }
};

/// Counts the most work of a variant's solver, measures what work costs, and solves random problems. A solve's time is
/// one pass's; where it would be the longest, or the dearest for its work, the least of several. Interrupted, it has the
/// solves of before. Throws ConfigError for a variant whose solver knows no bound, naming those that do.
Certificate certify(const CertifyTask& task);

/// The certificate as it is printed.
Result result_of(const Certificate& certificate);

}  // namespace solenoid
