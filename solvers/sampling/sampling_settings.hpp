#pragma once

#include <cstdint>

namespace solenoid {

/// How the distribution follows the costs of its samples.
enum class SamplingUpdate : std::uint8_t {
  elites,   ///< cross-entropy method: the modes' frequencies among the best samples
  weights,  ///< MPPI: their sums of the weights exp(-(J - J_min) / (temperature * (J_mean - J_min)))
};

/// Of ModeSampling.
struct ModeSamplingSettings {
  SamplingUpdate update = SamplingUpdate::elites;
  int samples = 512;         ///< sequences tried a solve, over all iterations
  int iterations = 4;        ///< at most `samples`
  double elites = 0.1;       ///< share of an iteration's samples
  double temperature = 0.1;  ///< > 0
  double smoothing = 0.3;    ///< share of the distribution before an update that stays in it
  double mutation = 0.3;     ///< probability that a block of a sample takes a neighbour of its mode
  std::uint64_t seed = 1;
};

}  // namespace solenoid
