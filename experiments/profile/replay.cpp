#include "experiments/profile/replay.hpp"

#include "core/config/reader.hpp"
#include "experiments/profile/stopwatch.hpp"

#include <algorithm>
#include <chrono>
#include <cstring>

#include <fmt/format.h>
#include <sched.h>

namespace solenoid {
namespace {

using Clock = std::chrono::steady_clock;

/// A variant's problem as each motion of the set has it.
std::vector<std::unique_ptr<AnyProblem>> problems_of(const InstanceSet& set, const VariantConfig& variant) {
  const System& system = system_of(variant);
  std::vector<std::unique_ptr<AnyProblem>> problems;
  for (const RecordedMotion& motion : set.motions) problems.push_back(system.problem(told(variant, motion)));
  if (problems.empty()) problems.push_back(system.problem(variant));
  return problems;
}

class SolverReplay final : public Replay {
 public:
  SolverReplay(const InstanceSet& set, const VariantInstances& variant, double us_per_tick,
               const SolverDecorator& decorate)
      : set_(set),
        records_(variant.records),
        us_per_tick_(us_per_tick),
        problems_(problems_of(set, variant.config)),
        plan_(problems_[0]->new_plan()),
        solver_(make_solver(variant.config)),
        nodes_(records_.size()) {
    if (decorate) solver_ = decorate(std::move(solver_));
    solver_->prepare(*problems_[0]);
    timed_ = solver_->time_phases(nullptr);
  }

  void pass(bool with_phases, std::span<ReplaySample> samples) noexcept override {
    solver_->time_phases(with_phases ? &phases_ : nullptr);
    same_ = proven_ = 0;
    for (std::size_t i = 0; i < records_.size(); ++i) {
      const InstanceRecord& record = records_[i];
      AnyProblem& problem = *problems_[record.motion];
      pose(set_, record, problem, *plan_);
      phases_ = {};
      const Stopwatch watch;
      const SolveReport report = solver_->solve(problem, *plan_, Deadline::never());
      samples[i].time_us = watch.us();
      for (std::size_t p = 0; p < phase_count; ++p)
        samples[i].phase_us[p] = us_per_tick_ * static_cast<double>(phases_.ticks[p]);
      nodes_[i] = report.nodes;
      same_ += same_plan(record, *plan_);
      proven_ += report.status == Status::optimal;
    }
    solver_->time_phases(nullptr);
  }

  std::span<const std::int64_t> nodes() const override { return nodes_; }
  std::size_t plans_as_recorded() const override { return same_; }
  std::size_t proven() const override { return proven_; }
  bool has_phases() const override { return timed_; }

