#pragma once

#include <cstddef>
#include <random>
#include <vector>

namespace solenoid::test {

/// Draws of the normal distribution.
inline std::vector<double> normal_values(std::mt19937_64& random, std::size_t count) {
  std::normal_distribution<double> normal;
  std::vector<double> values(count);
  for (double& value : values) value = normal(random);
  return values;
}

}  // namespace solenoid::test
