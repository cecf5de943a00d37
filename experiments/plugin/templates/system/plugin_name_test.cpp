// Properties of the model itself.
#include "plugin_name.hpp"

#include <array>
#include <cstdio>

int main() {
  const double power_w = 60.0, inner_k_per_w = 0.5, air_k_per_w = 2.0;
  const std::array<double, 6> parameters = {power_w, 0.0, 50.0, 500.0, inner_k_per_w, air_k_per_w};
  const plugin_name::Plate plate(parameters);
  int failed = 0;
  const auto expect = [&](bool right, const char* what) {
    if (!right) std::printf("failed: %s\n", what), ++failed;
  };

  // At rest with the heater on all its power leaves through the block.
  const solenoid::Vector<double, 2> rest = {power_w * (inner_k_per_w + air_k_per_w), power_w * air_k_per_w};
  const auto stays = plate.step<double>(rest, {1.0}, {}, 0.2);
  expect(std::abs(stays[0] - rest[0]) < 1e-9 && std::abs(stays[1] - rest[1]) < 1e-9, "what is at rest stays there");

  // The classical Runge-Kutta method is of fourth order: half the step, a sixteenth of the error.
  const auto after = [&](int steps) {
    solenoid::Vector<double, 2> x = {50.0, 40.0};
    for (int k = 0; k < steps; ++k) x = plate.step<double>(x, {1.0}, {}, 40.0 / steps);
    return x[0];
  };
  const double exact = after(4096), ratio = (after(4) - exact) / (after(8) - exact);
  expect(ratio > 12.0 && ratio < 22.0, "the order is four");
  return failed;
}
