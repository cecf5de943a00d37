#pragma once

#include "controllers/variant.hpp"
#include "core/rt/controller.hpp"
#include "core/system/description.hpp"
#include "experiments/campaign/scenario.hpp"

#include <cstddef>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/operators.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

/// The C++ half of the Python package, solenoid._core: a function each for its parts. The package itself
/// (package/__init__.py) gives it its face.

namespace solenoid {

namespace py = pybind11;

/// A measurement and a decision of a system, as a plant shows and a controller returns them.
struct SensorsOf {
  const SystemDescription* system;
  Measurement measured{};
};
struct DecisionOf {
  const SystemDescription* system;
  Decision decision;
};

/// What Python raised, on its way through what is not Python. Its text: a line, then the traceback as Python prints it.
/// Back in Python it is the exception itself.
class [[gnu::visibility("hidden")]] PythonError : public std::runtime_error {
 public:
  /// Python holds its lock. `where` says what was called.
  PythonError(const py::error_already_set& error, const std::string& where);
  const py::error_already_set& original() const { return *original_; }

 private:
  std::shared_ptr<py::error_already_set> original_;
};

/// The object that a variant's law or solver is in this run: of the maker that was registered under its name. Python
/// holds its lock. Throws PythonError, or ConfigError where it has not `method`.
py::object made_in_python(const VariantConfig& variant, const char* method);

/// What an object prints, shortened.
std::string shown_object(const py::handle& object);

/// The first of a record's values, as many as the system has.
template <class Values>
std::vector<double> shortened(const Values& values, std::size_t size) {
  return {values.begin(), values.begin() + static_cast<std::ptrdiff_t>(size)};
}

/// A new array with these numbers, shape (size,).
inline py::array_t<double> array_of(std::span<const double> values) {
  return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
}

/// Variants, scenarios, campaigns and plug-ins: what there is, and what is said of it.
void bind_configuration(py::module_& m);
/// Runs, one and many, and what is measured of them.
void bind_runs(py::module_& m);
/// A controller and a plant that Python steps itself: the loop of `simulate`, one tick at a time.
void bind_stepping(py::module_& m);
/// The problem that a variant poses, to be solved once: Problem and Plan.
void bind_problems(py::module_& m);
/// What the command line does to data: tuning, profiles, ledgers, reports.
void bind_data(py::module_& m);
/// Recorded instances as arrays.
void bind_instances(py::module_& m);
/// Variants against each other, those written in Python among them.
void bind_comparison(py::module_& m);
/// Laws and solvers that are written in Python.
void bind_python_rows(py::module_& m);
void bind_python_laws(py::module_& m);
void bind_python_solvers(py::module_& m);

}  // namespace solenoid
