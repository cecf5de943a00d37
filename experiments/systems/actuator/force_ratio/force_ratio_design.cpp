#include "experiments/systems/actuator/force_ratio/force_ratio_design.hpp"

#include "core/config/reader.hpp"
#include "core/systems/actuator/parameters.hpp"
#include "experiments/base/embedded.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double least_inertia = 1e-6;  // [kg m2]: the truth plant takes no lighter rotor

struct Field {
  const char *section, *key;
  double RatioAssumptions::*value;
  Range range;
};

const std::vector<Field>& fields() {
  using A = RatioAssumptions;
  const Range positive = Range::positive(), any = Range::non_negative(), exponent = Range::between(0.0, 4.0);
  static const std::vector<Field> all = {
      {"capability", "reserve", &A::reserve, positive},
      {"capability", "safety_factor", &A::safety_factor, positive},
      {"effort", "switches_per_s", &A::limit_switches_per_s, positive},
      {"effort", "air_g", &A::limit_air_g, positive},
      {"cylinder", "bore_mm", &A::cylinder_bore_mm, positive},
      {"cylinder", "mass_kg", &A::cylinder_mass_kg, any},
      {"cylinder", "mass_exponent", &A::cylinder_mass_exponent, exponent},
      {"cylinder", "price", &A::cylinder_price, any},
      {"cylinder", "price_exponent", &A::cylinder_price_exponent, exponent},
      {"air_side", "mass_kg", &A::air_mass_kg, any},
      {"air_side", "price", &A::air_price, any},
      {"air_side", "compressor_efficiency", &A::compressor_efficiency, {0.0, 1.0, true}},
      {"motor", "torque_nm", &A::motor_torque_nm, positive},
      {"motor", "mass_kg", &A::motor_mass_kg, positive},
      {"motor", "mass_exponent", &A::motor_mass_exponent, exponent},
      {"motor", "price", &A::motor_price, any},
      {"motor", "price_exponent", &A::motor_price_exponent, exponent},
      {"motor", "constant", &A::motor_constant, positive},
      {"motor", "inertia_kg_m2", &A::motor_inertia, {1e-6, 1e-4}},
      {"amplifier", "mass_kg", &A::amplifier_mass_kg, any},
      {"amplifier", "mass_exponent", &A::amplifier_mass_exponent, exponent},
      {"amplifier", "price", &A::amplifier_price, any},
      {"amplifier", "price_exponent", &A::amplifier_price_exponent, exponent},
      {"weights", "error", &A::weight_error, any},
      {"weights", "energy", &A::weight_energy, any},
      {"weights", "mass", &A::weight_mass, any},
      {"weights", "price", &A::weight_price, any},
  };
  return all;
}

const Field* field_of(const std::string& key) {
  const auto found =
      std::ranges::find_if(fields(), [&](const Field& f) { return key == fmt::format("{}.{}", f.section, f.key); });
  return found == fields().end() ? nullptr : &*found;
}

void read_changes(TableReader& table, RatioAssumptions& a) {
  if (!table.has("sensitivity")) return;
  a.changes.clear();
  for (TableReader& t : table.tables("sensitivity")) {
    RatioChange change{t.text("name"), t.text("key"), t.number("factor", Range::non_negative())};
    if (!field_of(change.key))
      t.fail("key", fmt::format("'{}' is no assumption (allowed: SECTION.KEY of this file)", change.key));
    t.finish();
    a.changes.push_back(std::move(change));
  }
}

/// `a`: what is true of keys that the table leaves out.
RatioAssumptions read(TableReader& table, RatioAssumptions a, bool complete) {
  std::map<std::string, TableReader> sections;
  for (const Field& f : fields()) {
    if (!complete && !table.has(f.section)) continue;
    auto [entry, added] = sections.try_emplace(f.section, table.table(f.section));
    a.*f.value = complete ? entry->second.number(f.key, f.range) : entry->second.number_or(f.key, a.*f.value, f.range);
  }
  if (const auto section = sections.find("capability");
      section != sections.end() && section->second.has("modules_mm")) {
    TableReader& t = section->second;
    a.modules_m = t.numbers("modules_mm", Range::positive());
    if (a.modules_m.empty() || !std::ranges::is_sorted(a.modules_m))
      t.fail("modules_mm", "not in order (allowed: at least one module, rising)");
    for (double& module : a.modules_m) module *= 1e-3;
  }
  for (auto& [name, section] : sections) section.finish();
  read_changes(table, a);
  table.finish();
  return a;
}

/// Isothermal work of compressing a gram from the atmosphere to supply, over the compressor's efficiency [J/g].
double air_work(const SizingTask& task, double efficiency) {
  const ActuatorParameters p;
  const double ratio = 1 + task.supply_gauge_pa / p.atmospheric_pressure_pa;
  return 1e-3 * p.gas_constant * p.temperature_k * std::log(ratio) / efficiency;
}

