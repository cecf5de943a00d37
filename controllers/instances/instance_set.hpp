#pragma once

#include "controllers/factory.hpp"
#include "controllers/variant.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

/// Where instances were recorded: a motion at whole model steps. rows[k] is the desired position [m] and velocity [m/s]
/// at k ms.
struct RecordedMotion {
  std::string name;
  Plane plane = Plane::vertical;
  std::vector<std::array<double, 2>> rows;
};

/// One solve of a closed loop: what was asked, and what the recording solver answered.
///
/// The reference is the motion from row `start` on, its position raised by `offset_m`; the set-points of a
/// model with feedback begin a row earlier. An instance whose reference is no such window carries its own rows.
struct InstanceRecord {
  std::uint32_t motion = 0;
  std::uint32_t start = 1;
  double offset_m = 0.0;
  ActuatorState initial{};
  DelayLines lines;
  std::vector<int> warm_modes;
  std::vector<double> warm_continuous;                     ///< [N], one a block
  std::vector<std::array<double, 2>> reference, setpoint;  ///< own rows; empty: the window
  /// What an estimator found beside the state.
  struct Load {
    double payload_kg = 0.0, external_force_n = 0.0;
  };
  std::optional<Load> load;  ///< what the prediction took from an estimator; none: the variant's own model
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
inline constexpr std::uint32_t instance_format_version = 3;

/// Reads and checks a set. Throws ConfigError, one line with file, byte, problem and what is allowed, for anything that
/// is not a whole file of this version or an older one, or that no problem can be posed from.
InstanceSet read_instances(const std::string& path);
/// The same of a file's bytes; errors call it `name`.
InstanceSet parse_instances(std::string_view bytes, const std::string& name);

/// The set as a file's bytes.
std::string instance_bytes(const InstanceSet& set);

/// Puts an instance into the problem of its variant and its motion's plane (make_problem), and its warm start into
/// `plan`. Allocates only when the sizes of either change.
template <HybridModel Model>
void pose(const InstanceSet& set, const InstanceRecord& record, Problem<Model>& problem, Plan<Model>& plan) {
  static_assert(Model::state_size == 4 && Model::output_size == 2 && Model::continuous_size == 1);
  const auto& rows = set.motions[record.motion].rows;
  if (record.load) problem.model.set_load(record.load->payload_kg, record.load->external_force_n);
  problem.initial = record.initial;
  problem.lines = record.lines;
  for (std::size_t j = 0; j < problem.reference.size(); ++j) {
    const auto& row = rows[record.start + j];
    problem.reference[j] = record.reference.empty() ? OutputOf<Model>{row[0] + record.offset_m, row[1]}
                                                    : OutputOf<Model>(record.reference[j]);
  }
  for (std::size_t j = 0; j < problem.setpoint.size(); ++j)
    problem.setpoint[j] = record.reference.empty() ? rows[record.start - 1 + j] : record.setpoint[j];
  plan.modes = record.warm_modes;
  plan.continuous.resize(record.warm_continuous.size());
  for (std::size_t b = 0; b < plan.continuous.size(); ++b) plan.continuous[b] = {record.warm_continuous[b]};
  plan.relaxation.known = !record.warm_weights.empty();
  plan.relaxation.weights.assign(record.warm_weights.begin(), record.warm_weights.end());
  plan.relaxation.weights.resize(plan.modes.size() * static_cast<std::size_t>(problem.modes.size()));
  plan.relaxation.owed.assign(plan.modes.size(), record.warm_owed);
}

/// Whether a plan is the record's, bit for bit.
template <HybridModel Model>
bool same_plan(const InstanceRecord& record, const Plan<Model>& plan) {
  if (plan.modes != record.plan_modes) return false;
  for (std::size_t b = 0; b < plan.continuous.size(); ++b)
    if (plan.continuous[b][0] != record.plan_continuous[b]) return false;
  return true;
}

}  // namespace solenoid
