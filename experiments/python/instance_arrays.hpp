#pragma once

#include "controllers/instances/instance_set.hpp"
#include "experiments/python/interruptible.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// Instances as a dictionary of arrays, and back. A set is {"motions": [{name, setting, rows}], "variants": [ARRAYS]};
/// what is in ARRAYS, of what shape, package/instances.py says.

/// What the arrays of a variant's instances look like, and what their numbers are of.
struct Layout {
  const System* system;
  std::vector<std::string> modes, switches;
  std::vector<int> blocks;  ///< model steps each
  std::size_t steps, setpoints;
  ModelSizes sizes;
  double tick_s;

  explicit Layout(const VariantConfig& variant) : Layout(variant, *system_of(variant).problem(variant)) {}
  Layout(const VariantConfig& variant, const AnyProblem& problem)
      : system(&system_of(variant)),
        blocks(problem.horizon.blocks),
        sizes(problem.sizes()),
        tick_s(problem.horizon.dt_s) {
    for (const Mode& mode : problem.modes.modes()) modes.push_back(mode.name);
    for (const Switch& one : problem.modes.switches()) switches.push_back(one.name);
    steps = problem.reference_values().size() / sizes.outputs;
    setpoints = problem.setpoint_values().size() / sizes.outputs;
  }
};

/// A set as arrays, copied.
py::dict dictionary_of(const InstanceSet& set);
/// The inverse. Throws ConfigError naming variant, array, shape and what is allowed. A record whose rows are those of
/// its motion has none of its own.
InstanceSet set_of(const py::dict& from);

/// The motions of such a dictionary.
std::vector<RecordedMotion> motions_of(const py::list& from);
/// A variant of it without records.
VariantInstances variant_of(const py::dict& from);
/// Its records; unless `windows`, each has rows of its own.
std::vector<InstanceRecord> records_of(const py::dict& from, const std::vector<RecordedMotion>& motions,
                                       const VariantInstances& v, bool windows);

/// Whether a record's rows are those of its motion, bit for bit.
bool is_window(const InstanceRecord& r, const RecordedMotion& motion);

}  // namespace solenoid
