#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/result.hpp"
#include "experiments/campaign/run_campaign.hpp"
#include "experiments/ledger/ledger.hpp"
#include "experiments/profile/profiling.hpp"
#include "experiments/python/interruptible.hpp"
#include "experiments/report/campaign_figures.hpp"
#include "experiments/report/comparison.hpp"
#include "experiments/report/page.hpp"
#include "experiments/report/results.hpp"
#include "experiments/tune/tune_report.hpp"

#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Names = std::vector<std::string>;

/// The problems in a file's bytes; none: those of a file, or the shipped ones.
InstanceSet instances_of(const std::string& path, const std::optional<py::bytes>& bytes) {
  return bytes ? parse_instances(std::string_view(*bytes), "instances") : instances_from(path);
}

/// What `solenoid compare --format json` prints, and the folder that everything was written into, if any was asked for.
py::tuple campaign_of(const CampaignSource& source, const std::optional<std::string>& out, int jobs,
                      double tick_limit_s) {
  const Campaign campaign = source.read();
  if (!out) {
    const auto records = [&] {
      const py::gil_scoped_release released;
      return run_in_processes(campaign, jobs, tick_limit_s);
    }();
    if (!records) raise_keyboard_interrupt();
    return py::make_tuple(runs_json(*records), py::none());
  }
  const CampaignResult result = [&] {
    const py::gil_scoped_release released;
    return run_campaign(campaign, {*out, jobs, tick_limit_s});
  }();
  if (result.interrupted) raise_keyboard_interrupt();
  return py::make_tuple(runs_json(result.records()), result.folder);
}

/// Each instance's times, rows of equal length: least of all passes, least with phase timing, then its phases.
py::dict solves_of(const VariantProfile& p) {
  const auto n = static_cast<py::ssize_t>(p.solve_us.size()), phases = static_cast<py::ssize_t>(phase_count);
  py::dict solves;
  solves["variant"] = p.name;
  solves["time_us"] = filled<double>({n}, [&](std::size_t i) { return p.solve_us[i]; });
  solves["timed_us"] = filled<double>({n}, [&](std::size_t i) { return p.samples[i].time_us; });
  solves["phases_us"] =
      filled<double>({n, phases}, [&](std::size_t i) { return p.samples[i / phase_count].phase_us[i % phase_count]; });
  solves["nodes"] = filled<std::int64_t>({n}, [&](std::size_t i) { return p.solve_nodes[i]; });
  return solves;
}

/// What `solenoid profile --format json` prints, and every solve.
py::tuple profile_of(const CampaignSource& source, const std::string& instances, const std::optional<py::bytes>& set,
                     ProfileTask task) {
  task.campaign = source.path;
  task.document = source.document();
  task.selection = source.selection;
  task.instances = instances;
  if (set) task.set = std::make_shared<const InstanceSet>(instances_of({}, set));
  Names problems;
  task.tell = [&](const std::string& line) {
    if (line.starts_with("solenoid: ")) problems.push_back(line.substr(10));
  };
  task.options.interrupted = InterruptGuard::raised;
  const std::optional<ProfileResult> result = interruptible([&] { return profile(task); });
  if (!result) raise_keyboard_interrupt();
  py::list solves;
  for (const VariantProfile& p : result->profile.variants) solves.append(solves_of(p));
  return py::make_tuple(result_of(*result).json(), solves, problems);
}

TuneAim aim_of(const std::string& objective) {
  if (objective != "rmse" && objective != "step")
    throw ConfigError(fmt::format("objective: '{}' is not known (allowed: rmse, step)", objective));
  return objective == "step" ? TuneAim::step : TuneAim::rmse;
}

/// What `solenoid tune --format json` prints, and the folder that everything was written into.
py::tuple tuning_of(const CampaignSource& source, TuneSettings settings, const Names& free,
                    const std::optional<py::function>& progress) {
  settings.campaign = source.path;
  settings.document = source.document();
  for (const std::string& text : free) settings.free.push_back(parse_free_parameter(text));
  if (settings.out.empty()) settings.out = new_tuning_folder(settings.variant);
  const TuneResult result = interruptible([&] {
    TuneResult found = tune(settings, [&](const TuneResult& so_far) {
      const py::gil_scoped_acquire acquired;
      if (progress) (*progress)(tune_progress(settings, so_far));
    });
    if (!found.steps.empty()) draw_history(found);
    return found;
  });
  if (result.interrupted()) raise_keyboard_interrupt();
  return py::make_tuple(result_of(settings, result).json(), result.folder);
}

