#pragma once

#include "controllers/any_solver.hpp"
#include "controllers/estimators/estimator.hpp"
#include "controllers/variant.hpp"
#include "core/rt/controller.hpp"

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace solenoid {

/// What there is to choose from, a row each: solvers, feedback laws, estimators. Reading, refusals, `list`, the factory
/// and the documentation's tables come from these rows; whoever has to decide something asks a trait, not a name.

/// Makes one thing for either model: from a generic lambda `[]<HybridModel M>(const VariantConfig&)`.
template <template <class> class Made>
struct ForEitherModel {
  template <class Make>
  ForEitherModel(Make)  // NOLINT: stands for one
      : pneumatic(+[](const VariantConfig& v) { return Make().template operator()<PneumaticActuator>(v); }),
        prestabilised(+[](const VariantConfig& v) { return Make().template operator()<PrestabilisedActuator>(v); }) {}

  template <HybridModel M>
  Made<M> of(const VariantConfig& v) const {
    if constexpr (std::is_same_v<M, PrestabilisedActuator>)
      return prestabilised(v);
    else
      return pneumatic(v);
  }

  Made<PneumaticActuator> (*pneumatic)(const VariantConfig&);
  Made<PrestabilisedActuator> (*prestabilised)(const VariantConfig&);
};

/// A row makes its solver as this.
template <HybridModel M>
using SolverPtr = std::unique_ptr<Solver<M>>;

/// A solver of mode sequences.
struct SolverRow {
  std::string name, summary;
  bool real_time = true;              ///< may be run on hardware: no allocation in solve, the deadline kept
  std::string instead{};              ///< of one that is not: what to run
  bool chooses_continuous = false;    ///< `motor = "joint"` is possible
  bool plans_whole_force = false;     ///< a joint plan's force is the motor's, not a share on top of the PD law
  bool pulses = false;                ///< plans a mode a tick: blocks are model steps
  std::vector<std::string> groups;    ///< of keys that it reads (variant_keys.hpp)
  std::vector<std::string> valves{};  ///< that it works with; empty: all
  ForEitherModel<SolverPtr> make;
  /// Throws by table.fail() what a combination of keys cannot be.
  void (*check)(TableReader& table, const VariantConfig& variant) = [](TableReader&, const VariantConfig&) {};
};

/// A law that chooses the valves from the present state alone.
struct LawRow {
  std::string name, summary;
  std::vector<std::string> groups, valves;
  std::unique_ptr<Controller> (*make)(const VariantConfig& variant, const Motion& reference, Plane plane);
  void (*check)(TableReader& table, const VariantConfig& variant) = [](TableReader&, const VariantConfig&) {};
};

/// An estimator through the sensing chain.
struct EstimatorRow {
  std::string name, summary;
  bool finds_load = false;  ///< payload and disturbance, for `use_estimate`
  EstimatorTuning tuning;   ///< what a variant has that does not say
  Estimator (*make)(const PneumaticActuator& model, const EstimatorTuning& tuning);
};

/// The solvers there are, as `list` shows them.
const std::vector<SolverRow>& solver_rows();
/// The laws there are.
const std::vector<LawRow>& law_rows();
/// The estimators there are.
const std::vector<EstimatorRow>& estimator_rows();

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

/// The row of this name; throws std::invalid_argument, naming what is allowed.
const SolverRow& solver_row(std::string_view name);
/// The same of an estimator.
const EstimatorRow& estimator_row(std::string_view name);

/// Throws ConfigError, naming what to run instead, for a variant whose solver is not real time.
void require_real_time(const VariantConfig& variant);

/// The estimator of this name over a nominal model. May allocate; throws std::invalid_argument.
Estimator make_estimator(std::string_view name, const PneumaticActuator& model, const EstimatorTuning& tuning);

}  // namespace solenoid
