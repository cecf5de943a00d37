#include "experiments/profile/random_problems.hpp"

#include "core/config/reader.hpp"
#include "core/signal/mixed_bits.hpp"

#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr int commands_before = 4;
constexpr double small_offset = 0.05;

std::vector<StateRange> finite_ranges(const VariantConfig& variant) {
  const System& system = system_of(variant);
  std::vector<StateRange> ranges = system.state_ranges(variant);
  for (std::size_t i = 0; i < ranges.size(); ++i)
    if (!std::isfinite(ranges[i].low) || !std::isfinite(ranges[i].high))
      throw ConfigError(
          fmt::format("variant '{}': system '{}' does not say where its state '{}' can be (allowed: systems with a "
                      "range of each state)",
                      variant.name, system.name(), system.description().states[i].name));
  return ranges;
}

}  // namespace

RandomProblems::RandomProblems(const VariantConfig& variant, const ScenarioList& tasks, std::uint64_t seed)
    : told_(told(variant, tasks.at(0))),
      system_(system_of(variant).description()),
      ranges_(finite_ranges(told_)),
      seed_(seed) {
  for (const ScenarioConfig& task : tasks) {
    const VariantConfig here = told(variant, task);
    if (here.timing != told_.timing)
      throw ConfigError(fmt::format("scenario '{}' has another sampling than '{}' (allowed: tasks of one)", task.name,
                                    tasks.name(0)));
    posed_.push_back({task.trajectory, system_of(here).problem(here)});
  }
}

int RandomProblems::mode(const ModeSet& modes) {
  return static_cast<int>(random_() % static_cast<std::uint64_t>(modes.size()));
}

DelayLines RandomProblems::lines(const AnyProblem& problem) {
  const SwitchTiming timing(problem.modes, problem.horizon.dt_s);
  const auto period = static_cast<std::uint64_t>(told_.timing.ticks_per_period);
  DelayLines lines(problem.modes.pattern(mode(problem.modes)));
  for (int i = 0; i < commands_before; ++i) {
    const SwitchPattern pattern = problem.modes.pattern(mode(problem.modes));
    if (lines.may_command(pattern, timing)) lines.command(pattern, timing);
    lines.advance(1 + static_cast<int>(random_() % period));
  }
  return lines;
}

AxisValues RandomProblems::offset() {
  AxisValues offset{};
  const double share = random_() % 4 < 2 ? 0.0 : random_() % 2 == 0 ? small_offset : 1.0;
  for (std::size_t a = 0; a < system_.axes.size(); ++a) {
    const StateRange& range = ranges_[system_.axes[a].state];
    const double most = share * (range.high - range.low);
    offset[a] = most > 0 ? between(-most, most) : 0.0;
  }
  return offset;
}

void RandomProblems::write(const Motion& motion, double from_s, const AxisValues& offset, double dt_s,
                           std::span<double> rows) const {
  const std::size_t width = system_.outputs.size();
  ReferenceSample sample;
  for (std::size_t j = 0; (j + 1) * width <= rows.size(); ++j) {
    motion.at(from_s + static_cast<double>(j) * dt_s, sample);
    for (std::size_t i = 0; i < width; ++i) {
      const OutputSource& output = system_.outputs[i];
      rows[j * width + i] =
          sample.axis[output.axis].derivative(output.derivative) + (output.derivative == 0 ? offset[output.axis] : 0.0);
    }
  }
}

AnyProblem& RandomProblems::pose(std::uint64_t number, AnyPlan& warm_start) {
  random_.seed(mixed_bits(mixed_bits(seed_) ^ number));
  Task& task = posed_[random_() % posed_.size()];
  AnyProblem& problem = *task.problem;
  const std::span<double> state = problem.initial_values();
  for (std::size_t i = 0; i < state.size(); ++i) state[i] = between(ranges_[i].low, ranges_[i].high);
  problem.lines = lines(problem);
  const double from_s = between(0.0, task.motion.duration_s()), dt_s = problem.horizon.dt_s;
  const AxisValues off = offset();
  write(task.motion, from_s + dt_s, off, dt_s, problem.reference_values());
  write(task.motion, from_s, random_() % 2 == 0 ? off : AxisValues{}, dt_s, problem.setpoint_values());
  for (int& planned : warm_start.modes) planned = mode(problem.modes);
  const std::span<double> inputs = warm_start.inputs();
  const std::span<const double> lower = problem.input_lower(), upper = problem.input_upper();
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const std::size_t k = i % lower.size();
    inputs[i] = std::isfinite(lower[k]) && std::isfinite(upper[k]) ? between(lower[k], upper[k]) : 0.0;
  }
  warm_start.relaxation.known = false;
  return problem;
}

}  // namespace solenoid
