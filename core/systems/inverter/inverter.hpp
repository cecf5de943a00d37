#pragma once

#include "core/mpc/hybrid_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace solenoid {

class TableReader;

/// What a three-phase inverter feeds. The defaults are a medium-voltage drive like the one on which multistep direct MPC
/// was introduced: T. Geyer, D. E. Quevedo, "Multistep Finite Control Set Model Predictive Control for Power
/// Electronics", IEEE Trans. Power Electronics 29(12), 2014, an induction machine at a neutral-point-clamped inverter.
/// Machine and link are `MV_Induction_Machine` and `3L_MV_Converter` of Soft4PES (Tampere University): 3.3 kV, 356 A,
/// 50 Hz, power factor 0.85, L_ls = 2.544 mH, L_lr = 1.881 mH, L_m = 40.01 mH, R_s = 57.61 mOhm, R_r = 48.89 mOhm. (It
/// has the resistances in Ohm, which would be ten times the base impedance: a misprint.)
///
/// Seen from its terminals the machine is a resistance, its total leakage and an electromotive force behind them, which
/// turns with the rotor flux; that the force is sinusoidal, whatever the currents do, is what this model simplifies.
struct InverterParameters {
  double dc_link_v = 5200.0;        ///< both halves of the link together (the drive's)
  double resistance_ohm = 0.1022;   ///< R_s + R_r (L_m / L_r)^2
  double inductance_h = 4.34e-3;    ///< L_s - L_m^2 / L_r, 0.255 of the base impedance of 5.35 Ohm at 50 Hz
  double emf_amplitude_v = 2356.0;  ///< at rated current and voltage with a power factor of 0.85 (from these values)
  double emf_frequency_hz = 50.0;   ///< rated
  double rated_current_a = 503.5;   ///< amplitude: sqrt(2) 356 A
  double sampling_s = 25e-6;        ///< usual for such drives with direct control; not compared with the paper's text
  double switching_delay_s = 0.0;   ///< from a command to its effect, dead time included
  bool operator==(const InverterParameters&) const = default;
};

/// Reads parameters by the names of the fields above, but the sampling and the frequency, which a task says; a table says
/// those that differ. Throws ConfigError with file, line, key and what is allowed.
InverterParameters read_inverter(TableReader& table);

/// The amplitude-invariant Clarke transform: of three phase quantities the vector (alpha, beta) without their mean.
template <class S>
Vector<S, 2> clarke(const Vector<S, 3>& abc) {
  return {S(2.0 / 3.0) * abc[0] - S(1.0 / 3.0) * (abc[1] + abc[2]), S(std::numbers::inv_sqrt3) * (abc[1] - abc[2])};
}

/// The phase quantities of mean zero that have this vector.
template <class S>
Vector<S, 3> inverse_clarke(const Vector<S, 2>& v) {
  const S a = S(-0.5) * v[0], b = S(std::numbers::sqrt3 / 2) * v[1];
  return {v[0], a + b, a - b};
}

/// An inverter's load of resistance, inductance and a rotating electromotive force, in stator-fixed coordinates.
///
/// state       x = (i_alpha, i_beta [A], e_alpha, e_beta [V])
/// switched    s = phase levels (u_a, u_b, u_c), each in [-1, 1]
/// output      z = (i_alpha, i_beta [A])
///
///     L di/dt = -R i + v - e,   v = V_dc/2 clarke(u_a, u_b, u_c)
///     de/dt   = w (-e_beta, e_alpha)
///
/// step() is exact for held levels. With vectors as complex numbers and a = exp(-R dt / L)
///
///     e+ = r e,   r = exp(j w dt)
///     i+ = a i + (1 - a)/R v - (r - a)/(R + j w L) e
///
/// The coefficients are those of the sampling time it was made with; for another dt every step computes them again.
class InverterLoad {
 public:
  static constexpr std::size_t state_size = 4, switched_size = 3, continuous_size = 0, output_size = 2;
  /// Indices into the state.
  enum StateIndex : std::size_t { i_alpha = 0, i_beta = 1, e_alpha = 2, e_beta = 3 };

  /// Throws std::invalid_argument, naming what is not positive.
  explicit InverterLoad(const InverterParameters& parameters = {});

  const InverterParameters& parameters() const { return parameters_; }

