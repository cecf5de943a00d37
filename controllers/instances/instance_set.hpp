#pragma once

#include "controllers/factory.hpp"
#include "controllers/variant.hpp"

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace solenoid {

/// A model takes over what an estimator found beyond the state, a load, as so many numbers.
template <class M>
concept HasLoad = requires(M& model, const M& same, const Vector<double, M::load_size>& load) {
  model.set_load(load);
  { same.load() } -> std::same_as<Vector<double, M::load_size>>;
};

/// Where instances were recorded: a motion at whole model steps, as the desired outputs of the system's models.
struct RecordedMotion {
  std::string name;
  std::string setting;       ///< what the task told the controllers (System::tell)
  std::size_t width = 2;     ///< outputs
  std::vector<double> rows;  ///< step k: rows[k width] and so on

  std::size_t size() const { return width == 0 ? 0 : rows.size() / width; }
  std::span<const double> row(std::size_t k) const { return std::span(rows).subspan(k * width, width); }
};

/// One solve of a closed loop: what was asked, and what the recording solver answered.
///
/// The reference is the motion from row `start` on, its outputs raised by `offset`; the set-points of a model with
/// feedback begin a row earlier. An instance whose reference is no such window carries its own rows.
struct InstanceRecord {
  std::uint32_t motion = 0;
  std::uint32_t start = 1;
  std::array<double, max_states> offset{};
  StateValues initial{};
  DelayLines lines;
  std::vector<int> warm_modes;
  std::vector<double> warm_continuous;      ///< blocks x inputs
  std::vector<double> reference, setpoint;  ///< own rows, steps x outputs; empty: the window
  std::vector<double> load;  ///< what the prediction took from an estimator; empty: the variant's own model
  /// What the warm start keeps of a relaxation: weights, blocks x modes, and what each switch owes. Empty: nothing.
  std::vector<double> warm_weights;
  SwitchStates<double> warm_owed{};

  std::vector<int> plan_modes;  ///< the best plan known, one mode a block
  std::vector<double> plan_continuous;
  double plan_cost = 0.0;
  Status plan_status = Status::optimal;
};

/// The instances of one variant. `toml` is the table [variant.NAME] without its heading and complete in itself.
struct VariantInstances {
  std::string name;
  std::string toml;
  VariantConfig config;  ///< `toml`, read
  std::vector<InstanceRecord> records;
};

/// A set of problems to judge solvers on; docs/reference/instances.md describes its file byte by byte.
struct InstanceSet {
  std::vector<RecordedMotion> motions;
  std::vector<VariantInstances> variants;
};

/// Of the files that this version writes; older ones are read.
inline constexpr std::uint32_t instance_format_version = 4;

/// Reads and checks a set. Throws ConfigError, one line with file, byte, problem and what is allowed, for anything that
/// is not a whole file of this version or an older one, or that no problem can be posed from.
InstanceSet read_instances(const std::string& path);
/// The same of a file's bytes; errors call it `name`.
InstanceSet parse_instances(std::string_view bytes, const std::string& name);

/// The set as a file's bytes.
std::string instance_bytes(const InstanceSet& set);

/// The variant as it was where a motion was recorded.
VariantConfig told(VariantConfig variant, const RecordedMotion& motion);

/// Puts an instance into the problem of its variant, told of its motion (make_problem), and its warm start into `plan`.
/// Allocates only when the sizes of either change.
template <HybridModel Model>
void pose(const InstanceSet& set, const InstanceRecord& record, Problem<Model>& problem, Plan<Model>& plan) {
  constexpr std::size_t outputs = Model::output_size, inputs = Model::continuous_size;
  const RecordedMotion& motion = set.motions[record.motion];
  if constexpr (HasLoad<Model>)
    if (!record.load.empty()) {
      Vector<double, Model::load_size> load;
      std::ranges::copy(record.load, load.begin());
      problem.model.set_load(load);
    }
  problem.initial = first<Model::state_size>(record.initial);
  problem.lines = record.lines;
  const auto row_of = [](std::span<const double> rows, std::size_t at) {
    OutputOf<Model> row{};
    std::ranges::copy(rows.subspan(at * outputs, outputs), row.begin());
    return row;
  };
  for (std::size_t j = 0; j < problem.reference.size(); ++j) {
    problem.reference[j] =
        record.reference.empty() ? row_of(motion.rows, record.start + j) : row_of(record.reference, j);
    if (record.reference.empty())
      for (std::size_t i = 0; i < outputs; ++i) problem.reference[j][i] += record.offset[i];
  }
  for (std::size_t j = 0; j < problem.setpoint.size(); ++j)
    problem.setpoint[j] =
        record.reference.empty() ? row_of(motion.rows, record.start - 1 + j) : row_of(record.setpoint, j);
  plan.modes = record.warm_modes;
  plan.continuous.resize(plan.modes.size());
  for (std::size_t b = 0; b < plan.continuous.size(); ++b)
    for (std::size_t i = 0; i < inputs; ++i) plan.continuous[b][i] = record.warm_continuous[b * inputs + i];
  plan.relaxation.known = !record.warm_weights.empty();
  plan.relaxation.weights.assign(record.warm_weights.begin(), record.warm_weights.end());
  plan.relaxation.weights.resize(plan.modes.size() * static_cast<std::size_t>(problem.modes.size()));
  plan.relaxation.owed.assign(plan.modes.size(), record.warm_owed);
}

/// A plan's continuous inputs in a row, blocks x inputs.
template <HybridModel Model>
std::vector<double> inputs_of(const Plan<Model>& plan) {
  std::vector<double> all;
  for (const ContinuousOf<Model>& u : plan.continuous) all.insert(all.end(), u.begin(), u.end());
  return all;
}

/// Whether a plan is the record's, bit for bit. No allocation.
template <HybridModel Model>
bool same_plan(const InstanceRecord& record, const Plan<Model>& plan) {
  if (plan.modes != record.plan_modes) return false;
  for (std::size_t b = 0, at = 0; b < plan.continuous.size(); ++b)
    for (const double u : plan.continuous[b])
      if (u != record.plan_continuous[at++]) return false;
  return true;
}

}  // namespace solenoid
