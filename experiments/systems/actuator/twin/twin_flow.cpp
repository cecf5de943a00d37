#include "experiments/systems/actuator/twin/twin_flow.hpp"

namespace solenoid {

ValveOrifices fitted_orifices(const PneumaticActuator& model, double critical_ratio, double laminar_from) {
  const ActuatorParameters& p = model.parameters();
  const Iso6358 unit(1.0, critical_ratio, laminar_from);
  const double low = p.atmospheric_pressure_pa, high = p.supply_pressure_pa, t = p.temperature_k;
  double fill_product = 0, fill_square = 0, exhaust_product = 0, exhaust_square = 0;
  constexpr int points = 400;
  for (int i = 0; i < points; ++i) {
    const double pressure = low + (high - low) * (i + 0.5) / points;
    const double fill = unit.flow(high, t, pressure, t), exhaust = unit.flow(pressure, t, low, t);
    fill_product += fill * model.fill_flow<double>(pressure);
    fill_square += fill * fill;
    exhaust_product -= exhaust * model.exhaust_flow<double>(pressure);
    exhaust_square += exhaust * exhaust;
  }
  return {{fill_product / fill_square, critical_ratio, laminar_from},
          {exhaust_product / exhaust_square, critical_ratio, laminar_from}};
}

}  // namespace solenoid