/// Every state and method, a row each, as columns.
py::dict entries_of(const std::vector<LedgerOfVariant>& ledger) {
  struct Row {
    const LedgerOfVariant* variant;
    const LedgerState* state;
    LedgerMethod method;
    const LedgerEntry& entry() const { return state->of(method); }
  };
  std::vector<Row> rows;
  for (const LedgerOfVariant& variant : ledger)
    for (const LedgerState& state : variant.states)
      for (std::size_t m = 0; m < ledger_methods; ++m)
        if (state.entries[m].tried) rows.push_back({&variant, &state, static_cast<LedgerMethod>(m)});
  const auto texts = [&](auto of) {
    py::list all;
    for (const Row& row : rows) all.append(of(row));
    return all;
  };
  const auto numbers = [&]<class T>(T, auto of) {
    return filled<T>({static_cast<py::ssize_t>(rows.size())}, [&](std::size_t i) { return of(rows[i]); });
  };
  py::dict columns;
  columns["variant"] = texts([](const Row& r) { return r.variant->name; });
  columns["record"] = numbers(std::int64_t{}, [](const Row& r) { return r.state->record; });
  columns["method"] = texts([](const Row& r) { return to_string(r.method); });
  columns["status"] = texts([](const Row& r) { return to_string(r.entry().status); });
  columns["cost"] = numbers(double{}, [](const Row& r) { return r.entry().cost; });
  columns["bound"] = numbers(double{}, [](const Row& r) { return r.state->bound; });
  columns["gap"] = numbers(double{}, [](const Row& r) { return r.state->gap(r.method); });
  columns["time_us"] = numbers(double{}, [](const Row& r) { return r.entry().time_us; });
  return columns;
}

/// What `solenoid ledger --format json` prints, and every entry.
py::tuple ledger_of(const std::string& path, const std::optional<py::bytes>& bytes, const Names& variants,
                    std::size_t states, std::size_t bonmin_states, double bonmin_limit_s) {
  InstanceSet set = instances_of(path, bytes);
  select_variants(variants, set);
  bool raised = false;
  const auto kept = interruptible([&] {
    LedgerOptions options;
    options.states = states;
    options.bonmin_states = bonmin_states;
    options.bonmin_limit_s = bonmin_limit_s;
    options.stop = InterruptGuard::raised;
    auto ledger = keep_ledger(set, options);
    raised = InterruptGuard::raised();
    return ledger;
  });
  if (raised) raise_keyboard_interrupt();
  return py::make_tuple(result_of(kept).json(), entries_of(kept));
}

Names reasons(const Results& results) {
  Names lines;
  for (const LeftOut& run : results.left_out) lines.push_back(run.reason);
  return lines;
}

/// Writes a folder's report; what was left out of it.
Names write_report(const std::string& folder, const std::string& out, bool overview_only) {
  const py::gil_scoped_release released;
  Results results = read_results(folder);
  write_file_atomically(out, report_of(results, !overview_only));
  return reasons(results);
}

Names write_figure(const std::string& folder, const std::string& figure, const std::string& path) {
  const py::gil_scoped_release released;
  if (!path.ends_with(".svg") && !path.ends_with(".png"))
    throw ConfigError(fmt::format("'{}' (allowed: a file ending in .svg or .png)", path));
  Results results = read_results(folder);
  draw_report_figure(results, figure, path, path.ends_with(".svg") ? FigureFormat::svg : FigureFormat::png);
  return reasons(results);
}

/// A run over time: samples of each signal under its name. None: the folder has no curves of it.
py::object curves_of(Results& results, const std::string& id) {
  const auto trace = [&] {
    const py::gil_scoped_release released;
    auto read = read_trace(results, results.run(id));
    return read ? std::optional(with_derived(std::move(*read))) : std::nullopt;
  }();
  if (!trace) return py::none();
  const auto samples = static_cast<py::ssize_t>(trace->ticks.size());
  py::dict curves, units;
  curves["time_s"] =
      filled<double>({samples}, [&](std::size_t i) { return static_cast<double>(trace->ticks[i]) * trace->tick_s; });
  for (const Trace::Signal& signal : trace->signals) {
    curves[py::str(signal.name)] = filled<double>({samples}, [&](std::size_t i) { return signal.values[i]; });
    units[py::str(signal.name)] = signal.unit;
  }
  return py::make_tuple(curves, units);
}