  /// The electromotive force of the parameters' amplitude at this angle.
  Vector<double, 2> emf(double angle_rad) const {
    return {parameters_.emf_amplitude_v * std::cos(angle_rad), parameters_.emf_amplitude_v * std::sin(angle_rad)};
  }

  template <class S>
  Vector<S, 4> step(const Vector<S, 4>& x, const Vector<S, 3>& level, const Vector<S, 0>&, double dt) const {
    const Coefficients k = coefficients(dt);
    const S rise_alpha = S(k.alpha) * (level[0] - S(0.5) * (level[1] + level[2]));
    const S rise_beta = S(k.beta) * (level[1] - level[2]);
    const S fall_alpha = S(k.fall_real) * x[e_alpha] - S(k.fall_imaginary) * x[e_beta];
    const S fall_beta = S(k.fall_imaginary) * x[e_alpha] + S(k.fall_real) * x[e_beta];
    return {S(k.decay) * x[i_alpha] + (rise_alpha - fall_alpha), S(k.decay) * x[i_beta] + (rise_beta - fall_beta),
            S(k.cosine) * x[e_alpha] - S(k.sine) * x[e_beta], S(k.sine) * x[e_alpha] + S(k.cosine) * x[e_beta]};
  }

  template <class S>
  Vector<S, 2> output(const Vector<S, 4>& x) const {
    return {x[i_alpha], x[i_beta]};
  }

  /// Says by how much the states move over ten sampling times.
  Vector<double, 4> state_scale() const;

  /// Moves a box [low, high] by a step with levels anywhere in theirs: each coordinate of the new box is the range of
  /// that coordinate over the old one, for the map is linear.
  template <class S>
  void enclose_step(Vector<S, 4>& low, Vector<S, 4>& high, const Vector<S, 3>& level_low,
                    const Vector<S, 3>& level_high, const Vector<double, 2>&, const Vector<double, 0>&,
                    double dt) const {
    const Coefficients k = coefficients(dt);
    const S least_alpha = S(k.alpha) * (level_low[0] - S(0.5) * (level_high[1] + level_high[2]));
    const S most_alpha = S(k.alpha) * (level_high[0] - S(0.5) * (level_low[1] + level_low[2]));
    const S least_beta = S(k.beta) * (level_low[1] - level_high[2]);
    const S most_beta = S(k.beta) * (level_high[1] - level_low[2]);
    const auto lowest = [&](double real, double imaginary) {
      return least_of<S>(real, low[e_alpha], high[e_alpha]) + least_of<S>(imaginary, low[e_beta], high[e_beta]);
    };
    const auto highest = [&](double real, double imaginary) {
      return least_of<S>(real, high[e_alpha], low[e_alpha]) + least_of<S>(imaginary, high[e_beta], low[e_beta]);
    };
    const Vector<S, 4> below = {S(k.decay) * low[i_alpha] + (least_alpha - highest(k.fall_real, -k.fall_imaginary)),
                                S(k.decay) * low[i_beta] + (least_beta - highest(k.fall_imaginary, k.fall_real)),
                                lowest(k.cosine, -k.sine), lowest(k.sine, k.cosine)};
    high = {S(k.decay) * high[i_alpha] + (most_alpha - lowest(k.fall_real, -k.fall_imaginary)),
            S(k.decay) * high[i_beta] + (most_beta - lowest(k.fall_imaginary, k.fall_real)), highest(k.cosine, -k.sine),
            highest(k.sine, k.cosine)};
    low = below;
  }

 private:
  /// One step's map: i+ = decay i + (alpha (u_a - (u_b + u_c)/2), beta (u_b - u_c)) - fall e, e+ = (cosine + j sine) e.
  struct Coefficients {
    double decay = 1.0, alpha = 0.0, beta = 0.0, fall_real = 0.0, fall_imaginary = 0.0, cosine = 1.0, sine = 0.0;
  };
  Coefficients coefficients(double dt) const { return dt == parameters_.sampling_s ? own_ : computed(dt); }
  Coefficients computed(double dt) const;

  /// The least of factor * x for x in [low, high]; with low and high exchanged the most.
  template <class S>
  static S least_of(double factor, const S& low, const S& high) {
    return S(factor) * (factor < 0.0 ? high : low);
  }

  InverterParameters parameters_;
  Coefficients own_;
};

}  // namespace solenoid
