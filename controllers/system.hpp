#pragma once

#include "controllers/catalogue.hpp"
#include "controllers/compiled_solvers.hpp"
#include "controllers/estimators/estimator.hpp"
#include "controllers/ladder/fallback_ladder.hpp"
#include "controllers/switch_health.hpp"
#include "controllers/variant_keys.hpp"
#include "core/safety/limits.hpp"
#include "core/system/description.hpp"

#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace solenoid {

/// Where a state can be.
struct StateRange {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
};

/// A plant with switched inputs, as whoever makes controllers for it asks: its description, what a variant of it may
/// say, and what that becomes. A system derives from this and is registered (registered_systems.hpp); how it is
/// simulated is SimulatedSystem's part (experiments/campaign/simulated_system.hpp).
///
/// const throughout: one object serves all variants.
class System {
 public:
  /// What there is to choose from.
  struct Choices {
    std::vector<std::string> mode_sets;
    std::vector<EstimatorName> estimators;
    std::vector<SolverRow> solvers{};  ///< those of every system (common_solvers()) and its own
    std::vector<LawRow> laws{};
    std::vector<std::string> parameter_sets{};  ///< names that the key `model` takes, beside a table or file
  };
  virtual ~System() = default;
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  const SystemDescription& description() const { return description_; }
  /// Of the plant as a variant has it: description(), or one more with continuous inputs behind those that every variant
  /// has. Logs, packets and traces of a run are made from it.
  virtual const SystemDescription& description_for(const VariantConfig& /*variant*/) const { return description_; }
  /// Every description that description_for() may return; the last has the inputs of all.
  virtual std::vector<const SystemDescription*> descriptions() const { return {&description_}; }
  const std::string& name() const { return description_.name; }
  const std::vector<std::string>& mode_sets() const { return choices_.mode_sets; }
  const std::vector<EstimatorName>& estimators() const { return choices_.estimators; }
  const std::vector<SolverRow>& solvers() const { return choices_.solvers; }
  const std::vector<LawRow>& laws() const { return choices_.laws; }
  const std::vector<std::string>& parameter_sets() const { return choices_.parameter_sets; }
  /// Every key of a variant, in the order of the documentation: those of every system, then its own.
  const std::vector<VariantKey>& keys() const { return keys_; }

  /// What is not its own: rows, and the keys that they read. Throws ConfigError where there is one of its name.
  void add(SolverRow row, const std::vector<AddedKey>& keys = {});
  /// The same of a law.
  void add(LawRow row, const std::vector<AddedKey>& keys = {});
  /// Of an estimator.
  void add(EstimatorName row, const std::vector<AddedKey>& keys = {});
  /// Of a mode set.
  void add(ModeSetRow row);
  const std::vector<AddedKey>& added_keys() const { return added_keys_; }

  /// A variant that says nothing but its name.
  virtual VariantConfig defaults() const = 0;
  /// Reads by hand what is no declared key: the model. Throws ConfigError with file, line, key and what is allowed.
  virtual void read(TableReader& table, VariantConfig& variant) const = 0;
  /// Throws by table.fail() what its keys cannot be together.
  virtual void check(TableReader& /*table*/, const VariantConfig& /*variant*/) const {}
  /// Takes over what a task tells its controllers: a text of the system's own (the plane of the arm), mostly none.
  virtual void tell(VariantConfig& /*variant*/, const std::string& /*setting*/) const {}
  /// Takes over a sampling that has changed.
  virtual void resample(VariantConfig& /*variant*/) const {}

