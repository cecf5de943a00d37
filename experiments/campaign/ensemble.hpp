#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <toml++/toml.h>

namespace solenoid {

class TableReader;

/// A scenario's hidden mismatches, as a distribution: `ensemble = { members = 100, seed = 1, payload_kg = [0, 0.15],
/// friction = [0.7, 2], ... }`. One interval a quantity; the payload is uniform in it, factors are uniform in their
/// logarithm. A Latin hypercube: each of `members` equal slices of every interval holds one member.
struct Ensemble {
  struct Interval {
    double low = 1.0, high = 1.0;
  };
  /// Quantities by the scenario's names for them.
  static constexpr std::array<const char*, 7> names = {"payload_kg", "friction", "flow",        "supply",
                                                       "delay",      "inertia",  "noise_factor"};

  int members = 0;
  std::uint64_t seed = 1;
  std::array<Interval, names.size()> intervals;
};

/// Throws ConfigError with file, line, key and what is allowed.
Ensemble read_ensemble(TableReader& table);

/// The scenario's tables, one a member: NAME-m001 and so on, each with its payload, mismatch and noise. The same on
/// every machine.
std::vector<toml::table> ensemble_scenarios(const Ensemble& ensemble, const toml::table& scenario);

/// The scenario a member was drawn for: its name without the member's number, or the name itself.
std::string ensemble_name(const std::string& scenario);

}  // namespace solenoid