void size_pinion(const SizingTask& task, const RatioAssumptions& a, RatioDesign& d) {
  const double speed = largest_speed(task.motion) * task.gear_diameter_m() / 2;
  for (const double module : a.modules_m) {
    const double stress =
        tooth_stress(barth_factor(speed), d.motor_n, task.face_width_m, module, lewis_form_factor(task.pinion_teeth));
    d.module_m = module;
    d.pinion_m = task.pinion_teeth * module;
    d.pinion_safety = task.tooth_strength_pa / stress;
    if (d.pinion_safety >= a.safety_factor) return;
  }
  throw ConfigError(fmt::format(
      "capability.modules_mm: no pinion bears {:.4g} N (allowed: a larger module, or a smaller safety_factor)",
      d.motor_n));
}

void size_motor(const RatioAssumptions& a, RatioDesign& d) {
  d.motor_torque_nm = d.motor_n * d.pinion_m / 2;
  const double torque = d.motor_torque_nm / a.motor_torque_nm, mass = std::pow(torque, a.motor_mass_exponent);
  d.motor_constant = a.motor_constant * std::pow(mass, 5.0 / 6);
  d.motor_inertia = std::max(least_inertia, a.motor_inertia * std::pow(mass, 5.0 / 3));
  d.mass_kg += a.motor_mass_kg * mass + a.amplifier_mass_kg * std::pow(torque, a.amplifier_mass_exponent);
  d.price += a.motor_price * std::pow(torque, a.motor_price_exponent) +
             a.amplifier_price * std::pow(torque, a.amplifier_price_exponent);
}

}  // namespace

RatioAssumptions RatioAssumptions::with(const RatioChange& change) const {
  const Field* field = field_of(change.key);
  if (!field) throw std::invalid_argument(change.key + " is no assumption");
  RatioAssumptions changed = *this;
  changed.*field->value *= change.factor;
  return changed;
}

const RatioAssumptions& shipped_ratio_assumptions() {
  static const RatioAssumptions shipped = [] {
    const char* name = "tasks/force_ratio.toml";
    TableReader table = TableReader::from_text(std::string(embedded_text(name)), name);
    return read(table, {}, true);
  }();
  return shipped;
}

RatioAssumptions read_ratio_assumptions(const std::string& path) {
  TableReader table = TableReader::from_file(path);
  return read(table, shipped_ratio_assumptions(), false);
}

RatioDesign design_ratio(double share, const SizingTask& task, const RatioAssumptions& a) {
  const double capability = a.reserve * std::abs(size_actuator(task).cylinder_n);
  RatioDesign d;
  d.share = share;
  d.cylinder_n = (1 - share) * capability;
  d.motor_n = share * capability;
  if (d.has_cylinder()) {
    d.bore_m = bore_for_force(d.cylinder_n, task.supply_gauge_pa);
    const double size = 1e3 * d.bore_m / a.cylinder_bore_mm;
    d.mass_kg += a.air_mass_kg + a.cylinder_mass_kg * std::pow(size, a.cylinder_mass_exponent);
    d.price += a.air_price + a.cylinder_price * std::pow(size, a.cylinder_price_exponent);
  }
  if (d.has_motor()) {
    size_pinion(task, a, d);
    size_motor(a, d);
  }
  return d;
}

RatioCriteria criteria_of(const RatioDesign& design, const RatioMeasured& measured, const SizingTask& task,
                          const RatioAssumptions& a) {
  RatioCriteria c;
  c.error_mm = measured.rmse_mm;
  c.mass_kg = design.mass_kg;
  c.price = design.price;
  c.air_j = measured.air_g * air_work(task, a.compressor_efficiency);
  if (design.has_motor()) {
    const double watts_per_square = std::pow(design.pinion_m / 2 / design.motor_constant, 2);
    c.electric_j = measured.force_square_ns * watts_per_square + measured.motoring_j;
  }
  c.score = a.weight_error * std::log(c.error_mm) + a.weight_energy * std::log(c.energy_j()) +
            a.weight_mass * std::log(c.mass_kg) + a.weight_price * std::log(c.price);
  return c;
}

int recommended(std::span<const RatioCriteria> criteria, std::span<const RatioMeasured> measured) {
  int best = -1;
  for (std::size_t i = 0; i < criteria.size(); ++i) {
    if (measured[i].bad > 0 || !std::isfinite(criteria[i].score)) continue;
    if (best < 0 || criteria[i].score < criteria[static_cast<std::size_t>(best)].score) best = static_cast<int>(i);
  }
  return best;
}

std::vector<bool> efficient(std::span<const RatioCriteria> criteria) {
  const auto values = [](const RatioCriteria& c) { return std::array{c.error_mm, c.energy_j(), c.mass_kg, c.price}; };
  const auto dominates = [&](const RatioCriteria& a, const RatioCriteria& b) {
    const auto x = values(a), y = values(b);
    bool better = false;
    for (std::size_t i = 0; i < x.size(); ++i) {
      if (x[i] > y[i]) return false;
      better = better || x[i] < y[i];
    }
    return better;
  };
  std::vector<bool> front;
  for (const RatioCriteria& c : criteria)
    front.push_back(std::ranges::none_of(criteria, [&](const RatioCriteria& other) { return dominates(other, c); }));
  return front;
}

}  // namespace solenoid