  /// The variant's mode set.
  ModeSet modes(const VariantConfig& variant) const;
  /// The most that each continuous input may be.
  virtual std::vector<double> continuous_limits(const VariantConfig& /*variant*/) const { return {}; }
  /// The set of states that a variant's controller is for, a range of each: what its certificate covers. A state of which
  /// the system does not say it has an infinite one.
  virtual std::vector<StateRange> state_ranges(const VariantConfig& /*variant*/) const {
    return std::vector<StateRange>(description_.states.size());
  }
  /// The problem that a variant poses in each period, without state and reference.
  virtual std::unique_ptr<AnyProblem> problem(const VariantConfig& variant) const = 0;
  /// Of the model that the variant believes.
  virtual const ModelTools& tools(const VariantConfig& variant) const = 0;
  /// The variant's estimator through its channels.
  Estimator estimator(const VariantConfig& variant) const;
  /// A controller with a solver around it, which `decorate` has had. Throws what is impossible.
  virtual std::unique_ptr<Controller> mpc(const VariantConfig& variant, const Motion& reference,
                                          const SolverDecorator& decorate) const = 0;

  /// What watches the variant's switches; nothing if it is not asked for, or the system has nothing that could.
  virtual std::unique_ptr<SwitchHealth> health(const VariantConfig& /*variant*/) const { return nullptr; }
  /// What is left of the mode set for each fault that health() can find.
  virtual std::vector<SpareModes> spare_modes(const VariantConfig& /*variant*/) const { return {}; }

  /// What stands in for plans on the rig.
  virtual std::unique_ptr<Guard> guard(const VariantConfig& variant) const = 0;
  /// Limits of the ladder for the system's usual sensors on what a variant, told of its task, believes of the plant:
  /// bounds of each channel and, if there are any, limits of each.
  virtual LadderSettings ladder(const VariantConfig& variant) const = 0;

 protected:
  /// The description must outlive it and be complete (require_complete), or std::logic_error is thrown.
  System(const SystemDescription& description, Choices choices);
  /// Appends its own keys; called at the end of a derived constructor.
  void add_keys(const std::vector<VariantKey>& own);
  /// Of its own mode sets that of the variant.
  virtual ModeSet own_modes(const VariantConfig& variant) const = 0;
  /// Of its own estimators that of the variant.
  virtual Estimator own_estimator(const VariantConfig& variant) const = 0;

 private:
  /// Refuses a name that is taken in `kind`.
  void require_new(const std::vector<std::string>& names, const std::string& name, const char* kind) const;
  /// Takes up a row that decides what is commanded, a solver or a law: no two of them have one name.
  template <class Row>
  void add_decider(std::vector<Row>& rows, Row row, const std::vector<AddedKey>& keys);
  /// Takes keys up in a group, and makes the list again.
  void add_keys_of(const std::string& group, const std::vector<AddedKey>& keys);
  void list_keys();

  const SystemDescription& description_;
  Choices choices_;
  std::vector<ModeSetRow> added_modes_;
  std::vector<AddedKey> added_keys_;
  std::vector<VariantKey> own_keys_, keys_;
};

/// The horizon of a variant in blocks of model steps.
Horizon make_horizon(const VariantConfig& variant);

/// A variant's bounds of states as a model's problem has them; its continuous inputs are not bounded.
template <HybridModel Model>
Bounds<Model> make_bounds(const LimitSettings& limits) {
  Bounds<Model> bounds;
  for (std::size_t i = 0; i < Model::state_size; ++i) {
    bounds.state_lower[i] = limits.least[i].value_or(bounds.state_lower[i]);
    bounds.state_upper[i] = limits.most[i].value_or(bounds.state_upper[i]);
    bounds.state_penalty[i] = limits.penalty[i];
  }
  return bounds;
}

/// A variant's weights as a model's cost has them.
template <HybridModel Model>
Cost<Model> make_cost(const CostSettings& weights) {
  Cost<Model> cost;
  cost.tracking = first<Model::output_size>(weights.tracking);
  cost.terminal = first<Model::output_size>(weights.terminal);
  cost.switching = weights.switching;
  cost.consumption = weights.consumption;
  cost.continuous = first<Model::continuous_size>(weights.continuous);
  return cost;
}

}  // namespace solenoid
