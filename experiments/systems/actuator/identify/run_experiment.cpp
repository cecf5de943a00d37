#include "experiments/systems/actuator/identify/run_experiment.hpp"

#include "core/config/reader.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "core/rt/process_setup.hpp"
#include "core/signal/filters.hpp"
#include "core/systems/actuator/signals.hpp"
#include "core/systems/actuator/valves.hpp"
#include "experiments/systems/actuator/twin/twin_plant.hpp"

#include <atomic>
#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <thread>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr int most_stale_ticks = 20;

/// The coil pattern of each pair of chamber actions. Throws ConfigError for a pair these valves cannot take.
class Patterns {
 public:
  Patterns(const Experiment& experiment, const ModeSet& modes) : modes_(modes) {
    for (const ExperimentStep& s : experiment.steps)
      for (const bool bit : {false, true})
        if (find(resolved(s.a, bit), resolved(s.b, bit)) < 0)
          throw ConfigError(
              fmt::format("experiment '{}': step '{}' asks for chambers that {} valves do not have "
                          "(allowed: valves = two_way)",
                          experiment.name, s.label, modes.name()));
  }
  SwitchPattern of(const ExperimentStep& s, bool bit) const {
    return modes_.pattern(find(resolved(s.a, bit), resolved(s.b, bit)));
  }

 private:
  static ChamberAction resolved(ChamberAction action, bool bit) {
    if (action != ChamberAction::random) return action;
    return bit ? ChamberAction::fill : ChamberAction::exhaust;
  }
  int find(ChamberAction a, ChamberAction b) const {
    const auto open = [](ChamberAction action, ChamberAction wanted) { return action == wanted ? 1.0 : 0.0; };
    const double wanted[] = {open(a, ChamberAction::fill), open(a, ChamberAction::exhaust),
                             open(b, ChamberAction::fill), open(b, ChamberAction::exhaust)};
    for (int m = 0; m < modes_.size(); ++m) {
      const auto point = modes_.point(modes_.pattern(m));
      if (std::equal(point.begin(), point.end(), wanted)) return m;
    }
    return -1;
  }
  ModeSet modes_;
};

/// Plays an experiment tick by tick.
class ExperimentController final : public Controller {
 public:
  ExperimentController(const Experiment& experiment, const ModeSet& modes, const ExperimentSettings& settings)
      : experiment_(experiment),
        patterns_(experiment, modes),
        limit_n_(settings.motor_limit_n),
        random_(settings.seed * 7919 + 17) {
    starts_.reserve(experiment.steps.size() * static_cast<std::size_t>(experiment.cycles) + 1);
  }

  Decision step(const Measurement& sensors) noexcept override {
    Decision decision;
    if (ticks_ == 0) reset(sensors.value[position_channel]);
    const double y = filter_.step(sensors.value[position_channel]), v = difference_.step(y);
    stale_ = sensors.stale_ticks > most_stale_ticks || !std::isfinite(sensors.value[position_channel]);
    if (!finished_ && over(sensors.value[position_channel])) next(sensors.value[position_channel]);
    ++ticks_;
    if (finished_ || stale_) return decision;
    const ExperimentStep& s = current();
    const double t = actuator_timing.tick_s * static_cast<double>(ticks_in_step_);
    decision.command = {patterns_.of(s, random_bit(s)), std::clamp(force(s, t, y, v), -limit_n_, limit_n_)};
    decision.reference.axis[0].value = reference_m_;
    ++ticks_in_step_;
    return decision;
  }

  bool ended() const { return finished_ || stale_; }
  bool stale() const { return stale_; }
  /// Spans of the steps begun, in ticks; those without a label too.
  std::vector<Span> spans() const {
    std::vector<Span> all;
    for (std::size_t i = 0; i < starts_.size(); ++i)
      all.push_back({experiment_.steps[i % experiment_.steps.size()].label, static_cast<std::size_t>(starts_[i]),
                     static_cast<std::size_t>(i + 1 < starts_.size() ? starts_[i + 1] : ticks_)});
    return all;
  }

 private:
  const ExperimentStep& current() const { return experiment_.steps[starts_.size() % experiment_.steps.size()]; }
  void reset(double position_m) {
    filter_.reset(position_m);
    difference_.reset(position_m);
    begin(position_m);
  }
  void begin(double position_m) {
    from_m_ = reference_m_ = position_m;
    began_tick_ = ticks_;
    ticks_in_step_ = 0;
  }
  bool over(double position_m) const {
    const ExperimentStep& s = current();
    if (s.until_moved_m && moved(position_m) > *s.until_moved_m) return true;
    const double elapsed_s = actuator_timing.tick_s * static_cast<double>(ticks_in_step_);
    if (s.to_m && elapsed_s * s.speed_m_s >= std::abs(*s.to_m - from_m_)) return true;
    return ticks_in_step_ >= std::llround(s.seconds / actuator_timing.tick_s);
  }
  double moved(double position_m) const { return std::abs(position_m - from_m_); }
  void next(double position_m) {
    starts_.push_back(began_tick_);
    finished_ = starts_.size() == experiment_.steps.size() * static_cast<std::size_t>(experiment_.cycles);
    begin(position_m);
  }
  bool random_bit(const ExperimentStep& s) {
    const auto bit_ticks = std::llround(s.random_bit_s / actuator_timing.tick_s);
    if (ticks_in_step_ % bit_ticks == 0) bit_ = (random_() >> 40) & 1u;
    return bit_;
  }
  double force(const ExperimentStep& s, double t, double y, double v) {
    double f = s.motor_from_n + (s.motor_to_n - s.motor_from_n) * t / s.seconds;
    f += s.sine_n * std::sin(2 * std::numbers::pi * s.sine_hz * t);
    double speed = 0.0;
    if (s.hold_m) reference_m_ = *s.hold_m;
    if (s.to_m) {
      const double direction = *s.to_m > from_m_ ? 1.0 : -1.0;
      reference_m_ = from_m_ + direction * s.speed_m_s * t;
      speed = direction * s.speed_m_s;
    }
    if (s.hold_m || s.to_m) f += experiment_.stiffness * (reference_m_ - y) + experiment_.damping * (speed - v);
    return f;
  }

