#include "controllers/factory.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/campaign/run_in_progress.hpp"
#include "experiments/profile/profiling.hpp"
#include "experiments/profile/record.hpp"
#include "experiments/python/instance_arrays.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

using Size = py::ssize_t;

Size signed_size(std::size_t size) { return static_cast<Size>(size); }

/// The bytes of a file that can be read back.
std::string checked_bytes(const py::dict& from) {
  std::string bytes = instance_bytes(set_of(from));
  parse_instances(bytes, "instances");
  return bytes;
}

/// Has records pose what a variant asks, whoever they were recorded of.
class Adapter {
 public:
  Adapter(const std::vector<RecordedMotion>& motions, const VariantInstances& of, const VariantConfig& variant)
      : motions_(motions), of_(of), from_(of.config), to_(variant), name_(variant.name) {
    const auto differ = [&](const std::string& what, const auto& theirs, const auto& ours) {
      if (theirs != ours)
        throw ConfigError(fmt::format("variant '{}': {} {} (allowed: {}, as the instances of '{}' have)", name_, what,
                                      theirs, ours, of.name));
    };
    differ("system", to_.system->name(), from_.system->name());
    differ("states", to_.sizes.states, from_.sizes.states);
    differ("outputs", to_.sizes.outputs, from_.sizes.outputs);
    differ("switches", fmt::format("{}", fmt::join(to_.switches, ", ")),
           fmt::format("{}", fmt::join(from_.switches, ", ")));
    differ("tick in s", to_.tick_s, from_.tick_s);
  }

  void adapt(InstanceRecord& r, std::size_t index) const {
    const RecordedMotion& motion = motions_[r.motion];
    if (!r.load.empty() && r.load.size() != to_.sizes.load)
      refuse(index, fmt::format("a load of {} numbers (allowed: {})", r.load.size(), to_.sizes.load));
    // The set-points first: whether they are the motion's shows in both together.
    const bool window = is_window(r, motion);
    extend(
        r.setpoint, to_.setpoints, window, index,
        [&](std::size_t i) { return motion.rows[(r.start - 1) * motion.width + i]; }, motion, r.start - 1);
    extend(
        r.reference, to_.steps, window, index,
        [&](std::size_t i) { return motion.rows[r.start * motion.width + i] + r.offset[i % motion.width]; }, motion,
        r.start);
    if (to_.blocks == from_.blocks && to_.modes == from_.modes && to_.sizes.inputs == from_.sizes.inputs) return;
    r.warm_modes.assign(to_.blocks.size(), 0);
    r.warm_continuous.assign(to_.blocks.size() * to_.sizes.inputs, 0.0);
    r.warm_weights.clear();
    r.warm_owed = {};
  }

 private:
  [[noreturn]] void refuse(std::size_t index, const std::string& problem) const {
    throw ConfigError(fmt::format("variant '{}': instance {} of '{}' has {}", name_, index, of_.name, problem));
  }

  /// Cuts rows to a horizon, or goes on with those of the motion from its row `start` on.
  template <class At>
  void extend(std::vector<double>& rows, std::size_t steps, bool window, std::size_t index, At at,
              const RecordedMotion& motion, std::size_t start) const {
    const std::size_t have = rows.size() / motion.width;
    if (steps > have && (!window || start + steps > motion.size()))
      refuse(index, fmt::format("{} rows of a reference (allowed: {}, the variant's horizon)", have, steps));
    for (std::size_t i = rows.size(); i < steps * motion.width; ++i) rows.push_back(at(i));
    rows.resize(steps * motion.width);
  }

  const std::vector<RecordedMotion>& motions_;
  const VariantInstances& of_;
  Layout from_, to_;
  std::string name_;
};

/// How each solve ended.
struct Solved {
  SolveReport report;
  std::vector<int> modes;
  std::vector<double> inputs;
};

/// Each record through the variant's solver, from its warm start; fewer if interrupted.
std::vector<Solved> solve_all(const InstanceSet& set, const VariantConfig& variant, std::optional<double> deadline_s) {
  const VariantInstances& of = set.variants.front();
  std::vector<std::unique_ptr<AnyProblem>> problems;
  for (const RecordedMotion& motion : set.motions)
    problems.push_back(system_of(variant).problem(told(variant, motion)));
  const AnySolverPtr solver = make_solver(variant);
  solver->prepare(*problems.front());
  const auto plan = problems.front()->new_plan();
  // A problem keeps the load of the instance before: where only some have one, the others get the variant's own.
  const bool loaded = std::ranges::any_of(of.records, [](const InstanceRecord& r) { return !r.load.empty(); });
  std::vector<std::vector<double>> usual;
  for (const auto& problem : problems) {
    usual.emplace_back(problem->sizes().load);
    problem->get_load(usual.back());
  }
  const ScenarioConfig none{};
  const RunInProgress run(none);  // hears what a solver in Python raises
  std::vector<Solved> solved;
  for (const InstanceRecord& r : of.records) {
    if (InterruptGuard::raised()) break;
    AnyProblem& problem = *problems[r.motion];
    if (loaded && r.load.empty()) problem.set_load(usual[r.motion]);
    pose(set, r, problem, *plan);
    const Deadline deadline = deadline_s ? Deadline::after_s(*deadline_s) : Deadline::never();
    const SolveReport report = solver->solve(problem, *plan, deadline);
    run.require_sound();
    solved.push_back({report, plan->modes, inputs_of(*plan)});
  }
  return solved;
}

