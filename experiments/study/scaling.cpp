#include "experiments/study/scaling.hpp"

#include "controllers/factory.hpp"
#include "controllers/instances/recording_solver.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/profile/replay.hpp"
#include "experiments/study/scaling_study.hpp"

namespace solenoid {
namespace {

/// The variant of this many blocks of a period each.
VariantConfig with_blocks(VariantConfig v, int blocks) {
  v.horizon.blocks.assign(static_cast<std::size_t>(blocks), 1);
  v.horizon.steps = blocks * v.timing.ticks_per_period;
  return v;
}

/// Every moment of a loop closed with the longest horizon, so that each shorter one finds its reference in it.
std::vector<scaling::Moment> moments_of(VariantConfig v, const ScenarioConfig& scenario) {
  v = with_blocks(v, most_blocks);
  v.deadline_ms = 1e3 * v.timing.period_s();
  std::vector<PosedInstance> posed;
  const auto capacity = static_cast<std::size_t>(scenario.duration_s / v.timing.period_s()) + 1;
  simulate(v, scenario, 1, [&](AnySolverPtr solver) {
    return std::make_unique<RecordingSolver>(std::move(solver), posed, capacity, 1);
  });
  std::vector<scaling::Moment> all;
  for (std::size_t k = 1; k < posed.size() && posed[k].solve > 0; ++k)
    all.push_back({posed[k - 1].problem, posed[k].problem});
  return all;
}

/// Of a variant's mode set and model.
scaling::ModeSetStudy study_of(const VariantConfig& v, const ScenarioConfig& scenario, int instances) {
  const System& system = system_of(v);
  const auto search = [&system, v](bool prune) {
    const SolverRow& row = *find_row(system.solvers(), prune ? "branch_and_bound" : "exhaustive");
    return make_solver(row, system.problem(v)->model_type(), v);
  };
  return {v.modes, scaling::some_moments(moments_of(v, scenario), instances), v.timing,
          [&system, v](int blocks) { return system.problem(with_blocks(v, blocks)); }, search};
}

}  // namespace

std::vector<ScalingRow> study_scaling(const ScalingOptions& options,
                                      const std::function<void(const std::string&)>& progress,
                                      const std::function<bool()>& stop) {
  const PinnedCore pinned(-1);
  std::vector<ScalingRow> rows;
  const ScenarioConfig scenario = read_campaign(options.system->name()).scenarios.front();
  for (const std::string& modes : options.system->mode_sets()) {
    VariantConfig v = new_variant(options.system);
    v.solver = "branch_and_bound";
    v.modes = modes;
    v = told(v, scenario);
    progress(v.modes + ": recording");
    if (!scaling::study_mode_set(study_of(v, scenario, options.instances), progress, stop, rows)) break;
  }
  return rows;
}

}  // namespace solenoid
