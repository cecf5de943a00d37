#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "experiments/campaign/run_in_progress.hpp"
#include "experiments/plugin/python_rows.hpp"
#include "experiments/python/bindings.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

using Modes = py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>;
using Inputs = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// A problem while it is solved; arrays are its copies.
///
/// shapes   N steps, B blocks, M modes; states, outputs, switched, inputs: the model's
struct Posed {
  const ModelTools& tools;
  const AnyProblem* problem = nullptr;  ///< null: solved
  const AnyPlan* warm_start = nullptr;
  Deadline deadline = Deadline::never();
  Held<AnyPlan> trial{};
  std::int64_t evaluated = 0;

  const AnyProblem& there() const {
    if (!problem) throw py::value_error("a problem is there while its solve() runs, and no longer");
    return *problem;
  }
};

py::array_t<double> rows_of(std::span<const double> values, std::size_t rows, std::size_t width) {
  return py::array_t<double>({static_cast<py::ssize_t>(rows), static_cast<py::ssize_t>(width)}, values.data());
}

py::array_t<int> array_of_blocks(const std::vector<int>& values) {
  return py::array_t<int>(static_cast<py::ssize_t>(values.size()), values.data());
}

[[noreturn]] void refuse_plan(const py::handle& plan, const AnyProblem& problem) {
  throw ConfigError(fmt::format(
      "modes {} (allowed: {} modes, one a block, by number or name, or an array of as many columns for cost())",
      shown_object(plan), problem.horizon.blocks.size()));
}

int mode_named(const AnyProblem& problem, const std::string& name) {
  std::vector<std::string> known;
  for (const Mode& mode : problem.modes.modes()) {
    if (mode.name == name) return static_cast<int>(known.size());
    known.push_back(mode.name);
  }
  throw ConfigError(fmt::format("the mode '{}' (allowed: {})", name, fmt::join(known, ", ")));
}

/// Numbers of modes from numbers or names: (B,) or (plans, B).
Modes modes_of(const py::handle& given, const AnyProblem& problem) {
  const auto blocks = static_cast<py::ssize_t>(problem.horizon.blocks.size());
  py::object taken = py::reinterpret_borrow<py::object>(given);
  if (py::isinstance<py::sequence>(given) && !py::isinstance<py::array>(given)) {
    py::list numbers;
    for (const py::handle mode : given)
      if (py::isinstance<py::str>(mode))
        numbers.append(mode_named(problem, mode.cast<std::string>()));
      else
        numbers.append(mode);
    taken = numbers;
  }
  const py::array any = py::array::ensure(taken);
  if (!any) PyErr_Clear();
  const bool whole = any && (any.dtype().kind() == 'i' || any.dtype().kind() == 'u');
  if (!whole || any.ndim() < 1 || any.ndim() > 2 || any.shape(any.ndim() - 1) != blocks) refuse_plan(given, problem);
  auto modes = Modes::ensure(any);
  for (py::ssize_t i = 0; i < modes.size(); ++i)
    if (modes.data()[i] < 0 || modes.data()[i] >= problem.modes.size())
      throw ConfigError(fmt::format("the mode {} (allowed: 0 to {})", modes.data()[i], problem.modes.size() - 1));
  return modes;
}

/// Continuous inputs for plans of this shape: (..., B, inputs); none: zeros.
Inputs inputs_of(const py::handle& given, const Modes& modes, std::size_t inputs) {
  py::list shape;
  for (py::ssize_t i = 0; i < modes.ndim(); ++i) shape.append(modes.shape(i));
  shape.append(inputs);
  const py::module_ numpy = py::module_::import("numpy");
  if (given.is_none()) return numpy.attr("zeros")(shape);
  try {
    const py::object values = numpy.attr("asarray")(given, "float64");
    if ((inputs == 0) == (values.attr("size").cast<std::size_t>() == 0))
      return numpy.attr("broadcast_to")(values, py::tuple(shape));
  } catch (const py::error_already_set&) {  // no numbers, or of another shape
  }
  throw ConfigError(fmt::format("continuous inputs {} (allowed: numbers of shape {})", shown_object(given),
                                shown_object(py::tuple(shape))));
}

