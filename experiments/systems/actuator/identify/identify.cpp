#include "experiments/systems/actuator/identify/identify.hpp"

#include "core/config/reader.hpp"
#include "experiments/systems/actuator/identify/chambers.hpp"
#include "experiments/systems/actuator/identify/friction.hpp"
#include "experiments/systems/actuator/identify/noise.hpp"
#include "experiments/systems/actuator/identify/slide.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr std::array known = {"rest",   "breakaway", "speeds",  "inertia", "inertia_loaded",
                              "charge", "edges",     "shuttle", "gravity"};

class Identification {
 public:
  Identification(const std::vector<Record>& records, const ActuatorParameters& given)
      : records_(records), given_(given) {}

  Findings run() {
    if (const Record* r = named("rest")) found_.add(estimate_noise(*r));
    valves();
    masses();
    friction();
    gravity();
    return std::move(found_);
  }

 private:
  /// The record of this name, the longest part of it where a log has gaps.
  const Record* named(const std::string& name) const {
    const Record* longest = nullptr;
    for (const Record& r : records_)
      if (r.name == name && (!longest || r.size() > longest->size())) longest = &r;
    return longest;
  }
  /// Records with one of these names, or, if there are none, those with names of their own.
  std::vector<const Record*> of(std::initializer_list<const char*> names) const {
    std::vector<const Record*> some;
    for (const char* name : names)
      for (const Record& r : records_)
        if (r.name == name) some.push_back(&r);
    if (!some.empty()) return some;
    for (const Record& r : records_)
      if (std::ranges::find(known, r.name) == known.end() && r.payload_kg == 0) some.push_back(&r);
    return some;
  }
  double value_or(const char* name, double fallback) const {
    const Estimate* e = found_.find(name);
    return e ? e->value : fallback;
  }
  double filter_delay_s() const { return value_or("pressure_filter_delay_s", ChamberParameters{}.filter_delay_s); }

  void valves() {
    const double noise_pa = std::max(value_or("pressure_a_noise_pa", 0.0), value_or("pressure_b_noise_pa", 0.0));
    found_.add(estimate_chambers(of({"charge", "edges", "shuttle"}), given_, noise_pa));
  }

  /// Adds an estimate of the slide's fit under the name of a parameter.
  void adopt(const Findings& from, const char* name, const char* as, double factor = 1.0, const char* unit = nullptr) {
    const Estimate* e = from.find(name);
    if (!e) return;
    Estimate mine =
        make_estimate(as, unit ? unit : e->unit, factor * e->value, factor * e->sigma, e->freedom, e->method);
    mine.parameter = true;
    found_.estimates.push_back(mine);
  }
  void keep_rest(const Findings& from) { found_.add({{}, from.plots, from.remarks}); }

  void masses() {
    const std::vector<const Record*> unloaded = of({"inertia"});
    if (unloaded.empty()) return;
    const Findings slide = estimate_slide(unloaded, given_, filter_delay_s(), {});
    keep_rest(slide);
    adopt(slide, "equivalent_mass_kg", "inferred_equivalent_mass_kg");
    if (!named("speeds")) {  // a log has nothing better to say about friction
      adopt(slide, "coulomb_friction_n", "coulomb_friction_n");
      adopt(slide, "viscous_friction", "viscous_friction");
    }
    if (!named("gravity")) adopt_gravity(slide);
    const Record* loaded = named("inertia_loaded");
    if (!loaded || !slide.find("equivalent_mass_kg")) return;
    const Findings with = estimate_slide({loaded}, given_, filter_delay_s(), {}, "_loaded");
    keep_rest(with);
    if (const Estimate* mass = with.find("equivalent_mass_kg_loaded"))
      found_.estimates.push_back(payload_from(*slide.find("equivalent_mass_kg"), *mass, given_));
  }

  void friction() {
    if (const Record* r = named("speeds")) {
      const double mass = value_or("inferred_equivalent_mass_kg", given_.equivalent_mass_kg());
      found_.add(estimate_constant_speeds(*r, given_, mass, filter_delay_s()));
    }
    if (const Record* r = named("breakaway")) found_.add(estimate_breakaway(*r, given_));
  }

