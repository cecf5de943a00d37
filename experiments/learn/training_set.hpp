#pragma once

#include "controllers/instances/instance_set.hpp"
#include "experiments/learn/perceptron.hpp"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace solenoid {

/// What a network is taught: the modes of optimal plans, or the optimal cost of the blocks that are left.
enum class Taught { modes, cost };

/// How samples are made of recorded problems.
struct SampleSettings {
  Taught taught = Taught::modes;
  double perturbed = 0.5;   ///< copies of each problem at a state beside its own, on average
  int searched_blocks = 2;  ///< of a cost: blocks before those that it is of
  int ways = 4;             ///< of a cost: sequences of those blocks that a state is followed along
  double emphasis = 4.0;    ///< weight of problems whose optimum is not the warm start, the others' being 1
  std::uint64_t seed = 1;
};

/// Samples of one variant.
/// shapes   features: samples x features    modes: samples x blocks, numbers of modes    weights, costs: samples
struct TrainingSet {
  std::string layout;         ///< of the features, as the network will have it
  std::vector<int> patterns;  ///< of the modes
  std::size_t blocks = 0;
  Samples<float> features;
  std::vector<int> modes;
  std::vector<float> weights;
  std::vector<double> costs;
  std::string hash;  ///< of all numbers

  std::size_t size() const { return static_cast<std::size_t>(features.rows()); }
};

/// Samples from recorded problems, each with a certified optimum: problems without one are left out.
///
/// Perturbed problems begin at the state plus a normal number times the state's usual change from one recorded problem
/// to the next, times a scale between 1 and 1/1000, evenly in its logarithm: the near misses and the far ones that the
/// teacher's own loops do not show. For costs each problem is followed along its plan and along sequences drawn at
/// random, and the blocks left are solved from there.
///
/// Interrupted, it has those of the problems before.
TrainingSet training_set(const InstanceSet& set, const VariantInstances& variant, const SampleSettings& settings,
                         const std::function<bool()>& interrupted = {});

}  // namespace solenoid
