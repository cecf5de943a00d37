#include "experiments/profile/record.hpp"

#include "controllers/instances/recording_solver.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
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

/// A reference this close to a window of the motion is that window [m, m/s]: rounding, no more.
constexpr double window_tolerance = 1e-12;

/// The variant's table as the campaign has it, a file of parameters replaced by its content.
std::string variant_toml(const Campaign& campaign, const std::string& name) {
  toml::table table = *campaign.resolved->root()["variant"][name].as_table();
  if (const auto file = table["model"].value<std::string>(); file && file->ends_with(".toml"))
    table.insert_or_assign("model", toml::parse(campaign.resolved->linked(*file).value()));
  return toml_text(table);
}

/// Rows of a task's motion, enough for any problem of these sizes.
RecordedMotion motion_of(const ScenarioConfig& scenario, const Timing& timing, int horizon_steps) {
  RecordedMotion s{scenario.name, scenario.plane, {}};
  const auto ticks = timing.ticks_in(scenario.duration_s);
  const auto rows = static_cast<std::uint32_t>(ticks + horizon_steps + timing.ticks_per_period + 1);
  for (std::uint32_t k = 0; k < rows; ++k) {
    const MotionSample r = scenario.trajectory.at(k * timing.tick_s).axis[0];
    s.rows.push_back({r.value, r.rate});
  }
  return s;
}

template <class Row>
bool is_window(const std::vector<Row>& rows, const RecordedMotion& s, std::uint32_t start, double offset_m) {
  if (start + rows.size() > s.rows.size()) return false;
  for (std::size_t j = 0; j < rows.size(); ++j) {
    const auto& motion = s.rows[start + j];
    if (!(std::abs(rows[j][0] - (motion[0] + offset_m)) <= window_tolerance)) return false;
    if (!(std::abs(rows[j][1] - motion[1]) <= window_tolerance)) return false;
  }
  return true;
}

/// Sets start and offset of the window that the posed rows are, or keeps the rows.
template <HybridModel Model>
void keep_reference(const PosedInstance<Model>& posed, const RecordedMotion& s, std::uint32_t ticks_per_period,
                    InstanceRecord& r) {
  const auto tick = static_cast<std::uint32_t>(posed.solve) * ticks_per_period;
  for (std::uint32_t start = tick + 1; start <= tick + 1 + ticks_per_period && start < s.rows.size(); ++start) {
    const double shift = posed.reference[0][0] - s.rows[start][0];
    const double offset_m = std::abs(shift) <= window_tolerance ? 0.0 : shift;
    if (!is_window(posed.reference, s, start, offset_m) || !is_window(posed.setpoint, s, start - 1, 0.0)) continue;
    r.start = start;
    r.offset_m = offset_m;
    return;
  }
  r.reference = posed.reference;
  r.setpoint = posed.setpoint;
}

std::vector<double> forces(const std::vector<Vector<double, 1>>& continuous) {
  std::vector<double> all;
  for (const auto& u : continuous) all.push_back(u[0]);
  return all;
}

/// Keeps what a closed loop asks of its solver, whichever model that is over.
struct Recorder {
  std::size_t capacity;
  std::int64_t every;
  std::vector<PosedInstance<PneumaticActuator>> pneumatic{};
  std::vector<PosedInstance<PrestabilisedActuator>> prestabilised{};

  SolverDecorator decorate() {
    return decorator([this]<HybridModel M>(SolverPtr<M> solver) -> SolverPtr<M> {
      std::vector<PosedInstance<M>>* into = nullptr;
      if constexpr (HasFeedback<M>)
        into = &prestabilised;
      else
        into = &pneumatic;
      return std::make_unique<RecordingSolver<M>>(std::move(solver), *into, capacity, every);
    });
  }
};

/// What the prediction took from the estimator in each solve of a run; every record of a variant that uses it says so,
/// the nominal load under ideal sensing too, since a problem keeps the load of the instance before.
using Loads = std::vector<std::optional<InstanceRecord::Load>>;

Loads loads_of(std::span<const TickRecord> ticks, const VariantConfig& variant) {
  const UseEstimate& use = variant.use_estimate;
  Loads loads;
  for (const TickRecord& t : ticks) {
    if (!t.decision.solved) continue;
    loads.emplace_back();
    if (!use.payload && !use.disturbance) continue;
    const bool estimated = !t.sensors.ideal;
    loads.back() = {
        estimated && use.payload ? t.decision.detail.belief[payload_belief] : variant.nominal.payload_mass_kg,
        estimated && use.disturbance ? t.decision.detail.belief[disturbance_belief] : 0.0};
  }
  return loads;
}

