#include "experiments/systems/actuator/identify/residual_prediction.hpp"

#include "controllers/commands_in_flight.hpp"
#include "controllers/estimators/forecast.hpp"
#include "controllers/systems.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/systems/actuator/valves.hpp"
#include "experiments/systems/actuator/identify/signals.hpp"

#include <cmath>

namespace solenoid {
namespace {

constexpr double judged_width_s = 0.004;  // of the Gaussian on what was measured
constexpr int judged_every = 10;          // ticks

struct Squares {
  double sum = 0.0, outside = 0.0;
  std::size_t predictions = 0, ticks = 0;
};

Measurement measured_at(const Record& r, std::size_t t) {
  Measurement m;
  m.time_s = r.period_s * static_cast<double>(t);
  m.value[position_channel] = r.position_m[t];
  m.value[pressure_a_channel] = r.pressure_a_pa[t];
  m.value[pressure_b_channel] = r.pressure_b_pa[t];
  return m;
}

/// One record through the estimator, with predictions by the same model.
void judge_record(const Record& r, const VariantConfig& v, const ForceResidual& residual, const ForceResidual& covering,
                  Squares& found) {
  ActuatorParameters believed = actuator(v).nominal;
  believed.plane = r.plane;
  EstimatorTuning tuning = actuator(v).estimation;
  tuning.residual = residual;
  Estimator estimator = make_estimator(v.estimator, PneumaticActuator(believed), tuning);
  const ModeSet modes = valve_modes(r.valves, believed);
  const SwitchTiming timing(modes, r.period_s);
  CommandsInFlight in_flight(modes, r.period_s);
  ResidualActuator model(believed, MotorGains{0.0, 0.0}, residual);
  const std::vector<double> truth = gaussian(r.position_m, r.period_s, judged_width_s);
  constexpr auto ahead = static_cast<std::size_t>(PredictionError::ahead_ticks),
                 judged_from = static_cast<std::size_t>(PredictionError::settled_ticks);
  for (std::size_t t = 0; t + ahead < r.size(); ++t) {
    in_flight.catch_up(measured_at(r, t), estimator);
    const auto x = first<4>(estimator.update(measured_at(r, t)));
    if (t >= judged_from) {
      ++found.ticks;
      found.outside += covering.covers(x[position], x[velocity]) ? 0.0 : 1.0;
    }
    if (t >= judged_from && t % judged_every == 0) {
      const EstimateDetail detail = estimator.detail();
      model.set_load(detail.belief[payload_belief], detail.belief[disturbance_belief]);
      DelayLines lines = in_flight.lines();
      const auto commanded = [&](int j) { return r.coils[t + static_cast<std::size_t>(j)]; };
      const auto motor = [&](int j, const ActuatorState&) {
        return Vector<double, 1>{r.motor_n[t + static_cast<std::size_t>(j)]};
      };
      const auto then =
          forecast(model, modes, timing, x, lines, PredictionError::ahead_ticks, r.period_s, commanded, motor);
      found.sum += (then[position] - truth[t + ahead]) * (then[position] - truth[t + ahead]);
      ++found.predictions;
    }
    Command command;
    command.switches = r.coils[t];
    command.continuous[0] = r.motor_n[t];
    in_flight.take(command, estimator);
  }
}

}  // namespace

PredictionError prediction_error(const std::vector<Record>& records, const VariantConfig& v,
                                 const ForceResidual& residual) {
  Squares without, with;
  std::size_t judged = 0;
  for (const Record& r : records) {
    if (std::abs(r.period_s - v.timing.tick_s) > 1e-6) continue;
    judge_record(r, v, {}, residual, without);
    const std::size_t before = with.predictions;
    judge_record(r, v, residual, residual, with);
    judged += with.predictions > before ? 1 : 0;
  }
  const auto mean = [](double sum, std::size_t n) { return n ? sum / static_cast<double>(n) : 0.0; };
  return {.predictions = with.predictions,
          .records = judged,
          .without_m = std::sqrt(mean(without.sum, without.predictions)),
          .with_m = std::sqrt(mean(with.sum, with.predictions)),
          .outside = mean(with.outside, with.ticks)};
}

}  // namespace solenoid
