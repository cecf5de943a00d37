#include "controllers/systems.hpp"

#include <utility>

namespace solenoid {

System::System(const SystemDescription& description, Choices choices)
    : description_(description), choices_(std::move(choices)) {
  require_complete(description);
  keys_ = common_keys(description_, names_of(choices_.solvers), names_of(choices_.laws), choices_.mode_sets,
                      names_of(choices_.estimators), choices_.parameter_sets);
}

Horizon make_horizon(const VariantConfig& v) {
  Horizon horizon{v.timing.tick_s, {}};
  if (solver_row(v).pulses) {
    horizon.blocks.assign(static_cast<std::size_t>(v.horizon.steps), 1);
    return horizon;
  }
  for (const int periods : v.horizon.blocks) horizon.blocks.push_back(periods * v.timing.ticks_per_period);
  if (horizon.blocks.empty()) horizon.blocks = {v.horizon.steps};
  return horizon;
}

}  // namespace solenoid
