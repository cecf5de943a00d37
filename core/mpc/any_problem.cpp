#include "core/mpc/any_problem.hpp"

#include "core/mpc/plan.hpp"

#include <algorithm>
#include <stdexcept>

namespace solenoid {

AnyProblem::AnyProblem(ModeSet mode_set, Horizon grid, std::size_t switched_size)
    : modes(std::move(mode_set)), horizon(std::move(grid)) {
  if (modes.switched_size() != switched_size)
    throw std::invalid_argument("mode set '" + modes.name() + "' does not map to the model's switched inputs");
  if (horizon.blocks.empty() || !(horizon.dt_s > 0)) throw std::invalid_argument("horizon: needs blocks and dt > 0");
  for (const int length : horizon.blocks)
    if (length < 1) throw std::invalid_argument("horizon: every block needs at least one step");
}

void shift_plan(const Horizon& horizon, int steps, AnyPlan& plan) noexcept {
  const std::size_t blocks = plan.modes.size();
  const std::span<double> inputs = plan.inputs(), weights = plan.relaxation.weights;
  const auto take = [blocks](std::span<double> rows, std::size_t from, std::size_t to) {
    const std::size_t width = rows.size() / blocks;
    std::ranges::copy(rows.subspan(from * width, width), rows.subspan(to * width, width).begin());
  };
  std::size_t from = 0;
  int begin = steps, from_end = horizon.blocks.empty() ? 0 : horizon.blocks[0];
  for (std::size_t b = 0; b < blocks; ++b) {
    while (begin >= from_end && from + 1 < blocks) from_end += horizon.blocks[++from];
    if (from != b) {
      plan.modes[b] = plan.modes[from];
      take(inputs, from, b);
      if (plan.relaxation.known) {
        take(weights, from, b);
        plan.relaxation.owed[b] = plan.relaxation.owed[from];
        plan.relaxation.owed_sum[b] = plan.relaxation.owed_sum[from];
      }
    }
    begin += horizon.blocks[b];
  }
}

}  // namespace solenoid