 private:
  const InstanceSet& set_;
  std::span<const InstanceRecord> records_;
  double us_per_tick_;
  std::vector<std::unique_ptr<AnyProblem>> problems_;  // of each motion
  std::unique_ptr<AnyPlan> plan_;
  AnySolverPtr solver_;
  bool timed_ = false;
  PhaseTimes phases_;
  std::vector<std::int64_t> nodes_;
  std::size_t same_ = 0, proven_ = 0;
};

/// Does nothing: what is left of a controller's step is the controller.
class IdleSolver final : public AnySolver {
  void do_prepare(const AnyProblem&) override {}
  SolveReport do_solve(const AnyProblem&, AnyPlan&, Deadline) noexcept override {
    SolveReport report;
    report.status = Status::feasible;
    return report;
  }
};

double median(std::vector<double>& sample) {
  const auto middle = sample.begin() + static_cast<std::ptrdiff_t>(sample.size() / 2);
  std::nth_element(sample.begin(), middle, sample.end());
  return *middle;
}

/// What the channels show of a state: the states of their names.
ChannelValues measured_at(const StateValues& state, const SystemDescription& system) {
  ChannelValues values{};
  for (std::size_t c = 0; c < system.channels.size(); ++c)
    for (std::size_t i = 0; i < system.states.size(); ++i)
      if (system.states[i].name == system.channels[c].name) values[c] = state[i];
  return values;
}

/// A recorded motion of each axis, from the outputs that are its value.
Motion motion_of(const RecordedMotion& s, const SystemDescription& system, double tick_s) {
  std::vector<Trajectory> axes;
  for (std::size_t a = 0; a < system.axes.size(); ++a) {
    std::vector<double> times, values;
    for (std::size_t i = 0; i < system.outputs.size(); ++i)
      if (system.outputs[i].axis == a && system.outputs[i].derivative == 0)
        for (std::size_t k = 0; k < s.size(); ++k) {
          times.push_back(static_cast<double>(k) * tick_s);
          values.push_back(s.row(k)[i]);
        }
    axes.emplace_back(values.empty() ? 0.0 : values.front());
    if (!values.empty()) axes.back().through(std::move(times), std::move(values));
  }
  return Motion(std::move(axes));
}

}  // namespace

std::unique_ptr<Replay> make_replay(const InstanceSet& set, const VariantInstances& variant, double us_per_phase_tick,
                                    const SolverDecorator& decorate) {
  return std::make_unique<SolverReplay>(set, variant, us_per_phase_tick, decorate);
}

double measured_us_per_phase_tick() {
  const auto begin = Clock::now();
  const std::uint64_t first = phase_ticks();
  while (us_since(begin) < 20'000) {
  }
  const std::uint64_t ticks = phase_ticks() - first;
  return us_since(begin) / static_cast<double>(ticks);
}

ControllerCost controller_cost(const InstanceSet& set, const VariantInstances& variant) {
  if (variant.records.empty()) return {};
  const Timing& timing = variant.config.timing;
  const RecordedMotion& motion = set.motions[variant.records.front().motion];
  const InstanceRecord& record = variant.records.front();
  const SolverDecorator idle = [](const AnySolverPtr&) { return std::make_unique<IdleSolver>(); };
  const SystemDescription& system = system_of(variant.config).description();
  const Motion desired = motion_of(motion, system, timing.tick_s);
  const auto controller = make_controller(told(variant.config, motion), desired, idle);
  constexpr int periods = 400;
  const int ticks_per_period = timing.ticks_per_period;
  Measurement sensors;
  sensors.truth = record.initial;
  sensors.value = measured_at(record.initial, system);
  std::vector<ChannelValues> measured(motion.size(), sensors.value);  // made before anything is timed
  for (std::size_t k = 0; k < measured.size(); ++k) {
    const ReferenceSample then = desired.at(static_cast<double>(k) * timing.tick_s);
    for (std::size_t a = 0; a < system.axes.size(); ++a) measured[k][system.axes[a].channel] = then.axis[a].value;
  }
  std::vector<double> quiet, posing;
  for (int k = 0; k < periods * ticks_per_period;) {
    const auto step = [&](int ticks) {
      const auto begin = Clock::now();
      for (int i = 0; i < ticks; ++i, ++k) {
        sensors.time_s = k * timing.tick_s;
        sensors.value = measured[static_cast<std::size_t>(k) % measured.size()];
        controller->step(sensors);
      }
      return us_since(begin);
    };
    posing.push_back(step(1));
    if (ticks_per_period > 1) quiet.push_back(step(ticks_per_period - 1) / (ticks_per_period - 1));
  }
  const double tick_us = quiet.empty() ? 0.0 : median(quiet);  // a period of one tick has no quiet ones
  return {ticks_per_period * tick_us, std::max(0.0, median(posing) - tick_us)};
}

PinnedCore::PinnedCore(int core) {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  sched_getaffinity(0, sizeof allowed, &allowed);
  before_.resize(sizeof allowed / sizeof(unsigned long));
  std::memcpy(before_.data(), &allowed, sizeof allowed);
  if (core < 0)
    for (int c = 0; c < CPU_SETSIZE; ++c)
      if (CPU_ISSET(static_cast<std::size_t>(c), &allowed)) core = c;
  cpu_set_t one;
  CPU_ZERO(&one);
  if (core >= 0 && core < CPU_SETSIZE) CPU_SET(static_cast<std::size_t>(core), &one);
  if (sched_setaffinity(0, sizeof one, &one) != 0)
    throw ConfigError(
        fmt::format("--core: {} is not a core this process may use (allowed: one of {})", core, CPU_COUNT(&allowed)));
  core_ = core;
}

PinnedCore::~PinnedCore() {
  sched_setaffinity(0, before_.size() * sizeof(unsigned long), reinterpret_cast<cpu_set_t*>(before_.data()));
}

}  // namespace solenoid
