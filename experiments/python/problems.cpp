#include "controllers/factory.hpp"
#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "experiments/campaign/run_in_progress.hpp"
#include "experiments/python/interruptible.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <typeindex>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// Rows of numbers as an array of its own.
Numbers array_of_rows(std::span<const double> numbers, std::size_t rows) {
  const std::size_t width = rows == 0 ? 0 : numbers.size() / rows;
  return filled<double>({static_cast<py::ssize_t>(rows), static_cast<py::ssize_t>(width)},
                        [&](std::size_t i) { return numbers[i]; });
}

/// The reverse; a row is repeated. Throws ConfigError for another shape.
void set_rows(const Numbers& from, std::span<double> into, std::size_t rows, const char* what) {
  const std::size_t width = rows == 0 ? 0 : into.size() / rows;
  const auto size = static_cast<std::size_t>(from.size());
  if (size != into.size() && size != width)
    throw ConfigError(fmt::format("{}: {} numbers (allowed: {}, or {} rows of them)", what, size, width, rows));
  for (std::size_t i = 0; i < into.size(); ++i) into[i] = from.data()[i % size];
}

/// A plan and how it came about.
struct FoundPlan {
  std::type_index model;
  Held<AnyPlan> plan;
  SolveReport report{};
};

/// What a variant poses, and its solver.
class PosedProblem {
 public:
  explicit PosedProblem(const VariantConfig& variant)
      : problem_(system_of(variant).problem(variant)),
        tools_(system_of(variant).tools(variant)),
        solver_(make_solver(variant)) {
    problem_->lines = DelayLines(problem_->modes.safe_pattern());
    solver_->prepare(*problem_);
  }

  AnyProblem& problem() { return *problem_; }
  const AnyProblem& problem() const { return *problem_; }
  std::size_t blocks() const { return problem_->horizon.blocks.size(); }
  std::size_t steps() const { return static_cast<std::size_t>(problem_->horizon.steps()); }

  /// Of a law inside the prediction it is the set-point, too: that of a step is what is desired as the step begins.
  void set_reference(const Numbers& values) {
    const std::span<double> reference = problem_->reference_values(), setpoint = problem_->setpoint_values();
    set_rows(values, reference, steps(), "reference");
    if (setpoint.empty()) return;
    const std::size_t width = setpoint.size() / steps();
    std::ranges::copy(reference.first(width), setpoint.begin());
    std::ranges::copy(reference.first(setpoint.size() - width), setpoint.subspan(width).begin());
  }

  FoundPlan solve(const FoundPlan* start, std::optional<double> deadline_s) {
    FoundPlan found = start ? same_shape(*start) : new_plan();
    const Deadline deadline = deadline_s ? Deadline::after_s(*deadline_s) : Deadline::never();
    const ScenarioConfig none{};
    const RunInProgress run(none);  // hears what a solver in Python raises
    {
      const py::gil_scoped_release released;
      found.report = solver_->solve(*problem_, *found.plan, deadline);
    }
    run.require_sound();
    return found;
  }

  FoundPlan plan(const std::vector<int>& modes, const std::optional<Numbers>& inputs) const {
    FoundPlan made = new_plan();
    if (modes.size() != blocks())
      throw ConfigError(fmt::format("plan: {} modes (allowed: {}, one a block)", modes.size(), blocks()));
    for (const int mode : modes)
      if (mode < 0 || mode >= problem_->modes.size())
        throw ConfigError(fmt::format("plan: mode {} (allowed: 0 to {})", mode, problem_->modes.size() - 1));
    std::ranges::copy(modes, made.plan->modes.begin());
    if (inputs) set_rows(*inputs, made.plan->inputs(), blocks(), "inputs");
    made.report = tools_.evaluate(*problem_, *made.plan);
    return made;
  }