  const Experiment& experiment_;
  Patterns patterns_;
  double limit_n_;
  Butterworth2 filter_{50.0, 1 / actuator_timing.tick_s};
  BackwardDifference difference_{actuator_timing.tick_s};
  std::mt19937_64 random_;
  std::vector<std::int64_t> starts_;  // of the steps that have ended
  std::int64_t ticks_ = 0, began_tick_ = 0, ticks_in_step_ = 0;
  double from_m_ = 0, reference_m_ = 0;
  bool bit_ = false, finished_ = false, stale_ = false;
};

/// Even samples: a tick that was left out repeats the one before.
Record record_of(const Experiment& experiment, const ExperimentSettings& settings, const std::vector<TickRecord>& ticks,
                 const ExperimentController& controller) {
  Record r;
  r.name = experiment.name;
  r.plane = experiment.plane;
  r.payload_kg = experiment.loaded ? settings.loaded_payload_kg : 0.0;
  r.valves = settings.valves;
  r.period_s = actuator_timing.tick_s;
  std::vector<std::size_t> place;  // of each tick among the samples
  const auto add = [&](const TickRecord& t) {
    r.position_m.push_back(t.sensors.value[position_channel]);
    r.pressure_a_pa.push_back(t.sensors.value[pressure_a_channel]);
    r.pressure_b_pa.push_back(t.sensors.value[pressure_b_channel]);
    r.motor_n.push_back(t.applied.continuous[0]);
    r.coils.push_back(t.applied.switches);
  };
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    for (int k = 0; k < ticks[i].skipped && i > 0; ++k, ++r.filled) add(ticks[i - 1]);
    if (ticks[i].sensors.stale_ticks > 0) ++r.filled;
    place.push_back(r.size());
    add(ticks[i]);
  }
  for (Span span : controller.spans()) {
    if (span.first >= place.size()) continue;
    span.last = span.last < place.size() ? place[span.last] : r.size();
    span.first = place[span.first];
    r.spans.push_back(span);
  }
  return r;
}

}  // namespace

Record simulate_experiment(const Experiment& experiment, const TwinParameters& twin,
                           const ExperimentSettings& settings) {
  const double payload = experiment.loaded ? settings.loaded_payload_kg : 0.0;
  // A seed of its own for each experiment: their noise is not the same.
  std::uint64_t seed = settings.seed;
  for (const char c : experiment.name) seed = seed * 1099511628211u + static_cast<unsigned char>(c);
  const TwinParameters parameters = twin_for(twin, {experiment.plane, payload, {}});
  TwinPlant plant(parameters, settings.valves, experiment.start_m, TwinPlant::Sensing{false, true, seed});
  const ModeSet modes = valve_modes(settings.valves, parameters.actuator);
  ExperimentController controller(experiment, modes, settings);
  CommandLimits limits(modes, {settings.motor_limit_n});
  const auto ticks = std::llround(experiment.longest_s() / actuator_timing.tick_s) + 2;
  MemoryRecorder recorder(static_cast<std::size_t>(ticks));
  FakeClock clock;
  ControlLoop loop(plant, clock, controller, limits, recorder);
  loop.run(ticks, actuator_timing.tick_s, [&] { return controller.ended(); });
  return record_of(experiment, settings, recorder.records(), controller);
}

Record run_experiment_in_real_time(const Experiment& experiment, Plant& plant, const ExperimentSettings& settings,
                                   const std::function<bool()>& interrupted) {
  const ModeSet modes = valve_modes(settings.valves, ActuatorParameters{});
  ExperimentController controller(experiment, modes, settings);
  CommandLimits limits(modes, {settings.motor_limit_n});
  const auto ticks = std::llround(experiment.longest_s() / actuator_timing.tick_s) + 2;
  MemoryRecorder recorder(static_cast<std::size_t>(ticks));
  std::atomic<bool> stop{false}, ended{false};
  std::thread thread([&] {
    prepare_thread("tick");
    set_fifo_priority("tick", 80);
    MonotonicClock clock;
    ControlLoop loop(plant, clock, controller, limits, recorder);
    loop.run(ticks, actuator_timing.tick_s, [&] { return controller.ended() || stop.load(std::memory_order_relaxed); });
    plant.write({});
    ended.store(true);
  });
  while (!ended.load()) {
    if (interrupted()) stop.store(true);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  thread.join();
  if (controller.stale())
    throw std::runtime_error(
        fmt::format("experiment '{}': the sensors stayed away; outputs are safe", experiment.name));
  return record_of(experiment, settings, recorder.records(), controller);
}

}  // namespace solenoid
