#pragma once

#include <random>

namespace solenoid {

inline double uniform(std::mt19937_64& random, double low, double high) {
  return std::uniform_real_distribution(low, high)(random);
}

}  // namespace solenoid
