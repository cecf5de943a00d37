#pragma once

#include "controllers/estimators/estimator.hpp"
#include "controllers/solver_makers.hpp"
#include "controllers/variant.hpp"
#include "core/reference/motion.hpp"
#include "core/rt/controller.hpp"

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace solenoid {

/// What there is to choose from, a row each: solvers, feedback laws, estimators. Reading, refusals, `list`, the factory
/// and the documentation's tables come from these rows; whoever has to decide something asks a trait, not a name. A
/// system has the solvers of every system and rows of its own (system.hpp).

/// A solver of mode sequences.
struct SolverRow {
  std::string name, summary;
  bool real_time = true;             ///< may be run on hardware: no allocation in solve, the deadline kept
  std::string instead{};             ///< of one that is not: what to run
  bool chooses_continuous = false;   ///< plans continuous inputs too
  bool plans_whole_input = false;    ///< and these are the whole input, not a share on top of a law
  bool pulses = false;               ///< plans a mode a tick: blocks are model steps
  std::vector<std::string> groups;   ///< of keys that it reads (variant_keys.hpp)
  std::vector<std::string> modes{};  ///< mode sets that it works with; empty: all
  SolverMakers make;
  /// Throws by table.fail() what a combination of keys cannot be.
  void (*check)(TableReader& table, const VariantConfig& variant) = [](TableReader&, const VariantConfig&) {};
};

/// A law that chooses the switches from the present state alone.
struct LawRow {
  std::string name, summary;
  std::vector<std::string> groups, modes;
  std::function<std::unique_ptr<Controller>(const VariantConfig& variant, const Motion& reference)> make;
  void (*check)(TableReader& table, const VariantConfig& variant) = [](TableReader&, const VariantConfig&) {};
};

/// An estimator, as variants name it.
struct EstimatorName {
  std::string name, summary;
  std::function<Estimator(const VariantConfig& variant)> make{};  ///< none: the system's own doing
};

/// A mode set that is not the system's own.
struct ModeSetRow {
  std::string name;
  std::function<ModeSet(const VariantConfig& variant)> make;
};

/// A number that a variant says to a solver, law or estimator which is not the system's own: VariantConfig::added.
struct AddedKey {
  std::string path;  ///< "mine.gain"
  double usual = 0.0;
  Range range;
  std::string unit{}, meaning{};
};

/// For rows whose solver cuts pulses in intervals as long as the longest delay, which are tried one by one.
void check_pulses(TableReader& table, const VariantConfig& variant);

/// The row of this name, or null.
template <class Row>
const Row* find_row(const std::vector<Row>& rows, std::string_view name) {
  for (const Row& row : rows)
    if (row.name == name) return &row;
  return nullptr;
}
/// The names in the order of the rows.
template <class Row>
std::vector<std::string> names_of(const std::vector<Row>& rows) {
  std::vector<std::string> names;
  for (const Row& row : rows) names.push_back(row.name);
  return names;
}

/// The row of a variant's solver; throws std::invalid_argument, naming what is allowed.
const SolverRow& solver_row(const VariantConfig& variant);

/// Throws ConfigError, naming what to run instead, for a variant whose solver is not real time.
void require_real_time(const VariantConfig& variant);

}  // namespace solenoid
