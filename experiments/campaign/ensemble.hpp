#pragma once

#include "experiments/campaign/simulated_system.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <toml++/toml.h>

namespace solenoid {

/// A scenario's hidden mismatches, as a distribution: `ensemble = { members = 100, seed = 1, friction = [0.7, 2], ... }`.
/// One interval a quantity of the system (SimulatedSystem::quantities), each uniform in it, factors in their logarithm. A
/// Latin hypercube: each of `members` equal slices of every interval holds one member.
struct Ensemble {
  struct Interval {
    double low = 1.0, high = 1.0;
  };

  int members = 0;
  std::uint64_t seed = 1;
  std::vector<Interval> intervals;  ///< one a quantity
};

/// Throws ConfigError with file, line, key and what is allowed.
Ensemble read_ensemble(TableReader& table, std::span<const DrawnQuantity> quantities);

/// The scenario's tables, one a member: NAME-m001 and so on, each with what was drawn. The same on every machine.
std::vector<toml::table> ensemble_scenarios(const Ensemble& ensemble, std::span<const DrawnQuantity> quantities,
                                            const toml::table& scenario);

/// The keys of the scenario's own table that hold what is drawn: "mismatch".
std::vector<std::string> drawn_keys(std::span<const DrawnQuantity> quantities, bool with_optional);

/// The scenario a member was drawn for: its name without the member's number, or the name itself.
std::string ensemble_name(const std::string& scenario);

}  // namespace solenoid
