#include "experiments/plugin/python_rows.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/processes.hpp"
#include "experiments/campaign/run_in_progress.hpp"
#include "experiments/python/bindings.hpp"

#include <map>
#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// By the names of their variants. For ever: at the end there is no Python left to give objects back to.
std::map<std::string, py::object>& python_objects() {
  static auto* all = new std::map<std::string, py::object>;
  return *all;
}

/// As Python prints it: a line, then the traceback.
std::string traceback_text(const py::error_already_set& error, const std::string& where) {
  try {
    if (error.value() && py::hasattr(error.value(), "add_note")) error.value().attr("add_note")("in " + where);
    const py::module_ traceback = py::module_::import("traceback");
    const py::list only = traceback.attr("format_exception_only")(error.type(), error.value());
    const py::object all = traceback.attr("format_exception")(error.type(), error.value(), error.trace());
    std::string text = only[0].cast<std::string>() + py::str("").attr("join")(all).cast<std::string>();
    while (text.ends_with('\n')) text.pop_back();
    return text;
  } catch (const std::exception&) {  // its own __str__ may raise
    return error.what();
  }
}

void flush_python() {
  for (const char* name : {"stdout", "stderr"}) {
    PyObject* stream = PySys_GetObject(name);
    if (!stream || stream == Py_None) continue;
    PyObject* done = PyObject_CallMethod(stream, "flush", nullptr);
    if (!done) PyErr_Clear();
    Py_XDECREF(done);
  }
}

/// Python as it wants to be at a fork: its lock held, its own locks and threads seen to on both sides. Outside of the
/// fork the lock is free, in the worker too.
void fork_with_python() {
  static thread_local PyGILState_STATE state;
  around_forks({.before =
                    [] {
                      state = PyGILState_Ensure();
                      flush_python();
                      PyOS_BeforeFork();
                    },
                .in_parent =
                    [] {
                      PyOS_AfterFork_Parent();
                      PyGILState_Release(state);
                    },
                .in_child =
                    [] {
                      PyOS_AfterFork_Child();
                      PyGILState_Release(state);
                    },
                .child_ends =
                    [] {
                      const PyGILState_STATE held = PyGILState_Ensure();
                      flush_python();
                      PyGILState_Release(held);
                    }});
}

}  // namespace

PythonError::PythonError(const py::error_already_set& error, const std::string& where)
    : std::runtime_error(traceback_text(error, where)), original_(std::make_shared<py::error_already_set>(error)) {}

py::object made_in_python(const VariantConfig& variant, const char* method) {
  const auto found = python_objects().find(variant.name);
  if (found == python_objects().end())
    throw ConfigError(fmt::format(
        "variant '{}' has no Python object of its name (allowed: solenoid.PythonController or solenoid.PythonSolver)",
        variant.name));
  const RunInProgress* run = RunInProgress::here();
  py::object object;
  try {
    object = found->second(variant, run ? py::cast(run->scenario()) : py::none());
    if (py::hasattr(object, "reset")) object.attr("reset")();
  } catch (const py::error_already_set& error) {
    throw PythonError(error, fmt::format("the construction of '{}'", variant.name));
  }
  if (!py::hasattr(object, method) || !PyCallable_Check(object.attr(method).ptr()))
    throw ConfigError(fmt::format("variant '{}': {} has no method '{}' (allowed: an object with one)", variant.name,
                                  shown_object(object), method));
  return object;
}

std::string shown_object(const py::handle& object) {
  constexpr std::size_t most = 200;
  std::string text = py::repr(object).cast<std::string>();
  if (text.size() <= most) return text;
  std::size_t end = most;
  while ((static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;  // within a character of UTF-8
  return text.substr(0, end) + "...";
}

void bind_python_rows(py::module_& m) {
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(std::move(thrown));
    } catch (const PythonError& error) {
      py::error_already_set(error.original()).restore();
    }
  });
  m.def("add_python_rows", &add_python_rows);
  m.def(
      "register_python", [](const std::string& variant, const py::object& make) { python_objects()[variant] = make; },
      py::arg("variant"), py::arg("make"));
  fork_with_python();
}

}  // namespace solenoid
