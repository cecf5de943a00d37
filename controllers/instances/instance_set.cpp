#include "controllers/instances/instance_set.hpp"

namespace solenoid {

void pose(const InstanceSet& set, const InstanceRecord& record, AnyProblem& problem, AnyPlan& plan) {
  const ModelSizes sizes = problem.sizes();
  const std::size_t outputs = sizes.outputs;
  const RecordedMotion& motion = set.motions[record.motion];
  if (!record.load.empty()) problem.set_load(record.load);
  std::copy_n(record.initial.begin(), sizes.states, problem.initial_values().begin());
  problem.lines = record.lines;
  const std::span<double> reference = problem.reference_values(), setpoint = problem.setpoint_values();
  if (record.reference.empty()) {
    std::copy_n(motion.row(record.start).begin(), reference.size(), reference.begin());
    for (std::size_t k = 0; k < reference.size(); ++k) reference[k] += record.offset[k % outputs];
    std::copy_n(motion.row(record.start - 1).begin(), setpoint.size(), setpoint.begin());
  } else {
    std::copy_n(record.reference.begin(), reference.size(), reference.begin());
    std::copy_n(record.setpoint.begin(), setpoint.size(), setpoint.begin());
  }
  plan.resize(record.warm_modes.size());
  plan.modes = record.warm_modes;
  std::ranges::copy(record.warm_continuous, plan.inputs().begin());
  plan.relaxation.known = !record.warm_weights.empty();
  plan.relaxation.weights.assign(record.warm_weights.begin(), record.warm_weights.end());
  plan.relaxation.weights.resize(plan.modes.size() * static_cast<std::size_t>(problem.modes.size()));
  plan.relaxation.owed.assign(plan.modes.size(), record.warm_owed);
}

}  // namespace solenoid