/// Turns what a run posed into records and solves each once for its plan; instances without a plan are left out.
template <HybridModel Model>
void keep(const std::vector<PosedInstance<Model>>& posed, const Loads& loads, std::uint32_t motion,
          const InstanceSet& set, VariantInstances& variant) {
  Problem<Model> problem = make_problem<Model>(variant.config, set.motions[motion].plane);
  const auto solver = make_solver<Model>(variant.config);
  solver->prepare(problem);
  Plan<Model> plan(problem);
  for (const PosedInstance<Model>& p : posed) {
    if ((p.solve == 0 && &p != &posed.front()) || p.solve >= std::ssize(loads)) break;  // the run posed no more
    InstanceRecord r;
    r.motion = motion;
    r.initial = p.initial;
    r.load = loads[static_cast<std::size_t>(p.solve)];
    r.lines = p.lines;
    r.warm_modes = p.warm_start.modes;
    r.warm_continuous = forces(p.warm_start.continuous);
    if (p.warm_start.relaxation.known) {
      r.warm_weights = p.warm_start.relaxation.weights;
      r.warm_owed = p.warm_start.relaxation.owed.front();
    }
    keep_reference(p, set.motions[motion], static_cast<std::uint32_t>(variant.config.timing.ticks_per_period), r);
    pose(set, r, problem, plan);
    const SolveReport report = solver->solve(problem, plan, Deadline::never());
    if (!usable(report.status)) continue;
    r.plan_modes = plan.modes;
    r.plan_continuous = forces(plan.continuous);
    r.plan_cost = report.cost;
    r.plan_status = report.status;
    variant.records.push_back(std::move(r));
  }
}

/// The variant as it runs in a scenario, and the sampling that the set's motions have; they are in ticks, so every
/// variant must have it.
VariantConfig timed_alike(const Campaign& campaign, const VariantConfig& v, const ScenarioConfig& s) {
  const VariantConfig first = timed(campaign.variants.front(), campaign.scenarios.front().timing, s.name);
  VariantConfig own = timed(v, s.timing, s.name);
  if (own.timing != first.timing)
    throw ConfigError(
        fmt::format("variant '{}' in scenario '{}' has another sampling than '{}' (allowed: instances of one "
                    "tick and one period)",
                    v.name, s.name, first.name));
  return own;
}

/// An empty set with the motions of a campaign.
InstanceSet with_motions(const Campaign& campaign) {
  InstanceSet set;
  int steps = 0;
  for (const VariantConfig& v : campaign.variants) steps = std::max(steps, v.horizon.steps);
  for (const ScenarioConfig& s : campaign.scenarios)
    set.motions.push_back(motion_of(s, timed_alike(campaign, campaign.variants.front(), s).timing, steps));
  return set;
}

/// A variant without instances yet. A plan that a clock cut short is nobody's yardstick: it has no deadline.
VariantInstances& add_variant(const Campaign& campaign, VariantConfig v, InstanceSet& set) {
  for (const ScenarioConfig& s : campaign.scenarios) v = timed_alike(campaign, v, s);
  v.deadline_ms.reset();
  return set.variants.emplace_back(VariantInstances{v.name, variant_toml(campaign, v.name), v, {}});
}

/// `run(decorate)` is one closed loop of `duration_s` and returns its ticks: keeps about `count` of its problems.
template <class Run>
void keep_run(double duration_s, std::size_t count, std::uint32_t motion, const InstanceSet& set,
              VariantInstances& variant, Run run) {
  const auto periods = static_cast<std::size_t>(std::ceil(duration_s / variant.config.timing.period_s() - 1e-9));
  const std::size_t every = std::max<std::size_t>(1, periods / count);
  Recorder recorder{std::min(count, (periods + every - 1) / every), static_cast<std::int64_t>(every)};
  const std::vector<TickRecord> ticks = run(recorder.decorate());
  const Loads loads = loads_of(ticks, variant.config);
  keep(recorder.pneumatic, loads, motion, set, variant);
  keep(recorder.prestabilised, loads, motion, set, variant);
}

}  // namespace

InstanceSet record_instances(const Campaign& campaign, std::size_t per_variant) {
  InstanceSet set = with_motions(campaign);
  const std::size_t runs = campaign.scenarios.size() * campaign.seeds.size();
  const std::size_t per_run = std::max<std::size_t>(1, per_variant / runs);
  for (const VariantConfig& v : campaign.variants) {
    VariantInstances& variant = add_variant(campaign, v, set);
    for (std::size_t s = 0; s < campaign.scenarios.size(); ++s)
      for (const std::uint64_t seed : campaign.seeds)
        keep_run(
            campaign.scenarios[s].duration_s, per_run, static_cast<std::uint32_t>(s), set, variant,
            [&](const SolverDecorator& r) { return simulate(variant.config, campaign.scenarios[s], seed, r).ticks; });
  }
  return set;
}

InstanceSet record_instances(const RecordedRun& run, const std::vector<std::string>& variants,
                             std::size_t per_variant) {
  const Campaign campaign = recorded_campaign(run, variants);
  const RecordedTask task = recorded_task(run);
  InstanceSet set = with_motions(campaign);
  for (const VariantConfig& v : campaign.variants) {
    VariantInstances& variant = add_variant(campaign, v, set);
    keep_run(static_cast<double>(run.ticks.size()) * task.variant.timing.tick_s, per_variant, 0, set, variant,
             [&](const SolverDecorator& r) { return replay_other(run, task, variant.config, r).decided; });
  }
  return set;
}

}  // namespace solenoid
