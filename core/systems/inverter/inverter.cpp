#include "core/systems/inverter/inverter.hpp"

#include "core/config/reader.hpp"

#include <complex>
#include <stdexcept>
#include <string>

namespace solenoid {
namespace {

void require_positive(const char* name, double value) {
  if (!(value > 0.0) || !std::isfinite(value))
    throw std::invalid_argument("inverter: " + std::string(name) + " must be positive, not " + std::to_string(value));
}

}  // namespace

InverterParameters read_inverter(TableReader& table) {
  InverterParameters p;
  const Range positive{0.0, 1e9, true};
  p.dc_link_v = table.number_or("dc_link_v", p.dc_link_v, positive);
  p.resistance_ohm = table.number_or("resistance_ohm", p.resistance_ohm, positive);
  p.inductance_h = table.number_or("inductance_h", p.inductance_h, positive);
  p.emf_amplitude_v = table.number_or("emf_amplitude_v", p.emf_amplitude_v, Range::between(0.0, 1e9));
  p.rated_current_a = table.number_or("rated_current_a", p.rated_current_a, positive);
  p.switching_delay_s = table.number_or("switching_delay_s", p.switching_delay_s, Range::between(0.0, 1.0));
  table.finish();
  return p;
}

InverterLoad::InverterLoad(const InverterParameters& parameters) : parameters_(parameters) {
  require_positive("dc_link_v", parameters.dc_link_v);
  require_positive("resistance_ohm", parameters.resistance_ohm);
  require_positive("inductance_h", parameters.inductance_h);
  require_positive("sampling_s", parameters.sampling_s);
  own_ = computed(parameters.sampling_s);
}

InverterLoad::Coefficients InverterLoad::computed(double dt) const {
  const double r = parameters_.resistance_ohm, l = parameters_.inductance_h;
  const double w = 2 * std::numbers::pi * parameters_.emf_frequency_hz;
  const double settled = -std::expm1(-r * dt / l);  // 1 - a, without cancellation
  const double half_angle = std::sin(w * dt / 2);
  const std::complex<double> turned(-2 * half_angle * half_angle, std::sin(w * dt));  // exp(j w dt) - 1
  const std::complex<double> fall = (turned + settled) / std::complex(r, w * l);
  const double per_level = settled / r * parameters_.dc_link_v / 2;
  return {.decay = std::exp(-r * dt / l),
          .alpha = per_level * 2 / 3,
          .beta = per_level * std::numbers::inv_sqrt3,
          .fall_real = fall.real(),
          .fall_imaginary = fall.imag(),
          .cosine = std::cos(w * dt),
          .sine = std::sin(w * dt)};
}

Vector<double, 4> InverterLoad::state_scale() const {
  const double horizon_s = 10 * parameters_.sampling_s;
  const double current = parameters_.dc_link_v / 2 / parameters_.inductance_h * horizon_s;
  const double turn = 2 * std::numbers::pi * std::abs(parameters_.emf_frequency_hz) * horizon_s;
  const double force = std::max(parameters_.emf_amplitude_v * turn, 1e-3 * parameters_.dc_link_v);
  return {current, current, force, force};
}

}  // namespace solenoid