void bind_results(py::module_& m) {
  py::class_<Results>(m, "ResultsFolder")
      .def(py::init([](const std::string& folder) {
             const py::gil_scoped_release released;
             return read_results(folder, Listing::everything());
           }),
           py::arg("folder"))
      .def_property_readonly("manifest", [](const Results& r) { return r.manifest.dump(); })
      .def_property_readonly("configuration", [](const Results& r) { return r.campaign.resolved_toml; })
      .def_property_readonly("ids",
                             [](const Results& r) {
                               Names ids;
                               for (const StoredRun& run : r.runs) ids.push_back(run.id);
                               return ids;
                             })
      .def_property_readonly("records",
                             [](const Results& r) {
                               std::vector<RunRecord> records;
                               for (const StoredRun& run : r.runs) records.push_back(run.record);
                               return runs_json(records);
                             })
      .def_property_readonly("left_out", &reasons)
      .def("curves", &curves_of, py::arg("id"));
  m.def("write_report", &write_report, py::arg("folder"), py::arg("out"), py::arg("overview_only"));
  m.def("write_figure", &write_figure, py::arg("folder"), py::arg("figure"), py::arg("path"));
}

}  // namespace

void bind_data(py::module_& m) {
  m.def("first_system", [] { return systems().front()->name(); });
  m.def(
      "campaign",
      [](const std::string& path, const std::string& text, const Names& variants, const Names& scenarios,
         const std::string& model, const std::optional<std::string>& out, int jobs, double tick_limit_s) {
        return campaign_of({path, text, {variants, scenarios, model}}, out, jobs, tick_limit_s);
      },
      py::arg("path"), py::arg("text"), py::arg("variants"), py::arg("scenarios"), py::arg("model"), py::arg("out"),
      py::arg("jobs"), py::arg("tick_limit_s"));
  m.def(
      "profile",
      [](const std::string& path, const std::string& text, const Names& variants, const Names& scenarios,
         const std::string& instances, const std::optional<py::bytes>& set, const std::string& record,
         std::size_t per_variant, int core, int passes, double limit_ms, const std::vector<double>& budgets_ms,
         const std::string& save, const std::string& against, double threshold) {
        ProfileTask task;
        task.record = record;
        task.per_variant = per_variant;
        task.options.core = core;
        task.options.passes = passes;
        task.options.limit_ms = limit_ms;
        task.budgets_ms = budgets_ms;
        task.save = save;
        task.against = against;
        task.threshold = threshold;
        return profile_of({path, text, {variants, scenarios}}, instances, set, std::move(task));
      },
      py::arg("path"), py::arg("text"), py::arg("variants"), py::arg("scenarios"), py::arg("instances"), py::arg("set"),
      py::arg("record"), py::arg("per_variant"), py::arg("core"), py::arg("passes"), py::arg("limit_ms"),
      py::arg("budgets_ms"), py::arg("save"), py::arg("against"), py::arg("threshold"));
  m.def(
      "tune",
      [](const std::string& path, const std::string& text, const std::string& variant, const Names& free,
         const std::string& objective, const std::string& algorithm, int evaluations, int patience,
         const std::map<std::string, double>& limits, int jobs, const std::string& out,
         const std::optional<py::function>& progress) {
        TuneSettings settings;
        settings.variant = variant;
        settings.aim = aim_of(objective);
        settings.algorithm = algorithm;
        settings.evaluations = evaluations;
        settings.patience = patience;
        settings.limits = limits;
        settings.jobs = jobs;
        settings.out = out;
        return tuning_of({path, text}, std::move(settings), free, progress);
      },
      py::arg("path"), py::arg("text"), py::arg("variant"), py::arg("free"), py::arg("objective"), py::arg("algorithm"),
      py::arg("evaluations"), py::arg("patience"), py::arg("limits"), py::arg("jobs"), py::arg("out"),
      py::arg("progress"));
  m.def("ledger", &ledger_of, py::arg("instances"), py::arg("set"), py::arg("variants"), py::arg("states"),
        py::arg("bonmin_states"), py::arg("bonmin_limit_s"));
  m.attr("phases") = py::cast(std::vector<std::string>(phase_names.begin(), phase_names.end()));
  bind_results(m);
}

}  // namespace solenoid
