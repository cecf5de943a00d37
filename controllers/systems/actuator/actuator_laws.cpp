#include "controllers/factory.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "controllers/systems/actuator/laws/end_position.hpp"
#include "controllers/systems/actuator/laws/law_controller.hpp"
#include "controllers/systems/actuator/laws/pulse_width_pid.hpp"
#include "controllers/systems/actuator/laws/servo_pid.hpp"
#include "controllers/systems/actuator/laws/seven_mode_sliding.hpp"
#include "controllers/systems/actuator/laws/switching_hybrid.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/valves.hpp"

#include <fmt/format.h>

namespace solenoid {
namespace {

/// make(modes) is the law over the variant's valves.
template <class Make>
std::unique_ptr<Controller> make_law(const VariantConfig& v, const Motion& reference, Make make) {
  const auto model = make_model<PneumaticActuator>(v);
  return make_shell(v, reference,
                    LawController(model, make_motor(v, model), make(valve_modes(v.modes, model.parameters()))));
}

void check_motor(TableReader& table, const VariantConfig& v) {
  if (actuator(v).motor == "in_prediction" || actuator(v).motor == "joint")
    table.fail("motor", fmt::format("'{}' needs a solver, and '{}' is a law (allowed: none, pd, inverse_dynamics)",
                                    actuator(v).motor, v.solver));
}

void check_seven_mode(TableReader& table, const VariantConfig& v) {
  check_motor(table, v);
  const double full_m = actuator(v).seven_mode.full_above_m, dead_m = actuator(v).sliding.dead_band_m;
  const std::string why =
      fmt::format("full_above_m of {:g} m is below sliding.dead_band_m (allowed: {:g} and more)", full_m, dead_m);
  if (full_m < dead_m) table.fail("seven_mode", why);
}

void check_end_position(TableReader& table, const VariantConfig& v) {
  check_motor(table, v);
  const double start_m = actuator(v).end_position.start_m, stop_m = actuator(v).end_position.stop_m;
  const std::string why = fmt::format("start_m of {:g} m is below stop_m (allowed: {:g} and more)", start_m, stop_m);
  if (start_m < stop_m) table.fail("end_position", why);
}

void check_switching_hybrid(TableReader& table, const VariantConfig& v) {
  check_motor(table, v);
  if (actuator(v).motor == "none")
    table.fail("motor", "switching_hybrid leaves small errors to the motor (allowed: pd, inverse_dynamics)");
  if (actuator(v).phases.fine_below_m > actuator(v).phases.coarse_above_m)
    table.table("phases").fail("fine_below_m",
                               fmt::format("{:g} m is above coarse_above_m (allowed: 0 to {:g})",
                                           actuator(v).phases.fine_below_m, actuator(v).phases.coarse_above_m));
  if (actuator(v).phases.rest == "exhaust" && v.modes != "two_way")
    table.fail("valves", fmt::format("'{}' cannot exhaust both chambers at rest (allowed: two_way)", v.modes));
}

}  // namespace

std::vector<LawRow> actuator_laws() {
  const std::vector<std::string> closing = {"two_way", "three_mode", "seven_mode"};
  std::vector<LawRow> rows;
  rows.push_back({.name = "pulse_width_pid",
                  .summary = "PID on pulse widths of two 3/2 valves: van Varseveld and Bone 1997",
                  .groups = {"pulse_width"},
                  .modes = {"three_way"},
                  .make =
                      [](const VariantConfig& v, const Motion& reference) {
                        return make_law(v, reference, [&](const ModeSet& modes) {
                          return PulseWidthPid(actuator(v).pulse_width, modes, v.timing.tick_s);
                        });
                      },
                  .check = check_motor});
  rows.push_back({.name = "three_mode_sliding",
                  .summary = "three modes by the sign of a sliding surface: Nguyen et al. 2007",
                  .groups = {"sliding"},
                  .modes = closing,
                  .make =
                      [](const VariantConfig& v, const Motion& reference) {
                        return make_law(v, reference, [&](const ModeSet& modes) {
                          return ThreeModeSliding(actuator(v).sliding, modes);
                        });
                      },
                  .check = check_motor});
  rows.push_back({.name = "seven_mode_sliding",
                  .summary = "the same with modes in which one chamber acts: Hodgson et al. 2012, 2015",
                  .groups = {"sliding", "seven_mode"},
                  .modes = {"two_way", "seven_mode"},
                  .make =
                      [](const VariantConfig& v, const Motion& reference) {
                        return make_law(v, reference, [&](const ModeSet& modes) {
                          return SevenModeSliding(actuator(v).sliding, actuator(v).seven_mode, modes);
                        });
                      },
                  .check = check_seven_mode});
  rows.push_back({.name = "end_position",
                  .summary = "valves open until near the target, with flow control and cushion: what plants do",
                  .groups = {"end_position"},
                  .modes = {"two_way", "seven_mode"},
                  .make =
                      [](const VariantConfig& v, const Motion& reference) {
                        return make_law(v, reference, [&](const ModeSet& modes) {
                          return EndPosition(actuator(v).end_position, modes);
                        });
                      },
                  .check = check_end_position});
  rows.push_back({.name = "servo_pid",
                  .summary = "PID, feedforward and acceleration feedback on a servo valve a chamber: what is sold",
                  .groups = {"servo_pid", "servo"},
                  .modes = {servo_valves},
                  .make =
                      [](const VariantConfig& v, const Motion& reference) {
                        return make_law(v, reference, [&](const ModeSet&) {
                          return ServoPid(actuator(v).servo_pid, actuator(v).servo, v.timing.tick_s);
                        });
                      },
                  .check = check_motor});
  rows.push_back({.name = "switching_hybrid",
                  .summary = "the cylinder by sliding mode for larger errors, the motor always: Takemura et al. 2000",
                  .groups = {"sliding", "phases"},
                  .modes = closing,
                  .make =
                      [](const VariantConfig& v, const Motion& reference) {
                        return make_law(v, reference, [&](const ModeSet& modes) {
                          return SwitchingHybrid(actuator(v).phases, actuator(v).sliding, modes);
                        });
                      },
                  .check = check_switching_hybrid});
  return rows;
}

}  // namespace solenoid
