#include "controllers/catalogue.hpp"
#include "controllers/factory.hpp"
#include "controllers/systems/actuator/laws/law_controller.hpp"
#include "controllers/systems/actuator/laws/pulse_width_pid.hpp"
#include "controllers/systems/actuator/laws/switching_hybrid.hpp"
#include "core/config/reader.hpp"

#include <fmt/format.h>

namespace solenoid {
namespace {

/// make(modes) is the law over the variant's valves.
template <class Make>
std::unique_ptr<Controller> make_law(const VariantConfig& v, const Motion& reference, Plane plane, Make make) {
  const auto model = make_model<PneumaticActuator>(v, plane);
  return make_shell(v, reference, plane,
                    LawController(model, make_motor(v, model), make(valve_modes(v.valves, model.parameters()))));
}

void check_motor(TableReader& table, const VariantConfig& v) {
  if (v.motor == "in_prediction" || v.motor == "joint")
    table.fail("motor", fmt::format("'{}' needs a solver, and '{}' is a law (allowed: none, pd, inverse_dynamics)",
                                    v.motor, v.solver));
}

void check_switching_hybrid(TableReader& table, const VariantConfig& v) {
  check_motor(table, v);
  if (v.motor == "none")
    table.fail("motor", "switching_hybrid leaves small errors to the motor (allowed: pd, inverse_dynamics)");
  if (v.phases.fine_below_m > v.phases.coarse_above_m)
    table.table("phases").fail("fine_below_m", fmt::format("{:g} m is above coarse_above_m (allowed: 0 to {:g})",
                                                           v.phases.fine_below_m, v.phases.coarse_above_m));
  if (v.phases.rest == "exhaust" && v.valves != "two_way")
    table.fail("valves", fmt::format("'{}' cannot exhaust both chambers at rest (allowed: two_way)", v.valves));
}

std::vector<LawRow> make_law_rows() {
  const std::vector<std::string> closing = {"two_way", "three_mode", "seven_mode"};
  std::vector<LawRow> rows;
  rows.push_back({.name = "pulse_width_pid",
                  .summary = "PID on pulse widths of two 3/2 valves: van Varseveld and Bone 1997",
                  .groups = {"pulse_width"},
                  .valves = {"three_way"},
                  .make =
                      [](const VariantConfig& v, const Motion& reference, Plane plane) {
                        return make_law(v, reference, plane, [&](const ModeSet& modes) {
                          return PulseWidthPid(v.pulse_width, modes, v.timing.tick_s);
                        });
                      },
                  .check = check_motor});
  rows.push_back({.name = "three_mode_sliding",
                  .summary = "three modes by the sign of a sliding surface: Nguyen et al. 2007",
                  .groups = {"sliding"},
                  .valves = closing,
                  .make =
                      [](const VariantConfig& v, const Motion& reference, Plane plane) {
                        return make_law(v, reference, plane,
                                        [&](const ModeSet& modes) { return ThreeModeSliding(v.sliding, modes); });
                      },
                  .check = check_motor});
  rows.push_back({.name = "switching_hybrid",
                  .summary = "the cylinder by sliding mode for larger errors, the motor always: Takemura et al. 2000",
                  .groups = {"sliding", "phases"},
                  .valves = closing,
                  .make =
                      [](const VariantConfig& v, const Motion& reference, Plane plane) {
                        return make_law(v, reference, plane, [&](const ModeSet& modes) {
                          return SwitchingHybrid(v.phases, v.sliding, modes);
                        });
                      },
                  .check = check_switching_hybrid});
  return rows;
}

}  // namespace

const std::vector<LawRow>& law_rows() {
  static const std::vector<LawRow> rows = make_law_rows();
  return rows;
}

}  // namespace solenoid
