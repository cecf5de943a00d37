#pragma once

#include "experiments/campaign/stored_runs.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace solenoid {

/// How long solves took in many runs, and how many of them were late.
struct SolveSums {
  SolveHistogram times;
  std::int64_t late = 0;

  void add(const SolveSums& other);
};

/// How the errors of some runs are distributed: exactly, whatever their number.
struct ErrorDistribution {
  std::size_t ok = 0, runs = 0;  ///< those that ended well, whose errors these are; all
  std::vector<double> errors;    ///< increasing: all, or K quantiles: of k/(K-1) of them the largest, k = 0 .. K-1
};
/// `values`, increasing, or of more than `most`, which is above 1, that many: by nearest rank, the first the least.
std::vector<double> quantiles(std::vector<double> values, std::size_t most);

/// What of a campaign's runs is ranked, as columns: below a hundred bytes a run, so that a million of them fit; and what
/// adds up. Runs of one system, in the order in which they are added.
class RunTable {
 public:
  explicit RunTable(const SystemDescription& system);

  /// Throws std::invalid_argument for a run of another system. `solves`: its own times, as far as they are known.
  void add(const RunRecord& run, const SolveHistogram& solves = {});
  /// Room for so many, so that none is taken twice.
  void reserve(std::size_t runs);

  const SystemDescription& system() const { return *system_; }
  std::size_t size() const { return variant_.size(); }
  bool ok(std::size_t row) const { return ending_[row] == Ending::ok; }
  bool failed(std::size_t row) const { return ending_[row] == Ending::failed; }
  /// Between which rows those of a group are, without the end; in a campaign's order there are no others between them.
  std::pair<std::size_t, std::size_t> rows(std::optional<std::uint32_t> group) const;
  struct Counts {
    std::size_t ok = 0, unstable = 0, failed = 0;
  };
  Counts counts() const;
  /// Numbers of its variant, its scenario and its group, in the order in which they came up.
  std::uint32_t variant(std::size_t row) const { return variant_[row]; }
  std::uint32_t scenario(std::size_t row) const { return scenario_[row]; }
  std::uint32_t group(std::size_t row) const { return scenario_groups_[scenario_[row]]; }
  std::uint64_t seed(std::size_t row) const { return seed_[row]; }
  /// Of a scenario's name alone, so that sorted by it scenarios have the same order however runs came.
  std::size_t scenario_key(std::uint32_t scenario) const { return scenario_keys_[scenario]; }
  /// Of a run that is ok: its error, at least 1e-12, its efforts in the description's order, times of its solves.
  double error(std::size_t row) const { return error_[row]; }
  double effort(std::size_t row, std::size_t which) const { return efforts_[row * effort_keys_.size() + which]; }
  double solve_p50_us(std::size_t row) const { return solve_p50_us_[row]; }
  double solve_p99_us(std::size_t row) const { return solve_p99_us_[row]; }

  const std::vector<std::string>& variants() const { return variants_; }
  /// Of a scenario's group: the ensemble that it is a member of, or itself.
  const std::vector<std::string>& groups() const { return groups_; }
  /// Of all runs of a variant, or of those in one group.
  SolveSums solves(std::uint32_t variant, std::optional<std::uint32_t> group = {}) const;
  /// Of the same runs, by at most so many numbers.
  ErrorDistribution distribution(std::uint32_t variant, std::optional<std::uint32_t> group, std::size_t most) const;
  std::size_t scenarios() const { return scenario_groups_.size(); }
  std::size_t efforts() const { return effort_keys_.size(); }
  /// Whether a group is an ensemble.
  bool is_ensemble(std::uint32_t group) const { return ensemble_[group]; }

 private:
  enum class Ending : std::uint8_t { ok, unstable, failed };
  std::uint32_t variant_number(const std::string& name);
  std::uint32_t scenario_number(const std::string& name);
  std::uint32_t group_number(const std::string& name, bool ensemble);

  const SystemDescription* system_;
  std::string error_key_;
  std::vector<std::string> effort_keys_;
  std::vector<std::string> variants_, groups_;
  std::vector<std::pair<std::size_t, std::size_t>> group_rows_;
  std::vector<bool> ensemble_;                                       // of groups
  std::vector<std::uint32_t> scenario_groups_;                       // of scenarios
  std::vector<std::size_t> scenario_keys_;                           // of scenarios
  std::unordered_map<std::size_t, std::uint32_t> scenario_numbers_;  // by the hash of their names, which are not kept
  std::unordered_map<std::string, std::uint32_t> group_numbers_;
  std::string last_scenario_;
  std::uint32_t last_number_ = 0;
  std::vector<std::uint32_t> variant_, scenario_;
  std::vector<std::uint64_t> seed_;
  std::vector<Ending> ending_;
  std::vector<double> error_, efforts_, solve_p50_us_, solve_p99_us_;
  std::vector<std::vector<SolveSums>> solves_;  // of a group, of a variant; as far as there are any
};

/// All runs that a folder keeps; what cannot be read any more comes back in `unread`.
RunTable table_of(const StoredRuns& runs, const SystemDescription& system, std::vector<UnreadRun>* unread = nullptr);

/// The records of each system in a table of its own, systems in the order in which they come; at least one, empty.
std::vector<RunTable> tables_of(std::span<const RunRecord> records);

}  // namespace solenoid