  void gravity() {
    const Record* r = named("gravity");
    if (!r) return;
    SlideModel model{false, false, false, value_or("inferred_equivalent_mass_kg", given_.equivalent_mass_kg()),
                     value_or("viscous_friction", given_.viscous_friction)};
    const Findings slide = estimate_slide({r}, given_, filter_delay_s(), model, "_sweep");
    keep_rest(slide);
    adopt_gravity(slide, "_sweep");
  }
  void adopt_gravity(const Findings& slide, const std::string& suffix = "") {
    adopt(slide, ("weight_n" + suffix).c_str(), "block_mass_kg", 1 / given_.gravity, "kg");
    adopt(slide, ("arm_torque_nm" + suffix).c_str(), "inferred_arm_torque_nm");
  }

  const std::vector<Record>& records_;
  ActuatorParameters given_;
  Findings found_;
};

/// Sets the field of this key. The one list of what identification can set.
bool set_parameter(ActuatorParameters& p, const std::string& key, double value) {
  struct Field {
    const char* key;
    double ActuatorParameters::*field;
  };
  using P = ActuatorParameters;
  static constexpr Field fields[] = {
      {"static_friction_n", &P::static_friction_n},         {"coulomb_friction_n", &P::coulomb_friction_n},
      {"viscous_friction", &P::viscous_friction},           {"fill_coefficient", &P::fill_coefficient},
      {"discharge_coefficient", &P::discharge_coefficient}, {"choked_flow", &P::choked_flow},
      {"supply_pressure_pa", &P::supply_pressure_pa},       {"energise_delay_s", &P::energise_delay_s},
      {"deenergise_delay_s", &P::deenergise_delay_s},       {"block_mass_kg", &P::block_mass_kg}};
  for (const Field& f : fields)
    if (key == f.key) return p.*f.field = value, true;
  if (key == "inferred_equivalent_mass_kg") return p.inferred_equivalent_mass_kg = value, true;
  if (key == "inferred_arm_torque_nm") return p.inferred_arm_torque_nm = value, true;
  return false;
}

/// Why the model would not take this value; empty if it does.
std::string refusal(const ActuatorParameters& so_far, const Estimate& e) {
  ActuatorParameters tried = so_far;
  if (!std::isfinite(e.value)) return "not a number";
  if (e.contains(0)) return "not told from 0";
  if (!set_parameter(tried, e.name, e.value)) return "no parameter";
  if (e.name == "inferred_arm_torque_nm" && !(e.value >= 0)) return "negative";
  try {
    tried.validate("identified");
  } catch (const ConfigError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

Findings identify(const std::vector<Record>& records, const ActuatorParameters& given) {
  return Identification(records, given).run();
}

ActuatorParameters identified_parameters(const Findings& found, ActuatorParameters given) {
  for (const Estimate& e : found.estimates)
    if (e.parameter && refusal(given, e).empty()) set_parameter(given, e.name, e.value);
  return given;
}

std::string parameter_file(const Findings& found, const std::string& base, const std::string& source) {
  ActuatorParameters so_far = named_parameters(base);
  std::string text = fmt::format(
      "# Identified by `solenoid identify` from {}. With 95 % intervals.\n"
      "# A variant takes it as model = \"THIS FILE\"; `solenoid compare --model THIS FILE` gives it to all.\n"
      "base = \"{}\"\n",
      source, base);
  for (const Estimate& e : found.estimates) {
    const std::string line = fmt::format("{} = {:.6g}  # {:.6g} to {:.6g} {}", e.name, e.value, e.low, e.high, e.unit);
    const std::string why = e.parameter ? refusal(so_far, e) : "";
    if (e.parameter && why.empty()) {
      set_parameter(so_far, e.name, e.value);
      text += line + "\n";
    } else {
      text += "# " + line + (why.empty() ? "" : "; left out: " + why) + "\n";
    }
  }
  return text;
}

}  // namespace solenoid
