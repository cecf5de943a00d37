#pragma once

#include "controllers/any_solver.hpp"
#include "controllers/variant.hpp"
#include "core/reference/motion.hpp"
#include "core/rt/controller.hpp"

#include <functional>
#include <memory>

namespace solenoid {

/// Laws and solvers that are written in Python are there in one Python process. Which of them a variant has, its name
/// says; for all of them systems have one law and one solver. Other programs know these two so that they can read
/// results, whose campaign asks for them as for a plug-in; they make none.
inline constexpr const char* python_plugin = "python";
inline constexpr const char* python_law = "python_law";
inline constexpr const char* python_solver = "python_solver";

/// How the process makes them; none: it does not.
struct PythonMakers {
  std::function<std::unique_ptr<Controller>(const VariantConfig& variant, const Motion& reference)> law;
  std::function<AnySolverPtr(const VariantConfig& variant)> solver;
};
PythonMakers& python_makers();

/// To every system there is that lacks them.
void add_python_rows();

/// Whether a variant's law or solver is written in Python.
bool written_in_python(const VariantConfig& variant);
/// Whether it can run on hardware: no solver that allocates, and nothing in Python.
bool is_real_time(const VariantConfig& variant);

}  // namespace solenoid