/// Solves the instances in `arrays` by a variant; none: the one they were recorded of.
py::dict solve(const py::list& motions, const py::dict& arrays, const std::optional<VariantConfig>& chosen,
               std::optional<double> deadline_s) {
  InstanceSet set;
  set.motions = motions_of(motions);
  set.variants.push_back(variant_of(arrays));
  VariantInstances& of = set.variants.front();
  of.records = records_of(arrays, set.motions, of, false);
  const VariantConfig variant = chosen.value_or(of.config);
  if (variant.is_feedback_law())
    throw ConfigError(
        fmt::format("variant '{}': {} is a law (allowed: a variant with a solver)", variant.name, variant.solver));
  if (set.motions.empty())
    throw ConfigError(fmt::format("instances of '{}': no motion (allowed: at least one)", of.name));
  const Adapter adapter(set.motions, of, variant);
  for (std::size_t i = 0; i < of.records.size(); ++i) adapter.adapt(of.records[i], i);
  const std::vector<Solved> all = [&] {
    try {
      return interruptible([&] { return solve_all(set, variant, deadline_s); });
    } catch (const std::invalid_argument& error) {
      throw ConfigError(fmt::format("variant '{}': {}", variant.name, error.what()));
    }
  }();
  if (all.size() < of.records.size()) raise_keyboard_interrupt();
  const Layout at(variant);
  const Size n = signed_size(all.size()), blocks = signed_size(at.blocks.size()), inputs = signed_size(at.sizes.inputs);
  py::dict result;
  py::list statuses;
  for (const Solved& s : all) statuses.append(to_string(s.report.status));
  result["statuses"] = statuses;
  result["costs"] = filled<double>({n}, [&](std::size_t i) { return all[i].report.cost; });
  result["bounds"] = filled<double>({n}, [&](std::size_t i) { return all[i].report.bound; });
  result["nodes"] = filled<std::int64_t>({n}, [&](std::size_t i) { return all[i].report.nodes; });
  result["switches"] = filled<std::int64_t>({n}, [&](std::size_t i) { return all[i].report.switches; });
  result["times_us"] = filled<double>({n}, [&](std::size_t i) { return all[i].report.time_us; });
  const auto width = static_cast<std::size_t>(blocks), inputs_width = static_cast<std::size_t>(blocks * inputs);
  result["modes"] = filled<std::int64_t>({n, blocks}, [&](std::size_t i) { return all[i / width].modes[i % width]; });
  result["inputs"] = filled<double>({n, blocks, inputs},
                                    [&](std::size_t i) { return all[i / inputs_width].inputs[i % inputs_width]; });
  result["mode_names"] = at.modes;
  return result;
}

py::dict record(const CampaignSource& source, std::size_t per_variant) {
  const Campaign campaign = source.read();
  bool raised = false;
  const InstanceSet set = interruptible([&] {
    InstanceSet recorded = record_instances(campaign, per_variant, InterruptGuard::raised);
    raised = InterruptGuard::raised();
    return recorded;
  });
  if (raised) raise_keyboard_interrupt();
  return dictionary_of(set);
}

}  // namespace

void bind_instances(py::module_& m) {
  m.def(
      "read_instances", [](const std::string& path) { return dictionary_of(instances_from(path)); }, py::arg("path"));
  m.def(
      "instance_bytes", [](const py::dict& set) { return py::bytes(checked_bytes(set)); }, py::arg("set"));
  m.def(
      "write_instances",
      [](const std::string& path, const py::dict& set) { write_file_atomically(path, checked_bytes(set)); },
      py::arg("path"), py::arg("set"));
  m.def("solve_instances", &solve, py::arg("motions"), py::arg("arrays"), py::arg("variant"), py::arg("deadline_s"));
  m.def(
      "record_instances",
      [](const std::string& path, const std::string& text, const std::vector<std::string>& variants,
         const std::vector<std::string>& scenarios, std::size_t per_variant) {
        return record({path, text, {variants, scenarios}}, per_variant);
      },
      py::arg("path"), py::arg("text"), py::arg("variants"), py::arg("scenarios"), py::arg("per_variant"));
}

}  // namespace solenoid
