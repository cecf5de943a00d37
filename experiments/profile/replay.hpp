#pragma once

#include "controllers/instances/instance_set.hpp"
#include "core/mpc/phases.hpp"
#include "experiments/profile/hardware_counters.hpp"

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace solenoid {

/// How one variant's solver did on one instance in one pass.
struct ReplaySample {
  double time_us = 0.0;
  std::array<double, phase_count> phase_us{};  ///< 0 without phase timing
};

/// One variant's instances and a solver prepared for them.
class Replay {
 public:
  virtual ~Replay() = default;
  /// Solves every instance once, in order, each to its end; samples: one an instance.
  virtual void pass(bool with_phases, std::span<ReplaySample> samples) noexcept = 0;
  /// Nodes or iterations and whether the plan was the recorded one, of each instance, after a pass.
  virtual std::span<const std::int64_t> nodes() const = 0;
  virtual std::size_t plans_as_recorded() const = 0;
  virtual std::size_t proven() const = 0;
  virtual bool has_phases() const = 0;
};

/// The instances of one variant with the variant's own solver, decorated if asked for. `set` must outlive it.
std::unique_ptr<Replay> make_replay(const InstanceSet& set, const VariantInstances& variant, double us_per_phase_tick,
                                    const SolverDecorator& decorate = {});

/// Length of a phase tick, measured against the monotonic clock for some milliseconds.
double measured_us_per_phase_tick();

/// What a control period of the variant's controller costs beside the solve, median over the first motion that has
/// records: everything each tick does (estimator, offset, motor law), ticks_per_period times, and posing the problem, once.
struct ControllerCost {
  double estimate_us = 0.0, prepare_us = 0.0;
};
ControllerCost controller_cost(const InstanceSet& set, const VariantInstances& variant);

/// Binds the calling thread to one core while it lives.
class PinnedCore {
 public:
  /// -1: the last core this process may use. Throws ConfigError for a core it may not use.
  explicit PinnedCore(int core);
  ~PinnedCore();
  PinnedCore(const PinnedCore&) = delete;
  PinnedCore& operator=(const PinnedCore&) = delete;
  int core() const { return core_; }

 private:
  int core_ = -1;
  std::vector<unsigned long> before_;
};

}  // namespace solenoid
