#include "experiments/plugin/python_rows.hpp"

#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "experiments/plugin/load_plugin.hpp"

#include <utility>

#include <fmt/format.h>

namespace solenoid {
namespace {

ConfigError not_here(const VariantConfig& variant, const char* what) {
  return ConfigError(
      fmt::format("variant '{}' has a {} in Python, which is there in the Python process that made it alone (allowed: "
                  "solenoid.compare and solenoid.simulate in that one)",
                  variant.name, what));
}

std::unique_ptr<Controller> make_python_law(const VariantConfig& variant, const Motion& reference) {
  if (!python_makers().law) throw not_here(variant, "law");
  return python_makers().law(variant, reference);
}

AnySolverPtr make_python_solver(const VariantConfig& variant) {
  if (!python_makers().solver) throw not_here(variant, "solver");
  return python_makers().solver(variant);
}

}  // namespace

PythonMakers& python_makers() {
  static PythonMakers makers;
  return makers;
}

void add_python_rows() {
  for (const System* listed : systems()) {
    System& system = system_to_extend(listed->name());
    if (find_row(system.laws(), python_law)) continue;
    system.add(LawRow{.name = python_law,
                      .summary = "a law in Python: not real time",
                      .groups = {},
                      .modes = {},
                      .make = make_python_law});
    system.add(SolverRow{.name = python_solver,
                         .summary = "a solver in Python",
                         .real_time = false,
                         .instead = "branch_and_bound, or cia for a joint plan",
                         .chooses_continuous = true,
                         .groups = {"planning"},
                         .make = SolverMakers::of_any(make_python_solver)});
  }
  LoadedPlugin python{python_plugin, "", ""};
  for (const System* system : systems())
    for (const char* row : {python_law, python_solver}) python.adds.insert(fmt::format("{}/{}", system->name(), row));
  note_plugin(std::move(python));
}

bool written_in_python(const VariantConfig& variant) {
  return variant.solver == python_law || variant.solver == python_solver;
}

bool is_real_time(const VariantConfig& variant) {
  const SolverRow* row = find_row(system_of(variant).solvers(), variant.solver);
  return !written_in_python(variant) && (!row || row->real_time);
}

}  // namespace solenoid
