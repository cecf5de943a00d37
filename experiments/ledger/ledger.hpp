#pragma once

#include "controllers/instances/instance_set.hpp"
#include "experiments/base/gap.hpp"

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

struct Result;

/// What the ledger sets side by side, each on the same recorded problem.
enum class LedgerMethod : std::uint8_t {
  relaxed,          ///< the relaxed problem from the integer optimum: a local lower end, not a plan
  held,             ///< one mode over the whole horizon, the thesis's DMPC
  sum_up,           ///< relaxed from the warm start, rounded by summing up, re-simulated
  sum_up_improved,  ///< and improved
  cia,              ///< the same with the integral approximation
  cia_improved,
  cross_entropy_100us,  ///< sampled sequences, until so much time is over
  cross_entropy_500us,
  cross_entropy_2ms,
  mppi_100us,
  mppi_500us,
  mppi_2ms,
  policy,         ///< a network proposes; this and the next two where a network fits the variant
  learned_tail,   ///< two blocks searched, the rest as a network has it
  taught_search,  ///< branch and bound that has the policy's proposal for one more incumbent
  branch_and_bound,
  exhaustive,
  bonmin,  ///< on some of the states, where it is built in
  bonmin_outer_approximation,
  bonmin_feasibility_pump,
};
inline constexpr std::size_t ledger_methods = 20;
const char* to_string(LedgerMethod method);

struct LedgerEntry {
  Status status = Status::numerical_failure;
  bool tried = false;
  double cost = 0.0;
  double time_us = 0.0;
};

/// One recorded state: `bound` is what branch and bound has proven.
struct LedgerState {
  std::size_t record = 0;
  double bound = 0.0;
  std::array<LedgerEntry, ledger_methods> entries;
  const LedgerEntry& of(LedgerMethod method) const { return entries[static_cast<std::size_t>(method)]; }
  double gap(LedgerMethod method) const { return gap_above(of(method).cost, bound); }
};

/// A link of the chain relaxed <= branch and bound = exhaustive <= every plan that does not hold.
struct LedgerViolation {
  std::size_t record = 0;
  std::string what;
};

struct LedgerOfVariant {
  std::string name, blocks;
  std::vector<LedgerState> states;
  std::vector<LedgerViolation> violations;
  std::size_t relaxed_stationary = 0;  ///< relaxed solves that ended stationary to the tolerance
};

struct LedgerOptions {
  std::size_t states = 200;        ///< a variant, spread evenly over its records
  std::size_t bonmin_states = 20;  ///< of these
  double bonmin_limit_s = 5.0;     ///< on each
  /// Shipped networks, or files that were taken in: each must fit a variant. None: the shipped ones, where they fit.
  std::optional<std::string> policy_network, cost_network;
  std::function<void(const std::string&, std::size_t, std::size_t)> progress;  ///< variant, states done, of
  std::function<bool()> stop;
};

/// Runs every method on the same states of each variant. Throws ConfigError for a variant whose exhaustive search would
/// take more than a million sequences a state, and for a network that was asked for and fits no variant.
std::vector<LedgerOfVariant> keep_ledger(const InstanceSet& set, const LedgerOptions& options);

/// A table a variant with a row a method; JSON has every state's costs too, CSV a line a state and method.
Result result_of(const std::vector<LedgerOfVariant>& ledger);

}  // namespace solenoid
