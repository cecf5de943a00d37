#include "core/systems/inverter/signals.hpp"

#include "core/metrics/tracking.hpp"

#include <algorithm>
#include <cmath>
#include <complex>

namespace solenoid {
namespace {

Axis current_axis(const char* name, const char* label, const char* key, std::size_t index) {
  Axis axis;
  axis.signal = {name, "A", key, label, "desired current"};
  axis.shown_unit = "A";
  axis.rate_label = "rate";
  axis.offset_key = std::string("offset_") + name;
  axis.approach = 1e4;
  axis.state = axis.channel = index;
  return axis;
}

SystemDescription described_inverter() {
  SystemDescription s;
  s.name = "inverter";
  s.summary = "a three-level three-phase inverter on a resistive-inductive load with back-EMF: a medium-voltage drive";
  s.states = {{"i_alpha", "A", "true_i_alpha_a", "current alpha", "current"},
              {"i_beta", "A", "true_i_beta_a", "current beta", "current"},
              {"e_alpha", "V", "true_e_alpha_v", "back-EMF alpha", "electromotive force"},
              {"e_beta", "V", "true_e_beta_v", "back-EMF beta", "electromotive force"}};
  s.estimate_keys = {"estimate_i_alpha_a", "estimate_i_beta_a", "estimate_e_alpha_v", "estimate_e_beta_v"};
  s.channels = {{"i_alpha", "A", "i_alpha_a", "current alpha", "measured"},
                {"i_beta", "A", "i_beta_a", "current beta", "measured"}};
  s.axes = {current_axis("i_alpha", "current alpha", "reference_i_alpha_a", 0),
            current_axis("i_beta", "current beta", "reference_i_beta_a", 1)};
  s.reference_keys = {"reference_i_alpha_a", "reference_i_beta_a", "reference_rate_alpha_a_s",
                      "reference_rate_beta_a_s"};
  s.outputs = {{0, 0, "i_alpha", "1/A2"}, {1, 0, "i_beta", "1/A2"}};
  s.metrics = {{.key = "error_percent", .heading = "error %"},
               {.key = "distortion_percent", .heading = "distortion %"},
               {.key = "rmse_a", .heading = "RMSE A"},
               {.key = "largest_a", .heading = "largest A"},
               {.key = "switching_hz", .heading = "switching Hz", .effort = true},
               {.key = "switches", .whole = true, .heading = "switches"}};
  s.judged = {"error_percent", "current's error"};
  s.conditions = {{"inductance_factor", "", "inductance_factor", "inductance factor"}};
  s.timing = {25e-6, 1};
  s.switches_key = "gates";
  s.switch_noun = "gate";
  s.modes_key = "levels";
  s.axis_limit_name = "current limit";
  return s;
}

}  // namespace

const SystemDescription& inverter_description() {
  static const SystemDescription description = described_inverter();
  return description;
}

Metrics evaluate_inverter_run(std::span<const TickRecord> ticks, double tick_s, const ModeSet& modes,
                              double deadline_us) {
  Metrics m;
  for (const MetricColumn& metric : inverter_description().metrics) m[metric.key] = 0.0;
  const TrackingFigures f = tracking_figures(ticks, inverter_description(), tick_s, modes.safe_pattern());
  m.finite = f.finite;
  if (ticks.empty()) return m;
  using Complex = std::complex<double>;
  const auto current = [](const TickRecord& t) { return Complex(t.sensors.truth[0], t.sensors.truth[1]); };
  const auto desired = [](const TickRecord& t) {
    return Complex(t.decision.reference.axis[0].value, t.decision.reference.axis[1].value);
  };
  Complex product = 0;
  double power = 0;
  for (const TickRecord& t : ticks) {
    product += current(t) * std::conj(desired(t));
    power += std::norm(desired(t));
    m["largest_a"] = std::max(m["largest_a"], std::abs(current(t) - desired(t)));
  }
  const auto n = static_cast<double>(ticks.size());
  const Complex share = power > 0 ? product / power : Complex(0);
  double rest = 0;
  for (const TickRecord& t : ticks) rest += std::norm(current(t) - share * desired(t));
  m["rmse_a"] = std::hypot(f.axis[0].rms, f.axis[1].rms);
  if (power > 0) m["error_percent"] = 100.0 * m["rmse_a"] / std::sqrt(power / n);
  if (power > 0) m["distortion_percent"] = 100.0 * std::sqrt(rest / power);
  const int devices = 2 * modes.switch_count();
  m["switching_hz"] = f.switches / (devices * f.duration_s);
  m["switches"] = f.switches;
  add_solves(ticks, deadline_us, m);
  return m;
}

}  // namespace solenoid
