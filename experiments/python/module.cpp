// The C++ half of the Python package: solenoid._core. The package itself (package/__init__.py) gives it its face.
#include "controllers/factory.hpp"
#include "controllers/systems.hpp"
#include "controllers/variant_keys.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/base/build_info.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/run_campaign.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/report/comparison.hpp"

#include <algorithm>
#include <optional>

#include <fmt/format.h>
#include <pybind11/numpy.h>
#include <pybind11/operators.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

namespace py = pybind11;

namespace solenoid {
namespace {

/// The ticks of a run; arrays look into them without copying and keep them alive.
struct Run {
  Metrics metrics;
  std::vector<TickRecord> ticks;
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

/// `of(tick)` is the field, or the first of `width` numbers side by side.
template <class Of>
auto view(Of of, py::ssize_t width = 1) {
  return [of, width](const py::object& run) {
    const Run& r = run.cast<const Run&>();
    static const TickRecord none{};
    return field(run, &of(r.ticks.empty() ? none : r.ticks.front()), width);
  };
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
  return {result.metrics, std::move(result.ticks)};
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

void bind_configuration(py::module_& m) {
  py::class_<VariantConfig>(m, "Variant")
      .def_readonly("name", &VariantConfig::name)
      .def_readonly("summary", &VariantConfig::summary)
      .def_readonly("valves", &VariantConfig::valves)
      .def_readonly("solver", &VariantConfig::solver)
      .def_readonly("motor", &VariantConfig::motor)
      .def_readonly("estimator", &VariantConfig::estimator)
      .def_property_readonly("settings",
                             [](const VariantConfig& v) {
                               py::dict settings;
                               for (const VariantKey& key : variant_keys())
                                 if (key.member.index() != 0) settings[py::str(key.path)] = key.value(v);
                               return settings;
                             })
      .def("__repr__", [](const VariantConfig& v) { return fmt::format("<solenoid.Variant {}>", v.name); });
  py::class_<ScenarioConfig>(m, "Scenario")
      .def_readonly("name", &ScenarioConfig::name)
      .def_readonly("plant", &ScenarioConfig::plant)
      .def_readonly("payload_kg", &ScenarioConfig::payload_kg)
      .def_readonly("duration_s", &ScenarioConfig::duration_s)
      .def(
          "reference",
          [](const ScenarioConfig& s, double time_s) {
            const MotionSample r = s.trajectory.at(time_s).axis[0];
            return py::make_tuple(r.value, r.rate, r.acceleration);
          },
          py::arg("time_s"))
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
             const auto& columns = systems().front()->metrics;
             const auto column = std::ranges::find(columns, name, &MetricColumn::key);
             if (column != columns.end() && column->whole) return py::int_(static_cast<std::int64_t>(value));
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
  const auto number = [](auto of) { return view(of); };
  py::class_<Run>(m, "Run")
      .def_readonly("metrics", &Run::metrics)
      .def("__len__", [](const Run& r) { return r.ticks.size(); })
      .def_property_readonly("time_s", number([](const TickRecord& t) -> auto& { return t.sensors.time_s; }))
      .def_property_readonly("truth", view(
                                          [](const TickRecord& t) -> auto& { return t.sensors.truth[0]; }, 4))
      .def_property_readonly("estimate", view(
                                             [](const TickRecord& t) -> auto& { return t.decision.estimate[0]; }, 4))
      .def_property_readonly("measured_position_m",
                             number([](const TickRecord& t) -> auto& { return t.sensors.value[position_channel]; }))
      .def_property_readonly("measured_pressure_a_pa",
                             number([](const TickRecord& t) -> auto& { return t.sensors.value[pressure_a_channel]; }))
      .def_property_readonly("measured_pressure_b_pa",
                             number([](const TickRecord& t) -> auto& { return t.sensors.value[pressure_b_channel]; }))
      .def_property_readonly("reference_m",
                             number([](const TickRecord& t) -> auto& { return t.decision.reference.axis[0].value; }))
      .def_property_readonly("reference_m_s",
                             number([](const TickRecord& t) -> auto& { return t.decision.reference.axis[0].rate; }))
      .def_property_readonly("coils", number([](const TickRecord& t) -> auto& { return t.applied.switches; }))
      .def_property_readonly("motor_force_n",
                             number([](const TickRecord& t) -> auto& { return t.applied.continuous[0]; }))
      .def_property_readonly(
          "payload_kg", number([](const TickRecord& t) -> auto& { return t.decision.detail.belief[payload_belief]; }))
      .def_property_readonly("disturbance_n", number([](const TickRecord& t) -> auto& {
                               return t.decision.detail.belief[disturbance_belief];
                             }))
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
  py::class_<Measurement> sensors(m, "Sensors");
  sensors.def(py::init<>())
      .def_readwrite("time_s", &Measurement::time_s)
      .def_property(
          "truth", [](const Measurement& s) { return actuator_state(s.truth); },
          [](Measurement& s, const ActuatorState& truth) { s.truth = padded<max_states>(truth); })
      .def_readwrite("ideal", &Measurement::ideal);
  attribute(sensors, "position_m", [](Measurement& s) -> double& { return s.value[position_channel]; });
  attribute(sensors, "pressure_a_pa", [](Measurement& s) -> double& { return s.value[pressure_a_channel]; });
  attribute(sensors, "pressure_b_pa", [](Measurement& s) -> double& { return s.value[pressure_b_channel]; });
  py::class_<Command> command(m, "Command");
  attribute(command, "motor_force_n", [](Command& c) -> double& { return c.continuous[0]; });
  command
      .def(py::init([](SwitchPattern coils, double motor_n) { return actuator_command(coils, motor_n); }),
           py::arg("coils") = 0, py::arg("motor_force_n") = 0.0)
      .def_readwrite("coils", &Command::switches)
      .def(py::self == py::self);
  py::class_<Decision>(m, "Decision")
      .def_readonly("command", &Decision::command)
      .def_property_readonly("estimate", [](const Decision& d) { return actuator_state(d.estimate); })
      .def_property_readonly("reference_m", [](const Decision& d) { return d.reference.axis[0].value; })
      .def_property_readonly("payload_kg", [](const Decision& d) { return d.detail.belief[payload_belief]; })
      .def_readonly("solved", &Decision::solved)
      .def_property_readonly("cost", [](const Decision& d) { return d.report.cost; })
      .def_property_readonly("solve_us", [](const Decision& d) { return d.report.time_us; });
  py::class_<Controller>(m, "Controller")
      .def(py::init([](const VariantConfig& variant, const ScenarioConfig& scenario) {
             return make_controller(timed(variant, scenario.timing, scenario.name), scenario.trajectory,
                                    scenario.plane);
           }),
           py::arg("variant"), py::arg("scenario"))
      .def("step", &Controller::step, py::arg("sensors"))
      .def("applied", &Controller::applied, py::arg("command"));
  py::class_<SimulatedPlant>(m, "Plant")
      .def(py::init([](const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed) {
             return make_plant(variant, scenario, seed);
           }),
           py::arg("variant"), py::arg("scenario"), py::arg("seed") = 1)
      .def(
          "read", [](SimulatedPlant& p, double time_s) { return p.read(time_s); }, py::arg("time_s"))
      .def(
          "write", [](SimulatedPlant& p, const Command& command) { p.write(command); }, py::arg("command"))
      .def_property_readonly("air_used_kg", &SimulatedPlant::consumed);
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
