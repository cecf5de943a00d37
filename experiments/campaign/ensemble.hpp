#pragma once

#include "core/config/document.hpp"
#include "experiments/campaign/sampling.hpp"
#include "experiments/campaign/simulated_system.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <toml++/toml.h>

namespace solenoid {

/// A scenario's hidden mismatches, as a distribution:
/// `ensemble = { members = 100, seed = 1, sampling = "sobol", friction = [0.7, 2], ... }`. One interval a quantity of the
/// system (SimulatedSystem::quantities), each uniform in it, factors in their logarithm. A quantity's coordinate is its
/// place among all of them: naming another changes none that is named.
struct Ensemble {
  struct Interval {
    double low = 1.0, high = 1.0;
  };

  int members = 0;
  std::uint64_t seed = 1;
  Sampling sampling = Sampling::shuffled;
  std::vector<Interval> intervals;  ///< one a quantity
};

/// Throws ConfigError with file, line, key and what is allowed.
Ensemble read_ensemble(TableReader& table, std::span<const DrawnQuantity> quantities);

/// What an ensemble makes of its scenario: NAME-m001 and so on, each with what was drawn. A member takes no other and is
/// the same on every machine.
class EnsembleMembers {
 public:
  /// `scenario` is the table that has `ensemble`, with the files it names; `where` is where that is, for errors of what
  /// it draws.
  EnsembleMembers(const Ensemble& ensemble, std::span<const DrawnQuantity> quantities, const Document& scenario,
                  const std::string& where);

  const std::string& scenario() const { return scenario_; }
  std::span<const DrawnQuantity> quantities() const { return quantities_; }
  std::size_t size() const { return sampler_.points(); }
  /// Members are counted from 0, their names from 1.
  std::string name(std::size_t member) const;
  /// The member's own table.
  Document document(std::size_t member) const { return document(name(member), sampler_.at(member)); }
  /// All quantities at the low ends of their intervals, or all at the high ones, called as the first member.
  Document corner(bool high) const;
  /// The scenario of its table. Throws ConfigError for what the interval should not have.
  ScenarioConfig read(std::size_t member) const;
  /// ScenarioText::drawn of the table, in a hundredth of the time.
  std::string drawn_text(std::size_t member) const;

 private:
  Document document(const std::string& name, const std::vector<double>& shares) const;
  double value(std::size_t quantity, double share) const;
  bool drawn(std::size_t quantity) const;

  std::vector<DrawnQuantity> quantities_;
  std::vector<Ensemble::Interval> intervals_;
  Sampler sampler_;
  std::string scenario_;
  Document table_;  // without what is drawn
};

/// A scenario's table as a text in two parts, so that of an ensemble the first is the same for all members.
struct ScenarioText {
  std::string rest, drawn;  ///< what an ensemble draws, and the name
};
ScenarioText scenario_text(const toml::table& scenario, std::span<const DrawnQuantity> quantities);

/// The keys of the scenario's own table that hold what is drawn: "mismatch".
std::vector<std::string> drawn_keys(std::span<const DrawnQuantity> quantities, bool with_optional);

/// A member by its name: NAME-m001 is the first. Three digits, or as many more as it takes.
struct MemberName {
  std::string scenario;
  std::size_t number;
};
std::string member_name(const std::string& scenario, std::size_t number);
/// Nothing if it is no member's.
std::optional<MemberName> member_named(const std::string& name);
/// The scenario a member was drawn for: its name without the member's number, or the name itself.
std::string ensemble_name(const std::string& scenario);

}  // namespace solenoid
