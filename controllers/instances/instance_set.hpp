#pragma once

#include "controllers/factory.hpp"
#include "controllers/variant.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace solenoid {

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
void pose(const InstanceSet& set, const InstanceRecord& record, AnyProblem& problem, AnyPlan& plan);

/// A plan's continuous inputs in a row, blocks x inputs.
inline std::vector<double> inputs_of(const AnyPlan& plan) {
  const std::span<const double> all = plan.inputs();
  return {all.begin(), all.end()};
}

/// Whether a plan is the record's, bit for bit. No allocation.
inline bool same_plan(const InstanceRecord& record, const AnyPlan& plan) {
  return plan.modes == record.plan_modes && std::ranges::equal(plan.inputs(), record.plan_continuous);
}

}  // namespace solenoid
