#include "controllers/factory.hpp"
#include "core/config/reader.hpp"
#include "experiments/campaign/run_in_progress.hpp"
#include "experiments/plugin/python_rows.hpp"
#include "experiments/python/bindings.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

/// The motion that a run's measurements know of: none once the run is over.
struct ReferenceAhead {
  const RestartableReference* reference = nullptr;
};

/// What a law in Python gets each tick.
struct Seen {
  const SystemDescription* system;
  Measurement measured;
  StateValues estimate;
  ReferenceSample reference;
  std::int64_t tick;
  SwitchPattern commanded;
  std::shared_ptr<ReferenceAhead> ahead;

  /// A number by its key in logs, or null.
  const double* named(const std::string& name) const {
    const auto at = [&](const std::vector<std::string>& keys) {
      return static_cast<std::size_t>(std::ranges::find(keys, name) - keys.begin());
    };
    for (std::size_t c = 0; c < system->channels.size(); ++c)
      if (name == system->channels[c].key) return &measured.value[c];
    if (const std::size_t i = at(system->estimate_keys); i < system->estimate_keys.size()) return &estimate[i];
    const std::size_t i = at(system->reference_keys), axes = system->axes.size();
    if (i >= system->reference_keys.size()) return nullptr;
    return i < axes ? &reference.axis[i].value : &reference.axis[i - axes].rate;
  }
  std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const Signal& channel : system->channels) all.push_back(channel.key);
    all.insert(all.end(), system->estimate_keys.begin(), system->estimate_keys.end());
    all.insert(all.end(), system->reference_keys.begin(), system->reference_keys.end());
    return all;
  }
};

/// What the halves of a law share. Python's lock is held where its objects are touched.
struct LawParts {
  LawParts(const VariantConfig& v)
      : name(v.name),
        system(system_of(v).description()),
        modes(system_of(v).modes(v)),
        object(made_in_python(v, "step")),
        step(object.attr("step")) {}
  LawParts(const LawParts&) = delete;
  LawParts& operator=(const LawParts&) = delete;
  ~LawParts() {
    const py::gil_scoped_acquire held;
    step = object = py::object();
  }

  std::string name;
  const SystemDescription& system;
  ModeSet modes;
  Measurement measured{};
  std::shared_ptr<ReferenceAhead> ahead = std::make_shared<ReferenceAhead>();
  py::object object, step;
  bool failed = false;
};

constexpr const char* allowed_commands =
    "a Command, the pattern of a mode, the name of one, or one of these with continuous inputs as a pair";

ConfigError wrong_command(const LawParts& law, const py::handle& answer) {
  return ConfigError(
      fmt::format("variant '{}': step returned {} (allowed: {})", law.name, shown_object(answer), allowed_commands));
}

SwitchPattern pattern_of(const LawParts& law, const py::handle& answer) {
  std::vector<std::string> known;
  for (const Mode& mode : law.modes.modes()) known.push_back(fmt::format("{} '{}'", mode.pattern, mode.name));
  if (py::isinstance<py::str>(answer)) {
    const auto name = answer.cast<std::string>();
    for (const Mode& mode : law.modes.modes())
      if (mode.name == name) return mode.pattern;
    throw ConfigError(
        fmt::format("variant '{}': step returned the mode '{}' (allowed: {})", law.name, name, fmt::join(known, ", ")));
  }
  if (!PyIndex_Check(answer.ptr())) throw wrong_command(law, answer);
  PyObject* const index = PyNumber_Index(answer.ptr());
  if (!index) {  // an array
    PyErr_Clear();
    throw wrong_command(law, answer);
  }
  const py::object whole = py::reinterpret_steal<py::object>(index);
  for (const Mode& mode : law.modes.modes())
    if (whole.equal(py::int_(mode.pattern))) return mode.pattern;
  throw ConfigError(fmt::format("variant '{}': step returned the pattern {} (allowed: {})", law.name,
                                shown_object(whole), fmt::join(known, ", ")));
}

Command command_of(const LawParts& law, const py::handle& answer) {
  Command command;
  if (py::isinstance<Command>(answer)) {
    command = answer.cast<Command>();
    pattern_of(law, py::int_(command.switches));
  } else if (py::isinstance<py::tuple>(answer) || py::isinstance<py::list>(answer)) {
    const auto pair = py::reinterpret_borrow<py::sequence>(answer);
    if (pair.size() != 2) throw wrong_command(law, answer);
    command.switches = pattern_of(law, pair[0]);
    const auto inputs = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(pair[1]);
    if (!inputs) PyErr_Clear();
    if (!inputs || inputs.ndim() > 1) throw wrong_command(law, answer);
    if (inputs.size() > static_cast<py::ssize_t>(law.system.continuous.size()))
      throw ConfigError(fmt::format("variant '{}': step returned {} continuous inputs (allowed: {})", law.name,
                                    inputs.size(), law.system.continuous.size()));
    std::copy_n(inputs.data(), inputs.size(), command.continuous.begin());
  } else {
    command.switches = pattern_of(law, answer);
  }
  if (!std::ranges::all_of(command.continuous, [](double u) { return std::isfinite(u); }))
    throw ConfigError(fmt::format("variant '{}': step returned continuous inputs {} (allowed: finite numbers)",
                                  law.name,
                                  fmt::join(shortened(command.continuous, law.system.continuous.size()), ", ")));
  return command;
}