void fill_plan(AnyPlan& plan, const AnyProblem& problem, const std::int64_t* modes, const double* inputs) {
  for (std::size_t b = 0; b < plan.modes.size(); ++b) plan.modes[b] = static_cast<int>(modes[b]);
  const std::span<double> own = plan.inputs();
  const std::span<const double> low = problem.input_lower(), high = problem.input_upper();
  for (std::size_t i = 0; i < own.size(); ++i)
    own[i] = std::clamp(inputs[i], low[i % low.size()], high[i % high.size()]);
  plan.relaxation.known = false;
}

py::object cost_of(Posed& posed, const py::object& given, const py::object& continuous) {
  const AnyProblem& problem = posed.there();
  const Modes modes = modes_of(given, problem);
  const Inputs inputs = inputs_of(continuous, modes, problem.sizes().inputs);
  const std::size_t blocks = problem.horizon.blocks.size();
  const std::size_t plans = static_cast<std::size_t>(modes.size()) / blocks, width = blocks * problem.sizes().inputs;
  std::vector<double> costs(plans);
  for (std::size_t p = 0; p < plans; ++p) {
    fill_plan(*posed.trial, problem, modes.data() + p * blocks, inputs.data() + p * width);
    costs[p] = posed.tools.evaluate(problem, *posed.trial).cost;
  }
  posed.evaluated += static_cast<std::int64_t>(plans);
  if (modes.ndim() == 1) return py::float_(costs.front());
  return array_of(costs);
}

/// A pair of modes and continuous inputs, not a plan of two blocks.
bool is_pair(const py::handle& answer) {
  if (!py::isinstance<py::tuple>(answer) || py::len(answer) != 2) return false;
  const py::object first = py::reinterpret_borrow<py::tuple>(answer)[0];
  return !py::isinstance<py::str>(first) && py::isinstance<py::sequence>(first);
}

class SolverInPython final : public AnySolver {
 public:
  explicit SolverInPython(const VariantConfig& variant)
      : name_(variant.name),
        posed_(std::make_shared<Posed>(Posed{system_of(variant).tools(variant)})),
        object_(made_in_python(variant, "solve")),
        solve_(object_.attr("solve")) {}
  SolverInPython(const SolverInPython&) = delete;
  SolverInPython& operator=(const SolverInPython&) = delete;
  ~SolverInPython() override {
    const py::gil_scoped_acquire held;
    solve_ = object_ = py::object();
  }

 private:
  void do_prepare(const AnyProblem& problem) override { posed_->trial = Held(problem.new_plan()); }

  SolveReport do_solve(const AnyProblem& problem, AnyPlan& plan, Deadline deadline) noexcept override {
    const auto began = Deadline::Clock::now();
    SolveReport report;
    report.status = Status::infeasible;
    if (failed_) return report;
    {
      const py::gil_scoped_acquire held;
      posed_->problem = &problem;
      posed_->warm_start = &plan;
      posed_->deadline = deadline;
      posed_->evaluated = 0;
      try {
        if (take(solve_(posed_), problem, plan)) report = posed_->tools.evaluate(problem, plan);
      } catch (const py::error_already_set& error) {
        fail(std::make_exception_ptr(PythonError(error, fmt::format("solve of '{}'", name_))));
      } catch (const ConfigError& error) {
        fail(std::make_exception_ptr(ConfigError(fmt::format("variant '{}': solve returned {}", name_, error.what()))));
      } catch (...) {
        fail(std::current_exception());
      }
      posed_->problem = nullptr;
      posed_->warm_start = nullptr;
    }
    report.nodes = posed_->evaluated;
    report.time_us = us_since(began);
    return report;
  }

