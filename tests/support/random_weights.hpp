#pragma once

#include "solvers/rounding/mode_weights.hpp"

#include <cmath>
#include <random>

namespace solenoid::test {

/// Weights of random shape: equal or ragged intervals; rows spread out, near a corner, or at one.
inline ModeWeights random_weights(std::mt19937_64& random, int modes, int intervals, bool ragged) {
  std::uniform_real_distribution unit(0.0, 1.0);
  std::vector<double> dt(static_cast<std::size_t>(intervals), 0.5 + unit(random));
  if (ragged)
    for (double& length : dt) length = std::exp(3.0 * unit(random) - 2.0);
  ModeWeights weights(modes, dt);
  const double sharpness = std::exp(4.0 * unit(random) - 1.0);
  for (std::size_t k = 0; k < dt.size(); ++k) {
    if (unit(random) < 0.1) {
      weights.at(k, random() % static_cast<std::size_t>(modes)) = 1.0;
      continue;
    }
    for (std::size_t m = 0; m < static_cast<std::size_t>(modes); ++m)
      weights.at(k, m) = std::pow(unit(random), sharpness);
  }
  normalise(weights);
  return weights;
}

}  // namespace solenoid::test
