#include "controllers/baselines/read_law.hpp"

#include "controllers/variant.hpp"
#include "core/config/reader.hpp"

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr int longest_period_ticks = 200;

void read_pulse_width(TableReader& variant, PulseWidthSettings& s) {
  if (!variant.has("pulse_width")) return;
  TableReader table = variant.table("pulse_width");
  const Range gain = Range::non_negative();
  s.proportional = table.number_or("proportional", s.proportional, gain);
  s.integral = table.number_or("integral", s.integral, gain);
  s.derivative = table.number_or("derivative", s.derivative, gain);
  s.integral_limit = table.number_or("integral_limit", s.integral_limit, Range::between(0.0, 1.0));
  s.feedforward = table.number_or("feedforward", s.feedforward, gain);
  s.lead_s = table.number_or("lead_s", s.lead_s, Range::between(0.0, 1.0));
  s.friction = table.number_or("friction", s.friction, Range::between(0.0, 1.0));
  s.friction_band_m = table.number_or("friction_band_m", s.friction_band_m, gain);
  s.bias = table.number_or("bias", s.bias, Range::between(0.0, 1.0));
  s.period_ticks = table.integer_or("period_ticks", s.period_ticks, 5, longest_period_ticks);
  table.finish();
}

void read_sliding(TableReader& variant, SlidingSettings& s) {
  if (!variant.has("sliding")) return;
  TableReader table = variant.table("sliding");
  s.frequency = table.number_or("frequency", s.frequency, Range::positive());
  s.damping = table.number_or("damping", s.damping, Range::non_negative());
  s.dead_band_m = table.number_or("dead_band_m", s.dead_band_m, Range::non_negative());
  s.every_ticks = table.integer_or("every_ticks", s.every_ticks, 1, longest_period_ticks);
  table.finish();
}

void read_phases(TableReader& variant, PhaseSettings& s) {
  if (!variant.has("phases")) return;
  TableReader table = variant.table("phases");
  s.coarse_above_m = table.number_or("coarse_above_m", s.coarse_above_m, Range::positive());
  s.fine_below_m = table.number_or("fine_below_m", s.fine_below_m, Range::non_negative());
  if (s.fine_below_m > s.coarse_above_m)
    table.fail("fine_below_m",
               fmt::format("{:g} m is above coarse_above_m (allowed: 0 to {:g})", s.fine_below_m, s.coarse_above_m));
  s.exhaust = table.text_or("rest", "closed", {"closed", "exhaust"}) == "exhaust";
  table.finish();
}

void require_valves(const TableReader& table, const VariantConfig& v, const std::vector<std::string>& allowed) {
  std::string names;
  for (const std::string& name : allowed) {
    if (name == v.valves) return;
    names += (names.empty() ? "" : ", ") + name;
  }
  table.fail("valves",
             fmt::format("'{}' lacks modes that the law '{}' needs (allowed: {})", v.valves, v.solver, names));
}

}  // namespace

void read_law(TableReader& table, VariantConfig& v) {
  if (v.predicts_motor() || v.motor == "joint")
    table.fail("motor", fmt::format("'{}' needs a solver, and '{}' is a law (allowed: none, pd, inverse_dynamics)",
                                    v.motor, v.solver));
  if (v.solver == "pulse_width_pid") {
    read_pulse_width(table, v.pulse_width);
    return require_valves(table, v, {"three_way"});
  }
  read_sliding(table, v.sliding);
  if (v.solver == "three_mode_sliding") return require_valves(table, v, {"two_way", "three_mode", "seven_mode"});
  read_phases(table, v.phases);
  if (v.motor == "none")
    table.fail("motor", "switching_hybrid leaves small errors to the motor (allowed: pd, inverse_dynamics)");
  if (v.phases.exhaust) return require_valves(table, v, {"two_way"});
  require_valves(table, v, {"two_way", "three_mode", "seven_mode"});
}

}  // namespace solenoid
