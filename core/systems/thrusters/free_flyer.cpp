#include "core/systems/thrusters/free_flyer.hpp"

#include "core/config/reader.hpp"

#include <vector>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// A number of the parameters: name, field, allowed range.
struct FreeFlyerField {
  const char* name;
  double FreeFlyerParameters::*value;
  Range range;
};

const std::vector<FreeFlyerField>& free_flyer_fields() {
  using P = FreeFlyerParameters;
  static const Range positive{0.0, 1e9, true}, time{0.0, 10.0}, any{-1e9, 1e9};
  static const std::vector<FreeFlyerField> fields = {
      {"mass_kg", &P::mass_kg, positive},
      {"inertia_kg_m2", &P::inertia_kg_m2, positive},
      {"thrust_n", &P::thrust_n, positive},
      {"lever_m", &P::lever_m, positive},
      {"flow_kg_per_s", &P::flow_kg_per_s, {0.0, 1e9}},
      {"least_on_s", &P::least_on_s, time},
      {"least_off_s", &P::least_off_s, time},
      {"rise_delay_s", &P::rise_delay_s, time},
      {"fall_delay_s", &P::fall_delay_s, time},
      {"external_force_x_n", &P::external_force_x_n, any},
      {"external_force_y_n", &P::external_force_y_n, any},
      {"external_torque_nm", &P::external_torque_nm, any},
  };
  return fields;
}

}  // namespace

void FreeFlyerParameters::validate(const std::string& where) const {
  for (const FreeFlyerField& field : free_flyer_fields())
    if (!field.range.contains(this->*field.value))
      throw ConfigError(
          fmt::format("{}: {} = {} (allowed: {})", where, field.name, this->*field.value, field.range.text()));
}

FreeFlyerParameters read_free_flyer(TableReader& table) {
  FreeFlyerParameters p;
  for (const FreeFlyerField& field : free_flyer_fields())
    p.*field.value = table.number_or(field.name, p.*field.value, field.range);
  table.finish();
  return p;
}

FreeFlyer::FreeFlyer(const FreeFlyerParameters& parameters)
    : parameters_((parameters.validate("free-flyer"), parameters)),
      per_thruster_(parameters.thrust_n / parameters.mass_kg),
      turn_per_thruster_(parameters.thrust_n * parameters.lever_m / parameters.inertia_kg_m2),
      external_x_(parameters.external_force_x_n / parameters.mass_kg),
      external_y_(parameters.external_force_y_n / parameters.mass_kg),
      external_turn_(parameters.external_torque_nm / parameters.inertia_kg_m2) {}

}  // namespace solenoid
