#include "experiments/described/described_simulation.hpp"

#include "core/metrics/tracking.hpp"

#include <cmath>
#include <limits>

namespace solenoid {

void DescribedSimulationBase::read(TableReader& table, ScenarioConfig& s) const {
  const ModelDescription& said = parts_.said();
  DescribedScenario& own = s.own.as<DescribedScenario>();
  own.parameters.assign(said.parameters.size(), std::numeric_limits<double>::quiet_NaN());
  if (table.has("plant")) {
    TableReader plant = table.table("plant");
    for (std::size_t i = 0; i < own.parameters.size(); ++i)
      if (const ModelDescription::Parameter& p = said.parameters[i]; plant.has(p.name))
        own.parameters[i] = plant.number(p.name, p.range);
    plant.finish();
  }
  for (const ModelDescription::State& state : said.states) own.start.push_back(state.start);
  if (table.has("start")) {
    TableReader start = table.table("start");
    for (std::size_t i = 0; i < own.start.size(); ++i)
      own.start[i] = start.number_or(said.states[i].name, own.start[i], {said.states[i].low, said.states[i].high});
    start.finish();
  }
  read_sensing(table, s);
  AxisValues targets{};
  std::size_t axis = 0;
  for (const ModelDescription::Output& output : said.outputs)
    if (output.rate_of.empty()) targets[axis++] = output.target;
  if (table.has("trajectory"))
    if (TableReader trajectory = table.table("trajectory"); !trajectory.keys().empty())
      return read_motion(trajectory, system_.description(), targets, s);
  std::vector<Trajectory> at_rest;
  for (std::size_t a = 0; a < axis; ++a) at_rest.emplace_back(targets[a]);
  s.trajectory = Motion(std::move(at_rest));
  s.trajectory_kind = "rest";
  s.duration_s = s.trajectory.duration_s();
}

Metrics DescribedSimulationBase::evaluate(const VariantConfig& v, const ScenarioConfig&,
                                          std::span<const TickRecord> ticks, const Consumed& consumed) const {
  const SystemDescription& system = system_.description();
  Metrics m;
  for (const MetricColumn& metric : system.metrics) m[metric.key] = 0.0;
  const TrackingFigures f = tracking_figures(ticks, system, v.timing.tick_s, system_.modes(v).safe_pattern());
  m.finite = f.finite;
  if (ticks.empty()) return m;
  for (const TickRecord& tick : ticks)
    for (std::size_t i = 0; i < system.outputs.size(); ++i) {
      const OutputSource& output = system.outputs[i];
      const double desired = tick.decision.reference.axis[output.axis].derivative(output.derivative);
      const double error = desired - tick.sensors.truth[parts_.state_of(parts_.said().outputs[i].state)];
      m["objective"] += parts_.said().outputs[i].weight * error * error * v.timing.tick_s;
    }
  std::size_t column = 1;
  for (std::size_t a = 0; a < system.axes.size(); ++a) {
    m[system.metrics[column++].key] = f.axis[a].rms;
    m[system.metrics[column++].key] = f.axis[a].largest;
  }
  if (!system.consumption.name.empty()) m[system.metrics[column].key] = consumed.total;
  m["switches"] = f.switches;
  m["switches_per_s"] = f.duration_s > 0 ? f.switches / f.duration_s : 0.0;
  add_solves(ticks, 1e6 * v.timing.period_s(), m);
  return m;
}

std::vector<double> DescribedSimulationBase::parameters(const VariantConfig& v, const ScenarioConfig& s) const {
  std::vector<double> values = v.own.as<DescribedVariant>().parameters;
  const std::vector<double>& plant = s.own.as<DescribedScenario>().parameters;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (i < plant.size() && std::isfinite(plant[i])) values[i] = plant[i];
  return values;
}

std::vector<double> DescribedSimulationBase::start(const ScenarioConfig& s) const {
  std::vector<double> start = s.own.as<DescribedScenario>().start;
  for (std::size_t i = start.size(); i < parts_.said().states.size(); ++i)
    start.push_back(parts_.said().states[i].start);
  return start;
}

}  // namespace solenoid
