#pragma once

#include "controllers/system.hpp"
#include "experiments/campaign/scenario_list.hpp"

#include <cstdint>
#include <memory>
#include <random>
#include <span>
#include <vector>

namespace solenoid {

/// Problems that a variant's solver may be given, drawn over the whole set that its system states, not over the states
/// that a closed loop comes by.
///
///     state         uniform in its range (System::state_ranges), whatever the other states are
///     lines         a legal history of four commands, up to a control period apart, the last just given or a while ago
///     reference     a window of one of the tasks' motions from a uniform time on; half as it is, a quarter off by up to
///                   5 % of the axis' range, a quarter by up to the whole of it: beyond what the horizon can reach
///     set-points    of a model with feedback: the same motion, off by as much or not at all
///     warm start    any modes, and inputs in their bounds where these are finite
///
/// Problem n of a seed is always the same. What an estimator may find of the model's load is left at the variant's own.
class RandomProblems {
 public:
  /// Throws ConfigError for a state without a range, or tasks of another sampling than the first's.
  RandomProblems(const VariantConfig& variant, const ScenarioList& tasks, std::uint64_t seed);

  /// The variant told of the first task.
  const VariantConfig& variant() const { return told_; }
  /// One range a state.
  std::span<const StateRange> ranges() const { return ranges_; }
  /// Of whatever state: for what depends on mode set and grid alone.
  const AnyProblem& shape() const { return *posed_.front().problem; }
  /// Puts problem `number` together, which lives until the next, and its warm start.
  AnyProblem& pose(std::uint64_t number, AnyPlan& warm_start);

 private:
  struct Task {
    Motion motion;
    std::unique_ptr<AnyProblem> problem;
  };
  double between(double low, double high) { return std::uniform_real_distribution(low, high)(random_); }
  int mode(const ModeSet& modes);
  DelayLines lines(const AnyProblem& problem);
  AxisValues offset();
  void write(const Motion& motion, double from_s, const AxisValues& offset, double dt_s, std::span<double> rows) const;

  VariantConfig told_;
  const SystemDescription& system_;
  std::vector<StateRange> ranges_;
  std::vector<Task> posed_;
  std::uint64_t seed_;
  std::mt19937_64 random_;
};

}  // namespace solenoid