 private:
  FoundPlan new_plan() const { return {problem_->model_type(), Held<AnyPlan>(problem_->new_plan())}; }
  FoundPlan same_shape(const FoundPlan& start) const {
    if (start.model != problem_->model_type())
      throw ConfigError("start: a plan of another model (allowed: plans of this variant's)");
    if (start.plan->modes.size() != blocks() || start.plan->inputs().size() != blocks() * problem_->sizes().inputs)
      throw ConfigError(fmt::format("start: a plan of {} blocks (allowed: {})", start.plan->modes.size(), blocks()));
    return start;
  }

  std::unique_ptr<AnyProblem> problem_;
  const ModelTools& tools_;
  AnySolverPtr solver_;
};

void bind_plan(py::module_& m) {
  py::class_<FoundPlan>(m, "Plan")
      .def_property_readonly("modes",
                             [](const FoundPlan& f) {
                               return filled<int>({static_cast<py::ssize_t>(f.plan->modes.size())},
                                                  [&](std::size_t b) { return f.plan->modes[b]; });
                             })
      .def_property_readonly(
          "inputs",
          [](const FoundPlan& f) { return array_of_rows(std::as_const(*f.plan).inputs(), f.plan->modes.size()); })
      .def_property_readonly("weights",
                             [](const FoundPlan& f) -> std::optional<Numbers> {
                               if (!f.plan->relaxation.known) return std::nullopt;
                               return array_of_rows(f.plan->relaxation.weights, f.plan->modes.size());
                             })
      .def_property_readonly("status", [](const FoundPlan& f) { return std::string(to_string(f.report.status)); })
      .def_property_readonly("cost", [](const FoundPlan& f) { return f.report.cost; })
      .def_property_readonly("bound", [](const FoundPlan& f) { return f.report.bound; })
      .def_property_readonly("switches", [](const FoundPlan& f) { return f.report.switches; })
      .def_property_readonly("nodes", [](const FoundPlan& f) { return f.report.nodes; })
      .def_property_readonly("time_s", [](const FoundPlan& f) { return 1e-6 * f.report.time_us; })
      .def("__repr__", [](const FoundPlan& f) {
        return fmt::format("<solenoid.Plan {} blocks, cost {:g}, {}>", f.plan->modes.size(), f.report.cost,
                           to_string(f.report.status));
      });
}

}  // namespace

void bind_problems(py::module_& m) {
  bind_plan(m);
  py::class_<PosedProblem>(m, "Problem")
      .def(py::init<const VariantConfig&>(), py::arg("variant"))
      .def_property_readonly("dt_s", [](const PosedProblem& p) { return p.problem().horizon.dt_s; })
      .def_property_readonly("blocks",
                             [](const PosedProblem& p) {
                               return filled<int>({static_cast<py::ssize_t>(p.blocks())},
                                                  [&](std::size_t b) { return p.problem().horizon.blocks[b]; });
                             })
      .def_property_readonly("modes",
                             [](const PosedProblem& p) {
                               std::vector<std::string> names;
                               for (const Mode& mode : p.problem().modes.modes()) names.push_back(mode.name);
                               return names;
                             })
      .def_property_readonly("points",
                             [](const PosedProblem& p) {
                               const ModeSet& modes = p.problem().modes;
                               std::vector<double> points;
                               for (int mode = 0; mode < modes.size(); ++mode)
                                 for (const double value : modes.point(modes.pattern(mode))) points.push_back(value);
                               return array_of_rows(points, static_cast<std::size_t>(modes.size()));
                             })
      .def_property(
          "initial",
          [](const PosedProblem& p) { return array_of_rows(p.problem().initial_values(), 1).attr("ravel")(); },
          [](PosedProblem& p, const Numbers& values) { set_rows(values, p.problem().initial_values(), 1, "initial"); })
      .def_property(
          "reference", [](const PosedProblem& p) { return array_of_rows(p.problem().reference_values(), p.steps()); },
          [](PosedProblem& p, const Numbers& values) { p.set_reference(values); })
      .def("solve", &PosedProblem::solve, py::arg("start") = nullptr, py::arg("deadline_s") = py::none())
      .def("plan", &PosedProblem::plan, py::arg("modes"), py::arg("inputs") = py::none());
}

}  // namespace solenoid