  /// The answer as a plan; false: there is none.
  static bool take(const py::object& answer, const AnyProblem& problem, AnyPlan& plan) {
    if (answer.is_none()) return false;
    const bool pair = is_pair(answer);
    const py::object given = pair ? py::object(answer[py::int_(0)]) : answer;
    const Modes modes = modes_of(given, problem);
    if (modes.ndim() != 1) refuse_plan(given, problem);
    const Inputs inputs =
        inputs_of(pair ? py::object(answer[py::int_(1)]) : py::object(py::none()), modes, problem.sizes().inputs);
    if (!std::all_of(inputs.data(), inputs.data() + inputs.size(), [](double u) { return std::isfinite(u); }))
      throw ConfigError("continuous inputs that are no numbers (allowed: finite ones)");
    fill_plan(plan, problem, modes.data(), inputs.data());
    return true;
  }

  void fail(std::exception_ptr why) noexcept {
    failed_ = true;
    fail_run(std::move(why));
  }

  std::string name_;
  std::shared_ptr<Posed> posed_;
  py::object object_, solve_;
  bool failed_ = false;
};

AnySolverPtr make_solver_in_python(const VariantConfig& variant) {
  const py::gil_scoped_acquire held;
  return std::make_unique<SolverInPython>(variant);
}

}  // namespace

void bind_python_solvers(py::module_& m) {
  python_makers().solver = make_solver_in_python;
  py::class_<Posed, std::shared_ptr<Posed>>(m, "PeriodProblem")
      .def_property_readonly("initial", [](const Posed& p) { return array_of(p.there().initial_values()); })
      .def_property_readonly("reference",
                             [](const Posed& p) {
                               return rows_of(p.there().reference_values(),
                                              static_cast<std::size_t>(p.there().horizon.steps()),
                                              p.there().sizes().outputs);
                             })
      .def_property_readonly("modes",
                             [](const Posed& p) {
                               std::vector<std::string> names;
                               for (const Mode& mode : p.there().modes.modes()) names.push_back(mode.name);
                               return names;
                             })
      .def_property_readonly("patterns",
                             [](const Posed& p) {
                               std::vector<SwitchPattern> patterns;
                               for (const Mode& mode : p.there().modes.modes()) patterns.push_back(mode.pattern);
                               return py::array_t<SwitchPattern>(static_cast<py::ssize_t>(patterns.size()),
                                                                 patterns.data());
                             })
      .def_property_readonly("points",
                             [](const Posed& p) {
                               std::vector<double> points;
                               for (const Mode& mode : p.there().modes.modes())
                                 std::ranges::copy(p.there().modes.point(mode.pattern), std::back_inserter(points));
                               return rows_of(points, static_cast<std::size_t>(p.there().modes.size()),
                                              p.there().sizes().switched);
                             })
      .def_property_readonly("blocks", [](const Posed& p) { return array_of_blocks(p.there().horizon.blocks); })
      .def_property_readonly("dt_s", [](const Posed& p) { return p.there().horizon.dt_s; })
      .def_property_readonly("commanded", [](const Posed& p) { return p.there().lines.commanded(); })
      .def_property_readonly("input_lower", [](const Posed& p) { return array_of(p.there().input_lower()); })
      .def_property_readonly("input_upper", [](const Posed& p) { return array_of(p.there().input_upper()); })
      .def_property_readonly("warm_start",
                             [](const Posed& p) {
                               p.there();
                               return array_of_blocks(p.warm_start->modes);
                             })
      .def_property_readonly("warm_inputs",
                             [](const Posed& p) {
                               const AnyProblem& problem = p.there();
                               return rows_of(std::as_const(*p.warm_start).inputs(), problem.horizon.blocks.size(),
                                              problem.sizes().inputs);
                             })
      .def_property_readonly("seconds_left",
                             [](const Posed& p) {
                               p.there();
                               return p.deadline.seconds_left();
                             })
      .def("cost", &cost_of, py::arg("modes"), py::arg("continuous") = py::none());
}

}  // namespace solenoid
