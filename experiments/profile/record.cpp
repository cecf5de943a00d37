#include "experiments/profile/record.hpp"

#include "controllers/instances/recording_solver.hpp"
#include "controllers/networks.hpp"
#include "controllers/variant_keys.hpp"
#include "core/config/reader.hpp"
#include "experiments/campaign/library.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/rig/replay_run.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include <fmt/format.h>
#include <toml++/toml.h>

namespace solenoid {
namespace {

/// A reference this close to a window of the motion is that window, of the motion's values or, below 1, absolute:
/// rounding, no more.
constexpr double window_tolerance = 1e-12;

bool differ(double value, double expected) {
  return !(std::abs(value - expected) <= window_tolerance * std::max(1.0, std::abs(expected)));
}

/// Whether a key of a variant may name a file in place of a table: those that the system reads by hand. Others, such as
/// the summary, are texts whatever they end with.
bool may_be_file_of_table(const VariantConfig& v, std::string_view key) {
  const VariantKey* known = find_variant_key(system_of(v), key);
  return !known || std::holds_alternative<std::monostate>(known->member);
}

/// The variant's table as the campaign has it, files of tables replaced by their content, with the sampling that it
/// had: a set has no scenarios to say one.
std::string variant_toml(const Campaign& campaign, const VariantConfig& v) {
  toml::table table = *campaign.resolved->root()["variant"][v.name].as_table();
  toml::table timing;
  if (v.own_timing.tick_ms) timing.insert("tick_ms", *v.own_timing.tick_ms);
  if (v.own_timing.period_ms) timing.insert("period_ms", *v.own_timing.period_ms);
  if (!timing.empty()) table.insert_or_assign("timing", timing);
  for (auto&& [key, node] : toml::table(table))
    if (const auto file = node.value<std::string>();
        file && file->ends_with(".toml") && may_be_file_of_table(v, key.str()))
      if (const auto text = campaign.resolved->linked(*file)) table.insert_or_assign(key, toml::parse(*text));
  return toml_text(table);
}

/// Rows of a task's motion, to `beyond` steps after its end: enough for any problem.
RecordedMotion motion_of(const ScenarioConfig& scenario, double tick_s, int beyond) {
  const std::vector<OutputSource>& outputs = system_of(scenario).description().outputs;
  RecordedMotion s{scenario.name, scenario.setting, outputs.size(), {}};
  const auto rows = static_cast<std::uint32_t>(std::llround(scenario.duration_s / tick_s) + beyond);
  for (std::uint32_t k = 0; k < rows; ++k) {
    const ReferenceSample r = scenario.trajectory.at(k * tick_s);
    for (const OutputSource& o : outputs) s.rows.push_back(r.axis[o.axis].derivative(o.derivative));
  }
  return s;
}

using Offset = std::array<double, max_states>;

/// Whether `rows` are the motion's from row `start` on, each raised by the offset.
bool is_window(std::span<const double> rows, const RecordedMotion& s, std::uint32_t start, const Offset& offset) {
  if (start + rows.size() / s.width > s.size()) return false;
  const std::span<const double> motion = std::span(s.rows).subspan(start * s.width);
  for (std::size_t k = 0; k < rows.size(); ++k)
    if (differ(rows[k], motion[k] + offset[k % s.width])) return false;
  return true;
}

/// Sets start and offset of the window that the posed rows are, or keeps the rows. `outputs`: only values, not their
/// rates, have an offset.
void keep_reference(const PosedInstance& posed, const RecordedMotion& s, const std::vector<OutputSource>& outputs,
                    std::uint32_t ticks_per_period, InstanceRecord& r) {
  const auto tick = static_cast<std::uint32_t>(posed.solve) * ticks_per_period;
  const std::span<const double> reference = posed.problem->reference_values(),
                                setpoint = posed.problem->setpoint_values();
  for (std::uint32_t start = tick + 1; start <= tick + 1 + ticks_per_period && start < s.size(); ++start) {
    Offset offset{};
    for (std::size_t i = 0; i < outputs.size(); ++i) {
      const double value = reference[i], there = s.row(start)[i];
      if (outputs[i].derivative == 0 && differ(value, there)) offset[i] = value - there;
    }
    if (!is_window(reference, s, start, offset) || !is_window(setpoint, s, start - 1, {})) continue;
    r.start = start;
    r.offset = offset;
    return;
  }
  r.reference.assign(reference.begin(), reference.end());
  r.setpoint.assign(setpoint.begin(), setpoint.end());
}

/// What the model takes over beyond its state.
std::vector<double> load_of(const AnyProblem& problem) {
  std::vector<double> load(problem.sizes().load);
  problem.get_load(load);
  return load;
}

/// Turns what a run posed into records and solves each once for its plan; instances without a plan are left out.
void keep(const std::vector<PosedInstance>& posed, std::uint32_t motion, const InstanceSet& set,
          VariantInstances& variant) {
  const auto problem = system_of(variant.config).problem(told(variant.config, set.motions[motion]));
  // Whether an estimator changed what the model believes of its load in any solve: every record then says so, since a
  // problem keeps the load of the instance before.
  const std::vector<double> usual = load_of(*problem);
  const bool with_load =
      std::ranges::any_of(posed, [&](const PosedInstance& p) { return load_of(*p.problem) != usual; });
  const auto solver = make_solver(variant.config);
  solver->prepare(*problem);
  const auto plan = problem->new_plan();
  for (const PosedInstance& p : posed) {
    if (p.solve == 0 && &p != &posed.front()) break;  // the run posed no more
    InstanceRecord r;
    r.motion = motion;
    std::ranges::copy(p.problem->initial_values(), r.initial.begin());
    if (with_load) r.load = load_of(*p.problem);
    r.lines = p.problem->lines;
    r.warm_modes = p.warm_start->modes;
    r.warm_continuous = inputs_of(*p.warm_start);
    if (p.warm_start->relaxation.known) {
      r.warm_weights = p.warm_start->relaxation.weights;
      r.warm_owed = p.warm_start->relaxation.owed.front();
    }
    keep_reference(p, set.motions[motion], system_of(variant.config).description().outputs,
                   static_cast<std::uint32_t>(variant.config.timing.ticks_per_period), r);
    pose(set, r, *problem, *plan);
    const SolveReport report = solver->solve(*problem, *plan, Deadline::never());
    if (!usable(report.status)) continue;
    r.plan_modes = plan->modes;
    r.plan_continuous = inputs_of(*plan);
    r.plan_cost = report.cost;
    r.plan_status = report.status;
    variant.records.push_back(std::move(r));
  }
}

/// The variant as it runs in the campaign's scenarios. The set's motions are in ticks, so every variant must have the
/// same; and a variant's problems are of one period.
VariantConfig timed_alike(const Campaign& campaign, const VariantConfig& v) {
  const ScenarioConfig& begin = campaign.scenarios.front();
  const VariantConfig first = timed(campaign.variants.front(), begin.timing, begin.name);
  VariantConfig own = timed(v, begin.timing, begin.name);
  own.own_timing = said_timing(v, begin.timing);
  for (const ScenarioConfig& s : campaign.scenarios) {
    const Timing here = timed(v, s.timing, s.name).timing;
    if (here.tick_s != first.timing.tick_s)
      throw ConfigError(
          fmt::format("variant '{}' in scenario '{}' has ticks of {:g} ms, '{}' of {:g} ms (allowed: "
                      "instances of one tick)",
                      v.name, s.name, 1e3 * here.tick_s, first.name, 1e3 * first.timing.tick_s));
    if (here != own.timing)
      throw ConfigError(
          fmt::format("variant '{}' has periods of {:g} ms in scenario '{}', of {:g} ms in '{}' (allowed: instances of "
                      "one period)",
                      v.name, 1e3 * here.period_s(), s.name, 1e3 * own.timing.period_s(), begin.name));
  }
  return own;
}

/// An empty set with the motions of a campaign.
InstanceSet with_motions(const Campaign& campaign) {
  InstanceSet set;
  int steps = 0, period = 0;
  double tick_s = 0.0;  // every variant's
  for (const VariantConfig& v : campaign.variants) {
    const Timing timing = timed_alike(campaign, v).timing;
    steps = std::max(steps, v.horizon.steps);
    period = std::max(period, timing.ticks_per_period);
    tick_s = timing.tick_s;
  }
  for (const ScenarioConfig& s : campaign.scenarios) set.motions.push_back(motion_of(s, tick_s, steps + period + 1));
  return set;
}

/// A variant without instances yet. A plan that a clock cut short is nobody's yardstick: it has no deadline.
VariantInstances& add_variant(const Campaign& campaign, const VariantConfig& chosen, InstanceSet& set) {
  VariantConfig v = timed_alike(campaign, chosen);
  v.deadline_ms.reset();
  return set.variants.emplace_back(VariantInstances{v.name, variant_toml(campaign, v), v, {}});
}

/// `run(decorate)` is one closed loop of `duration_s`: keeps about `count` of its problems.
template <class Run>
void keep_run(double duration_s, std::size_t count, std::uint32_t motion, const InstanceSet& set,
              VariantInstances& variant, Run run) {
  const auto periods = static_cast<std::size_t>(std::ceil(duration_s / variant.config.timing.period_s() - 1e-9));
  const std::size_t every = std::max<std::size_t>(1, periods / count);
  const std::size_t capacity = std::min(count, (periods + every - 1) / every);
  std::vector<PosedInstance> posed;
  run([&](AnySolverPtr solver) {
    return std::make_unique<RecordingSolver>(std::move(solver), posed, capacity, static_cast<std::int64_t>(every));
  });
  keep(posed, motion, set, variant);
}

}  // namespace

void require_carried(const Campaign& campaign) {
  for (const VariantConfig& v : campaign.variants)
    if (is_network_file(v.learned.network))
      throw ConfigError(
          fmt::format("--record: variant '{}' has learned.network = '{}', a file that problems do not carry along "
                      "(allowed: variants without a network, or with a shipped one)",
                      v.name, v.learned.network));
}

InstanceSet record_instances(const Campaign& campaign, std::size_t per_variant, const Interrupted& interrupted) {
  InstanceSet set = with_motions(campaign);
  const std::size_t runs = campaign.scenarios.size() * campaign.seeds.size();
  const std::size_t per_run = std::max<std::size_t>(1, per_variant / runs);
  for (const VariantConfig& v : campaign.variants) {
    VariantInstances& variant = add_variant(campaign, v, set);
    for (std::size_t s = 0; s < campaign.scenarios.size(); ++s)
      for (const std::uint64_t seed : campaign.seeds) {
        if (interrupted && interrupted()) return set;
        keep_run(campaign.scenarios[s].duration_s, per_run, static_cast<std::uint32_t>(s), set, variant,
                 [&](const SolverDecorator& r) { simulate(variant.config, campaign.scenarios[s], seed, r); });
      }
  }
  return set;
}

InstanceSet record_instances(const RecordedRun& run, const std::vector<std::string>& variants, std::size_t per_variant,
                             const Interrupted& interrupted) {
  const Campaign campaign = recorded_campaign(run, variants);
  const RecordedTask task = recorded_task(run);
  InstanceSet set = with_motions(campaign);
  for (const VariantConfig& v : campaign.variants) {
    VariantInstances& variant = add_variant(campaign, v, set);
    keep_run(static_cast<double>(run.ticks.size()) * task.variant.timing.tick_s, per_variant, 0, set, variant,
             [&](const SolverDecorator& r) { replay_other(run, task, variant.config, r, interrupted); });
  }
  return set;
}

}  // namespace solenoid
