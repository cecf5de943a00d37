#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/plugins.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/plugin/python_rows.hpp"
#include "experiments/python/bindings.hpp"

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// What is made of a table keeps its text, as `toml`, for campaigns to be put together from it.
template <class Config>
py::object with_text(Config config, const std::string& toml) {
  py::object made = py::cast(std::move(config));
  made.attr("toml") = toml;
  return made;
}

py::object variant_from(const std::string& name, const std::string& toml) {
  TableReader table = TableReader::from_text(toml, "variant " + name);
  return with_text(read_variant(table, name), toml);
}

py::object scenario_from(const std::string& toml) {
  TableReader table = TableReader::from_text(toml, "scenario");
  return with_text(read_scenario(table), toml);
}

}  // namespace

void bind_configuration(py::module_& m) {
  py::class_<VariantConfig>(m, "Variant", py::dynamic_attr())
      .def_readonly("name", &VariantConfig::name)
      .def_readonly("summary", &VariantConfig::summary)
      .def_property_readonly("system", [](const VariantConfig& v) { return system_of(v).name(); })
      .def_readonly("modes", &VariantConfig::modes)
      .def_readonly("solver", &VariantConfig::solver)
      .def_readonly("estimator", &VariantConfig::estimator)
      .def_property_readonly("real_time", [](const VariantConfig& v) { return is_real_time(v); })
      .def_property_readonly("settings",
                             [](const VariantConfig& v) {
                               py::dict settings;
                               for (const VariantKey& key : system_of(v).keys())
                                 if (key.member.index() != 0) settings[py::str(key.path)] = key.value(v);
                               return settings;
                             })
      .def("__getattr__",
           [](const VariantConfig& v, const std::string& name) {
             if (name == system_of(v).description().modes_key) return VariantKey::Value(v.modes);
             const VariantKey* key = find_variant_key(system_of(v), name);
             if (!key || key->member.index() == 0) throw py::attribute_error("a variant has no '" + name + "'");
             return key->value(v);
           })
      .def("__repr__", [](const VariantConfig& v) {
        return fmt::format("<solenoid.Variant {}{}>", v.name, is_real_time(v) ? "" : ", not real time");
      });
  py::class_<ScenarioConfig>(m, "Scenario", py::dynamic_attr())
      .def_readonly("name", &ScenarioConfig::name)
      .def_property_readonly("system", [](const ScenarioConfig& s) { return system_of(s).name(); })
      .def_property_readonly("conditions",
                             [](const ScenarioConfig& s) {
                               py::dict conditions;
                               const std::vector<double> values = simulation_of(s).conditions(s);
                               for (std::size_t i = 0; i < values.size(); ++i)
                                 conditions[py::str(system_of(s).description().conditions[i].key)] = values[i];
                               return conditions;
                             })
      .def_readonly("duration_s", &ScenarioConfig::duration_s)
      .def(
          "reference",
          [](const ScenarioConfig& s, double time_s, std::size_t axis) {
            if (axis >= system_of(s).description().axes.size()) throw py::index_error("no such axis");
            const MotionSample r = s.trajectory.at(time_s).axis[axis];
            return py::make_tuple(r.value, r.rate, r.acceleration);
          },
          py::arg("time_s"), py::arg("axis") = 0)
      .def("__getattr__",
           [](const ScenarioConfig& s, const std::string& name) {
             const std::vector<Signal>& conditions = system_of(s).description().conditions;
             for (std::size_t i = 0; i < conditions.size(); ++i)
               if (conditions[i].key == name) return simulation_of(s).conditions(s)[i];
             throw py::attribute_error("a scenario of " + system_of(s).name() + " has no '" + name + "'");
           })
      .def("__repr__", [](const ScenarioConfig& s) { return fmt::format("<solenoid.Scenario {}>", s.name); });
  m.def("variant_from", &variant_from, py::arg("name"), py::arg("toml"));
  m.def("scenario_from", &scenario_from, py::arg("toml"));
  m.def(
      "resolve",
      [](const std::string& path, const std::vector<std::string>& variants, const std::vector<std::string>& scenarios) {
        return read_campaign(path, {variants, scenarios}).resolved_toml;
      },
      py::arg("path"), py::arg("variants"), py::arg("scenarios"));
  m.def("variants", [] {
    std::vector<std::string> names;
    for (const VariantConfig& v : shipped_variants()) names.push_back(v.name);
    return names;
  });
  m.def("campaigns", &shipped_campaigns);
  // A shipped campaign whose scenarios are of a variant's system; of a variant that is not shipped the first's.
  m.def(
      "home",
      [](const std::string& variant) -> std::string {
        for (const VariantConfig& v : shipped_variants())
          if (v.name == variant && v.system != systems().front()) return system_of(v).name();
        return "default";
      },
      py::arg("variant"));
  // The shipped campaign that has a system's usual scenarios.
  m.def(
      "campaign_of",
      [](const std::string& system) { return system == systems().front()->name() ? std::string("default") : system; },
      py::arg("system"));
  py::class_<LoadedPlugin>(m, "Plugin")
      .def_readonly("name", &LoadedPlugin::name)
      .def_readonly("path", &LoadedPlugin::path)
      .def("__repr__", [](const LoadedPlugin& p) { return fmt::format("<solenoid.Plugin {}>", p.name); });
  m.def("load_plugin", py::overload_cast<const std::string&>(&load_plugin), py::arg("path"));
  m.def("loaded_plugins", &loaded_plugins);
}

}  // namespace solenoid
