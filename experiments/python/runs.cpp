#include "controllers/systems.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/python/bindings.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

/// The ticks of a run; arrays look into them without copying and keep them alive.
struct Run {
  const SystemDescription* system;
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

Run simulate_run(const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed) {
  RunResult result = simulate(variant, scenario, seed);
  return {&system_of(variant).description_for(variant), result.metrics, std::move(result.ticks)};
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

}  // namespace

void bind_runs(py::module_& m) {
  bind_metrics(m);
  bind_run(m);
}

}  // namespace solenoid
