// The C++ half of the Python package: solenoid._core. The package itself (package/__init__.py) gives it its face.
#include "controllers/factory.hpp"
#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/build_info.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/run_campaign.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/report/comparison.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pybind11/numpy.h>
#include <pybind11/operators.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

namespace py = pybind11;

namespace solenoid {
namespace {

/// The ticks of a run; arrays look into them without copying and keep them alive.
struct Run {
  const SystemDescription* system;
  Metrics metrics;
  std::vector<TickRecord> ticks;
};

/// A measurement and a decision of a system, as a plant shows and a controller returns them.
struct SensorsOf {
  const SystemDescription* system = &systems().front()->description();
  Measurement measured{};
};
struct DecisionOf {
  const SystemDescription* system;
  Decision decision;
};
struct ControllerOf {
  const SystemDescription* system;
  std::unique_ptr<Controller> controller;
};
struct PlantOf {
  const SystemDescription* system;
  std::unique_ptr<SimulatedPlant> plant;
};

/// A field of every tick as a read-only array: shape (ticks,) or (ticks, width), one tick apart in memory.
template <class T>
py::array field(const py::object& run, const T* first, py::ssize_t width) {
  const Run& r = run.cast<const Run&>();
  const auto ticks = static_cast<py::ssize_t>(r.ticks.size());
  std::vector<py::ssize_t> shape = {ticks}, strides = {static_cast<py::ssize_t>(sizeof(TickRecord))};
  if (width > 1) shape.push_back(width), strides.push_back(sizeof(T));
  py::array array(py::dtype::of<T>(), shape, strides, first, run);
  array.attr("flags").attr("writeable") = false;
  return array;
}

/// `of(tick)` is the field, or the first of `width(system)` numbers side by side.
template <class Of, class Width>
auto view(Of of, Width width) {
  return [of, width](const py::object& run) {
    const Run& r = run.cast<const Run&>();
    static const TickRecord none{};
    return field(run, &of(r.ticks.empty() ? none : r.ticks.front()), static_cast<py::ssize_t>(width(*r.system)));
  };
}

/// Where a tick has a number that the system has a name for: channels as measured_KEY, references, the pattern of
/// switches, continuous inputs and beliefs by their keys in logs. Null for none.
const double* named(const SystemDescription& system, const std::string& name, const TickRecord& t) {
  for (std::size_t c = 0; c < system.channels.size(); ++c)
    if (name == "measured_" + system.channels[c].key) return &t.sensors.value[c];
  for (std::size_t a = 0; a < system.axes.size(); ++a) {
    if (name == system.reference_keys[a]) return &t.decision.reference.axis[a].value;
    if (name == system.reference_keys[system.axes.size() + a]) return &t.decision.reference.axis[a].rate;
  }
  for (std::size_t i = 0; i < system.continuous.size(); ++i)
    if (name == system.continuous[i].key || (name == "motor_force_n" && system.continuous[i].key == "motor_n"))
      return &t.applied.continuous[i];
  for (std::size_t i = 0; i < system.beliefs.size(); ++i)
    if (name == system.beliefs[i].key) return &t.decision.detail.belief[i];
  return nullptr;
}

/// The names above.
std::vector<std::string> names_of(const SystemDescription& system) {
  std::vector<std::string> names = system.reference_keys;
  for (const Signal& channel : system.channels) names.push_back("measured_" + channel.key);
  for (const Signal& input : system.continuous) names.push_back(input.key);
  for (const Signal& belief : system.beliefs) names.push_back(belief.key);
  names.push_back(system.switches_key);
  return names;
}

VariantConfig variant_from(const std::string& name, const std::string& toml) {
  TableReader table = TableReader::from_text(toml, "variant " + name);
  return read_variant(table, name);
}

ScenarioConfig scenario_from(const std::string& toml) {
  TableReader table = TableReader::from_text(toml, "scenario");
  return read_scenario(table);
}

Run simulate_run(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed) {
  RunResult result = simulate(variant, scenario, seed);
  return {&system_of(scenario).description(), result.metrics, std::move(result.ticks)};
}

/// What `solenoid compare --format json` prints; Ctrl-C there is Ctrl-C in Python.
std::string run_campaign_json(const std::string& path, const std::vector<std::string>& variants,
                              const std::vector<std::string>& scenarios, int jobs) {
  const Campaign campaign = read_campaign(path, {variants, scenarios});
  std::optional<std::vector<RunRecord>> records;
  {
    const py::gil_scoped_release released;
    records = run_in_processes(campaign, jobs);
  }
  if (!records) {
    PyErr_SetNone(PyExc_KeyboardInterrupt);
    throw py::error_already_set();
  }
  return result_of(*records, false).json();
}

/// The first of a record's values, as many as the system has.
template <class Values>
std::vector<double> shortened(const Values& values, std::size_t size) {
  return {values.begin(), values.begin() + static_cast<std::ptrdiff_t>(size)};
}
/// Values into a record.
template <class Values>
void assign(const std::vector<double>& from, Values& values) {
  if (from.size() > values.size()) throw py::value_error(fmt::format("at most {} values", values.size()));
  std::ranges::copy(from, values.begin());
}

void bind_configuration(py::module_& m) {
  py::class_<VariantConfig>(m, "Variant")
      .def_readonly("name", &VariantConfig::name)
      .def_readonly("summary", &VariantConfig::summary)
      .def_property_readonly("system", [](const VariantConfig& v) { return system_of(v).name(); })
      .def_readonly("modes", &VariantConfig::modes)
      .def_readonly("solver", &VariantConfig::solver)
      .def_readonly("estimator", &VariantConfig::estimator)
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
      .def("__repr__", [](const VariantConfig& v) { return fmt::format("<solenoid.Variant {}>", v.name); });
  py::class_<ScenarioConfig>(m, "Scenario")
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
}

void bind_metrics(py::module_& m) {
  py::class_<Percentiles>(m, "Percentiles")
      .def_readonly("p50", &Percentiles::p50)
      .def_readonly("p90", &Percentiles::p90)
      .def_readonly("p99", &Percentiles::p99)
      .def_readonly("p999", &Percentiles::p999)
      .def_readonly("max", &Percentiles::max);
  py::class_<Metrics>(m, "Metrics")
      .def("__getattr__",
           [](const Metrics& metrics, const std::string& name) -> py::object {
             if (!metrics.has(name)) throw py::attribute_error("no metric '" + name + "'");
             const double value = metrics.number(name);
             for (const System* system : systems())
               for (const MetricColumn& column : system->description().metrics)
                 if (column.key == name && column.whole) return py::int_(static_cast<std::int64_t>(value));
             return py::float_(value);
           })
      .def("__dir__",
           [](const py::object& self) {
             py::list names = py::module_::import("builtins").attr("object").attr("__dir__")(self);
             for (const Metrics::Number& number : self.cast<const Metrics&>().numbers()) names.append(number.name);
             return names;
           })
      .def_readonly("solve_us", &Metrics::solve_us)
      .def_readonly("deadline_misses", &Metrics::deadline_misses)
      .def_readonly("proven_optimal_fraction", &Metrics::proven_optimal_fraction)
      .def_readonly("finite", &Metrics::finite);
}

void bind_run(py::module_& m) {
  const auto one = [](const SystemDescription&) { return std::size_t{1}; };
  const auto number = [one](auto of) { return view(of, one); };
  const auto states = [](const SystemDescription& s) { return s.states.size(); };
  const auto inputs = [](const SystemDescription& s) { return std::max<std::size_t>(1, s.continuous.size()); };
  py::class_<Run>(m, "Run")
      .def_property_readonly("system", [](const Run& r) { return r.system->name; })
      .def_readonly("metrics", &Run::metrics)
      .def("__len__", [](const Run& r) { return r.ticks.size(); })
      .def_property_readonly("time_s", number([](const TickRecord& t) -> auto& { return t.sensors.time_s; }))
      .def_property_readonly("truth", view(
                                          [](const TickRecord& t) -> auto& { return t.sensors.truth[0]; }, states))
      .def_property_readonly("estimate",
                             view(
                                 [](const TickRecord& t) -> auto& { return t.decision.estimate[0]; }, states))
      .def_property_readonly("switches", number([](const TickRecord& t) -> auto& { return t.applied.switches; }))
      .def_property_readonly("continuous",
                             view(
                                 [](const TickRecord& t) -> auto& { return t.applied.continuous[0]; }, inputs))
      .def("__getattr__",
           [](const py::object& self, const std::string& name) -> py::object {
             const Run& r = self.cast<const Run&>();
             static const TickRecord none{};
             const TickRecord& first = r.ticks.empty() ? none : r.ticks.front();
             if (name == r.system->switches_key) return field(self, &first.applied.switches, 1);
             if (const double* at = named(*r.system, name, first)) return field(self, at, 1);
             throw py::attribute_error(fmt::format("a run of {} has no '{}' (it has {})", r.system->name, name,
                                                   fmt::join(names_of(*r.system), ", ")));
           })
      .def("__dir__",
           [](const py::object& self) {
             py::list names = py::module_::import("builtins").attr("object").attr("__dir__")(self);
             for (const std::string& name : names_of(*self.cast<const Run&>().system)) names.append(name);
             return names;
           })
      .def_property_readonly("solved", number([](const TickRecord& t) -> auto& { return t.decision.solved; }))
      .def_property_readonly("cost", number([](const TickRecord& t) -> auto& { return t.decision.report.cost; }))
      .def_property_readonly("solve_us", number([](const TickRecord& t) -> auto& { return t.decision.report.time_us; }))
      .def_property_readonly("nodes", number([](const TickRecord& t) -> auto& { return t.decision.report.nodes; }));
  m.def("simulate", &simulate_run, py::arg("variant"), py::arg("scenario"), py::arg("seed") = 1,
        py::call_guard<py::gil_scoped_release>());
}

/// A controller and a plant that Python steps itself: the loop of `simulate`, one tick at a time.
void bind_stepping(py::module_& m) {
  // A number of a record as an attribute.
  const auto attribute = [](auto& type, const char* name, auto at) {
    using T = typename std::remove_reference_t<decltype(type)>::type;
    type.def_property(
        name, [at](T& record) { return at(record); }, [at](T& record, double value) { at(record) = value; });
  };
  py::class_<SensorsOf> sensors(m, "Sensors");
  sensors.def(py::init<>())
      .def_property(
          "time_s", [](const SensorsOf& s) { return s.measured.time_s; },
          [](SensorsOf& s, double time_s) { s.measured.time_s = time_s; })
      .def_property(
          "ideal", [](const SensorsOf& s) { return s.measured.ideal; },
          [](SensorsOf& s, bool ideal) { s.measured.ideal = ideal; })
      .def_property(
          "truth", [](const SensorsOf& s) { return shortened(s.measured.truth, s.system->states.size()); },
          [](SensorsOf& s, const std::vector<double>& truth) { assign(truth, s.measured.truth); })
      .def_property(
          "value", [](const SensorsOf& s) { return shortened(s.measured.value, s.system->channels.size()); },
          [](SensorsOf& s, const std::vector<double>& value) { assign(value, s.measured.value); })
      .def("__getattr__",
           [](const SensorsOf& s, const std::string& name) {
             for (std::size_t c = 0; c < s.system->channels.size(); ++c)
               if (name == s.system->channels[c].key) return s.measured.value[c];
             throw py::attribute_error("no channel '" + name + "'");
           })
      .def("__setattr__", [](const py::object& self, const std::string& name, const py::object& value) {
        SensorsOf& s = self.cast<SensorsOf&>();
        for (std::size_t c = 0; c < s.system->channels.size(); ++c)
          if (name == s.system->channels[c].key) {
            s.measured.value[c] = value.cast<double>();
            return;
          }
        py::module_::import("builtins").attr("object").attr("__setattr__")(self, name, value);
      });
  py::class_<Command> command(m, "Command");
  attribute(command, "motor_force_n", [](Command& c) -> double& { return c.continuous[0]; });
  command
      .def(py::init([](SwitchPattern coils, double motor_n) {
             return Command{coils, {motor_n}};
           }),
           py::arg("coils") = 0, py::arg("motor_force_n") = 0.0)
      .def_readwrite("coils", &Command::switches)
      .def_readwrite("switches", &Command::switches)
      .def_readwrite("continuous", &Command::continuous)
      .def(py::self == py::self);
  py::class_<DecisionOf>(m, "Decision")
      .def_property_readonly("command", [](const DecisionOf& d) { return d.decision.command; })
      .def_property_readonly(
          "estimate", [](const DecisionOf& d) { return shortened(d.decision.estimate, d.system->states.size()); })
      .def_property_readonly("solved", [](const DecisionOf& d) { return d.decision.solved; })
      .def_property_readonly("cost", [](const DecisionOf& d) { return d.decision.report.cost; })
      .def_property_readonly("solve_us", [](const DecisionOf& d) { return d.decision.report.time_us; })
      .def("__getattr__", [](const DecisionOf& d, const std::string& name) {
        for (std::size_t a = 0; a < d.system->axes.size(); ++a)
          if (name == d.system->reference_keys[a]) return d.decision.reference.axis[a].value;
        for (std::size_t i = 0; i < d.system->beliefs.size(); ++i)
          if (name == d.system->beliefs[i].key) return d.decision.detail.belief[i];
        throw py::attribute_error("a decision has no '" + name + "'");
      });
  py::class_<ControllerOf>(m, "Controller")
      .def(py::init([](const VariantConfig& variant, const ScenarioConfig& scenario) {
             return ControllerOf{&system_of(scenario).description(),
                                 make_controller(told(variant, scenario), scenario.trajectory)};
           }),
           py::arg("variant"), py::arg("scenario"))
      .def(
          "step",
          [](ControllerOf& c, const SensorsOf& s) {
            return DecisionOf{c.system, c.controller->step(s.measured)};
          },
          py::arg("sensors"))
      .def(
          "applied", [](ControllerOf& c, const Command& applied) { c.controller->applied(applied); },
          py::arg("command"));
  py::class_<PlantOf>(m, "Plant")
      .def(py::init([](const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed) {
             return PlantOf{&system_of(scenario).description(), make_plant(variant, scenario, seed)};
           }),
           py::arg("variant"), py::arg("scenario"), py::arg("seed") = 1)
      .def(
          "read",
          [](PlantOf& p, double time_s) {
            return SensorsOf{p.system, p.plant->read(time_s)};
          },
          py::arg("time_s"))
      .def(
          "write", [](PlantOf& p, const Command& c) { p.plant->write(c); }, py::arg("command"))
      .def_property_readonly("consumed", [](const PlantOf& p) { return p.plant->consumed(); })
      .def("__getattr__", [](const PlantOf& p, const std::string& name) {
        const Signal& drawn = p.system->consumption;
        if (!drawn.name.empty() && name == fmt::format("{}_used_{}", drawn.name, drawn.unit))
          return p.plant->consumed();
        throw py::attribute_error("a plant has no '" + name + "'");
      });
}

}  // namespace

PYBIND11_MODULE(_core, m) {
  m.attr("__version__") = build_info().version;
  py::register_exception<ConfigError>(m, "ConfigError", PyExc_ValueError);
  bind_configuration(m);
  bind_metrics(m);
  bind_run(m);
  bind_stepping(m);
  m.def("run_campaign", &run_campaign_json, py::arg("path"), py::arg("variants"), py::arg("scenarios"),
        py::arg("jobs"));
}

}  // namespace solenoid
