#include "experiments/systems/actuator/thesis/fidelity.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid {
namespace {

bool is_overshoot(const Cell& cell) { return cell.metric == "overshoot_measured_percent"; }

}  // namespace

double choice_criterion(std::span<const Cell> cells) {
  double difference = 0;
  int n = 0;
  for (const Cell& cell : cells) {
    if (!is_overshoot(cell)) continue;
    difference += std::abs(cell.ours - cell.thesis->value) / 10.0;
    ++n;
  }
  return mean_abs_ln(cells, [](const Cell& c) { return c.metric == "sse_max_abs_measured_mm"; }) +
         difference / std::max(1, n);
}

double largest_overshoot_percent(std::span<const Cell> cells, int from_np) {
  double largest = 0;
  for (const Cell& cell : cells)
    if (is_overshoot(cell) && std::stoi(cell.case_name.substr(sizeof("N_p = ") - 1)) >= from_np)
      largest = std::max(largest, cell.ours);
  return largest;
}

}  // namespace solenoid
