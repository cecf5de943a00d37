#pragma once

#include "core/systems/actuator/dynamics.hpp"

#include <cmath>

namespace solenoid {

/// Orifice by ISO 6358-1 with its laminar part.
///
///     mdot = C rho_0 p1 sqrt(T0/T1) w(p2/p1)
///     w(r) = 1                                  r <= b          choked
///            sqrt(1 - ((r - b)/(1 - b))^2)      b < r <= r_lam
///            w(r_lam) (1 - r)/(1 - r_lam)       r_lam < r <= 1  laminar: finite slope at rest
///
/// C sonic conductance [m3/(s Pa)], b critical pressure ratio, rho_0 = 1.185 kg/m3 and T0 = 293.15 K the standard's
/// reference atmosphere, p1 and T1 upstream.
class Iso6358 {
 public:
  Iso6358(double conductance, double critical_ratio, double laminar_from)
      : mass_conductance_(conductance * reference_density),
        critical_(critical_ratio),
        laminar_from_(laminar_from),
        laminar_slope_(subsonic(laminar_from) / (1 - laminar_from)) {}

  /// Mass flow from `from_pa` to `to_pa` [kg/s], negative when the pressures push it back.
  double flow(double from_pa, double from_k, double to_pa, double to_k) const {
    return from_pa >= to_pa ? forward(from_pa, from_k, to_pa) : -forward(to_pa, to_k, from_pa);
  }
  double conductance() const { return mass_conductance_ / reference_density; }

  static constexpr double reference_density = 1.185, reference_temperature_k = 293.15;

 private:
  double subsonic(double r) const {
    const double x = (r - critical_) / (1 - critical_);
    return std::sqrt(1 - x * x);
  }
  double forward(double up_pa, double up_k, double down_pa) const {
    if (up_pa <= 0) return 0.0;
    const double r = down_pa / up_pa;
    const double w = r <= critical_ ? 1.0 : r <= laminar_from_ ? subsonic(r) : laminar_slope_ * (1 - r);
    return mass_conductance_ * up_pa * std::sqrt(reference_temperature_k / up_k) * w;
  }

  double mass_conductance_, critical_, laminar_from_, laminar_slope_;
};

/// The orifices whose flow is nearest to the model's law, least squares over chamber pressures from atmosphere to
/// supply: C = sum f w / sum w^2 with f the model's flow and w the standard's at C = 1. The thesis's charging and
/// discharging curves (4.5.2), seen through its own fit.
struct ValveOrifices {
  Iso6358 fill, exhaust;
};
ValveOrifices fitted_orifices(const PneumaticActuator& model, double critical_ratio, double laminar_from);

}  // namespace solenoid