/// Asks Python. After an exception, and while none hears of it, the switches are safe.
class PythonDecider {
 public:
  explicit PythonDecider(std::shared_ptr<LawParts> law) : law_(std::move(law)) {}

  void believe(const EstimateDetail&) noexcept {}
  void decide(const Moment& now, Decision& d) noexcept {
    d.command = {law_->modes.safe_pattern(), {}};
    if (law_->failed) return;
    const py::gil_scoped_acquire held;
    try {
      law_->ahead->reference = &now.reference;
      d.command = command_of(*law_, law_->step(Seen{&law_->system, law_->measured, d.estimate, d.reference, now.tick,
                                                    now.in_flight.lines().commanded(), law_->ahead}));
    } catch (const py::error_already_set& error) {
      fail(
          std::make_exception_ptr(PythonError(error, fmt::format("step of '{}' at {:.6g} s", law_->name, now.time_s))));
    } catch (...) {
      fail(std::current_exception());
    }
  }
  void look_ahead(const Moment&, const Decision&, SwitchPattern) noexcept {}
  void restart(std::int64_t) noexcept {
    const py::gil_scoped_acquire held;
    try {
      if (py::hasattr(law_->object, "reset")) law_->object.attr("reset")();
    } catch (const py::error_already_set& error) {
      fail(std::make_exception_ptr(PythonError(error, fmt::format("reset of '{}'", law_->name))));
    }
  }

 private:
  void fail(std::exception_ptr why) noexcept {
    law_->failed = true;
    fail_run(std::move(why));
  }

  std::shared_ptr<LawParts> law_;
};

/// The shell of every controller around it, which is told the measurement itself.
class PythonLaw final : public Controller {
 public:
  PythonLaw(std::shared_ptr<LawParts> law, std::unique_ptr<Controller> shell)
      : law_(std::move(law)), shell_(std::move(shell)) {}
  PythonLaw(const PythonLaw&) = delete;
  PythonLaw& operator=(const PythonLaw&) = delete;
  ~PythonLaw() override {
    const py::gil_scoped_acquire held;
    law_->ahead->reference = nullptr;
  }

  Decision step(const Measurement& measured) noexcept override {
    law_->measured = measured;
    return shell_->step(measured);
  }
  void applied(const Command& command) noexcept override { shell_->applied(command); }
  void restart(double time_s, const AxisValues& from) noexcept override { shell_->restart(time_s, from); }

 private:
  std::shared_ptr<LawParts> law_;
  std::unique_ptr<Controller> shell_;
};

std::unique_ptr<Controller> make_law_in_python(const VariantConfig& variant, const Motion& reference) {
  const py::gil_scoped_acquire held;
  auto law = std::make_shared<LawParts>(variant);
  return std::make_unique<PythonLaw>(law, make_shell(variant, reference, PythonDecider(law)));
}

/// One of the numbers that a reference has for each axis.
py::array_t<double> of_axes(const Seen& s, double MotionSample::*number) {
  std::vector<double> values;
  for (std::size_t a = 0; a < s.system->axes.size(); ++a) values.push_back(s.reference.axis[a].*number);
  return array_of(values);
}

py::array_t<double> reference_at(const Seen& s, double time_s) {
  if (!s.ahead->reference) throw py::value_error("the run of this measurement is over");
  const ReferenceSample sample = s.ahead->reference->at(time_s);
  const auto axes = static_cast<py::ssize_t>(s.system->axes.size());
  py::array_t<double> values({axes, py::ssize_t{3}});
  for (py::ssize_t a = 0; a < axes; ++a) {
    const MotionSample& axis = sample.axis[static_cast<std::size_t>(a)];
    values.mutable_at(a, 0) = axis.value;
    values.mutable_at(a, 1) = axis.rate;
    values.mutable_at(a, 2) = axis.acceleration;
  }
  return values;
}

}  // namespace

void bind_python_laws(py::module_& m) {
  python_makers().law = make_law_in_python;
  py::class_<Seen>(m, "Measurement")
      .def_property_readonly("time_s", [](const Seen& s) { return s.measured.time_s; })
      .def_readonly("tick", &Seen::tick)
      .def_readonly("commanded", &Seen::commanded)
      .def_property_readonly(
          "value", [](const Seen& s) { return array_of(std::span(s.measured.value).first(s.system->channels.size())); })
      .def_property_readonly(
          "estimate", [](const Seen& s) { return array_of(std::span(s.estimate).first(s.system->states.size())); })
      .def_property_readonly("reference", [](const Seen& s) { return of_axes(s, &MotionSample::value); })
      .def_property_readonly("reference_rate", [](const Seen& s) { return of_axes(s, &MotionSample::rate); })
      .def_property_readonly("reference_acceleration",
                             [](const Seen& s) { return of_axes(s, &MotionSample::acceleration); })
      .def("reference_at", &reference_at, py::arg("time_s"))
      .def("__getattr__",
           [](const Seen& s, const std::string& name) {
             if (const double* number = s.named(name)) return *number;
             throw py::attribute_error(fmt::format("a measurement of {} has no '{}' (it has {})", s.system->name, name,
                                                   fmt::join(s.names(), ", ")));
           })
      .def("__dir__", [](const py::object& self) {
        py::list names = py::module_::import("builtins").attr("object").attr("__dir__")(self);
        for (const std::string& name : self.cast<const Seen&>().names()) names.append(name);
        return names;
      });
}

}  // namespace solenoid
