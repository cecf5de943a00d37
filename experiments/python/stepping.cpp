#include "controllers/factory.hpp"
#include "controllers/systems.hpp"
#include "experiments/campaign/run_in_progress.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/python/bindings.hpp"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace solenoid {
namespace {

struct ControllerOf {
  const SystemDescription* system;
  std::shared_ptr<const ScenarioConfig> scenario;
  std::unique_ptr<Controller> controller;
};
struct PlantOf {
  const SystemDescription* system;
  std::unique_ptr<SimulatedPlant> plant;
};

/// Values into a record.
template <class Values>
void assign(const std::vector<double>& from, Values& values) {
  if (from.size() > values.size()) throw py::value_error(fmt::format("at most {} values", values.size()));
  std::ranges::copy(from, values.begin());
}

}  // namespace

void bind_stepping(py::module_& m) {
  // A number of a record as an attribute.
  const auto attribute = [](auto& type, const char* name, auto at) {
    using T = typename std::remove_reference_t<decltype(type)>::type;
    type.def_property(
        name, [at](T& record) { return at(record); }, [at](T& record, double value) { at(record) = value; });
  };
  py::class_<SensorsOf> sensors(m, "Sensors");
  sensors.def(py::init([] { return SensorsOf{&systems().front()->description()}; }))
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
             auto own = std::make_shared<const ScenarioConfig>(scenario);
             const RunInProgress run(*own);
             return ControllerOf{&system_of(variant).description_for(variant), own,
                                 make_controller(told(variant, scenario), scenario.trajectory)};
           }),
           py::arg("variant"), py::arg("scenario"))
      .def(
          "step",
          [](ControllerOf& c, const SensorsOf& s) {
            const RunInProgress run(*c.scenario);
            const DecisionOf decided{c.system, c.controller->step(s.measured)};
            run.require_sound();
            return decided;
          },
          py::arg("sensors"))
      .def(
          "applied", [](ControllerOf& c, const Command& applied) { c.controller->applied(applied); },
          py::arg("command"));
  py::class_<PlantOf>(m, "Plant")
      .def(py::init([](const VariantConfig& variant, const ScenarioConfig& scenario, std::uint64_t seed) {
             return PlantOf{&system_of(variant).description_for(variant), make_plant(variant, scenario, seed)};
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

}  // namespace solenoid
