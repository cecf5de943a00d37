#pragma once

#include "core/systems/actuator/parameters.hpp"

#include <string>

namespace solenoid {

class TableReader;

/// Valve travel: a commanded edge of a coil waits for its dead time, then the opening ramps over its travel. The dead
/// time is the coil's delay (model.md, eq. 12) less half the travel, so that the valve is half open at the
/// delay the thesis measured. Each edge's dead time is shifted by a normal deviate, cut at twice its sigma and at zero.
struct ValveTravel {
  double rise_s = 0.0;          ///< opening time when energised; 0: at once
  double fall_s = 0.0;          ///< closing time when de-energised
  double jitter_sigma_s = 0.0;  ///< of each edge
};

enum class FlowLaw { model, iso6358 };
/// Valve flow: the model's (5.7, 5.8), or ISO 6358 with sonic conductances fitted to the model's law (flow.hpp).
struct FlowEffects {
  FlowLaw law = FlowLaw::model;
  double critical_ratio = 0.53;  ///< b of ISO 6358
  double laminar_from = 0.98;    ///< pressure ratio above which the flow is laminar: linear in the ratio
};

enum class ThermalLaw { model, polytropic, heat_transfer };
/// Air in the chambers, V dP/dt = R sum(alpha T mdot) - n P dV/dt [+ (k - 1) Q]:
///   model          alpha = n = k at the temperature T of the supply (4.18)
///   polytropic     alpha_in, alpha_out, n given, at T (Richer & Hurmuzlu 2000)
///   heat_transfer  alpha = n = k, mass and temperature of each chamber, Q = h (wall area) (T - T_chamber)
struct ThermalEffects {
  ThermalLaw law = ThermalLaw::model;
  double alpha_in = 1.4, alpha_out = 1.0, exponent = 1.2;
  double heat_transfer = 0.0;  ///< h [W/(m2 K)]
};

/// Supply: constant, or a reservoir at the valves fed by a regulator, V dP_s/dt = R T (regulator - drawn), isothermal,
/// regulator = conductance (P_set - P_s) between 0 and its largest flow.
struct SupplyEffects {
  bool reservoir = false;
  double volume_m3 = 1e-3;
  double conductance = 1e-7;   ///< [kg/(s Pa)]
  double largest_flow = 2e-3;  ///< [kg/s]
};

enum class FrictionLaw { model, lugre };
/// Friction: the model's law (4.14), or LuGre with the model's levels (Canudas de Wit et al. 1995):
///     dz/dt = v - sigma_0 |v| z / g(v),  g = F_cf + (F_sf - F_cf) exp(-(v/v_s)^2),
///     F = sigma_0 z + sigma_1 exp(-(v/v_s)^2) dz/dt + C_vf v
/// sigma_1 = 2 zeta sqrt(sigma_0 m_eq), fading with speed (Olsson 1996).
struct FrictionEffects {
  FrictionLaw law = FrictionLaw::model;
  double bristle_stiffness = 1e5;   ///< sigma_0 [N/m]
  double bristle_damping = 0.3;     ///< zeta
  double stribeck_velocity = 0.01;  ///< v_s [m/s]
};

/// Gear between motor and slide: rigid and massless as in the model, or a rotor with its inertia behind backlash and a
/// Hunt-Crossley contact, F = k d (1 + c dd/dt) at penetration d > 0, never pulling.
struct GearEffects {
  bool backlash = false;
  double backlash_m = 5e-5;        ///< whole play at the pitch line
  double stiffness = 2e5;          ///< k [N/m]
  double damping = 5.0;            ///< c [s/m]
  double rotor_inertia = 1.38e-5;  ///< [kg m2], RE40: 138 g cm2
};

/// Sensing chain (model.md, section 6). Noise and spikes act before the filters, quantisation after.
struct SensingEffects {
  double position_sigma_m = 0.02e-3;
  double position_low_m = -0.01, position_high_m = 0.11;  ///< what -5 V and +5 V stand for
  double pressure_sigma_pa = 1000.0;                      ///< raw, each 0.1 ms
  double spike_pa = 10e3;
  double spike_rate_hz = 50.0;  ///< mean rate of Poisson arrivals
  double spike_duration_s = 3e-4;
  double bessel_hz = 50.0;          ///< cut-off of the pressure filters; 0: none
  double pressure_span_pa = 210e3;  ///< gauge pressure at +5 V
  int converter_bits = 13;          ///< over +-5 V (MultiQ3); 0: no quantisation

  /// White noise `factor` times as strong, spikes as many times as frequent.
  void scale_noise(double factor) {
    position_sigma_m *= factor;
    pressure_sigma_pa *= factor;
    spike_rate_hz *= factor;
  }
};

enum class Integration { fixed, adaptive };
/// Integration of each 0.1 ms: Runge-Kutta 4 in equal steps, or dense-output Dormand-Prince 5 with event location.
struct IntegrationChoice {
  Integration method = Integration::fixed;
  int steps = 1;            ///< of the fixed method in 0.1 ms
  double tolerance = 1e-9;  ///< of the adaptive one, absolute and relative, in scaled state (state.hpp)
};

/// The truth plant as data. Default: all effects off, the controller's model in continuous time with ideal sensors
/// but for the sensing chain.
struct TwinParameters {
  ActuatorParameters actuator;
  ValveTravel valves;
  FlowEffects flow;
  ThermalEffects thermal;
  SupplyEffects supply;
  FrictionEffects friction;
  GearEffects gear;
  double motor_lag_s = 0.0;  ///< first-order lag of the motor force; 0: none
  SensingEffects sensing;
  IntegrationChoice integration;
};

/// Reads a twin: tables actuator (keys of read_parameters), valves, flow, thermal, supply, friction, gear, motor,
/// sensing, integration; what is missing is off. Throws ConfigError with file, line, key and what is allowed.
TwinParameters read_twin(TableReader& table);
TwinParameters read_twin_file(const std::string& path);
/// The twin shipped as experiments/systems/actuator/data/scenarios/twin.toml, compiled in.
const TwinParameters& nominal_twin();

}  // namespace solenoid
