#include "core/config/reader.hpp"
#include "experiments/base/build_info.hpp"
#include "experiments/python/bindings.hpp"

namespace solenoid {

PYBIND11_MODULE(_core, m) {
  m.attr("__version__") = build_info().version;
  py::register_exception<ConfigError>(m, "ConfigError", PyExc_ValueError);
  bind_configuration(m);
  bind_runs(m);
  bind_stepping(m);
  bind_problems(m);
  bind_python_rows(m);
  bind_python_laws(m);
  bind_python_solvers(m);
  bind_comparison(m);
  bind_data(m);
  bind_instances(m);
}

}  // namespace solenoid
