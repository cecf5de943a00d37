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
template <HybridModel M>
std::vector<scaling::Moment<M>> moments_of(VariantConfig v, const ScenarioConfig& scenario) {
  v = with_blocks(v, most_blocks);
  v.deadline_ms = 1e3 * v.timing.period_s();
  std::vector<PosedInstance<M>> posed;
  const auto capacity = static_cast<std::size_t>(scenario.duration_s / v.timing.period_s()) + 1;
  RecordingSolver<M>* recorder = nullptr;
  simulate(v, scenario, 1, [&](AnySolver solver) -> AnySolver {
    auto made = std::make_unique<RecordingSolver<M>>(std::get<SolverPtr<M>>(std::move(solver)), posed, capacity, 1);
    recorder = made.get();
    return SolverPtr<M>(std::move(made));
  });
  std::vector<scaling::Moment<M>> all;
  for (std::size_t k = 1; k < posed.size() && (posed[k].solve > 0); ++k) {
    const auto at = [&](std::size_t i) {
      return RecordedInstance<M>{posed[i].initial, posed[i].lines, posed[i].reference, posed[i].setpoint, {}};
    };
    all.push_back({at(k - 1), at(k)});
  }
  return all;
}

template <HybridModel M>
bool study(const VariantConfig& v, const ScenarioConfig& scenario, const ScalingOptions& options,
           const std::function<void(const std::string&)>& progress, const std::function<bool()>& stop,
           std::vector<ScalingRow>& rows) {
  progress(v.modes + ": recording");
  const auto moments = scaling::some_moments(moments_of<M>(v, scenario), options.instances);
  return scaling::study_mode_set<M>(
      v.modes, moments, v.timing, [&](int blocks) { return make_problem<M>(with_blocks(v, blocks)); }, progress, stop,
      rows);
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
    const bool whole = std::visit(
        [&]<HybridModel M>(const Problem<M>&) { return study<M>(v, scenario, options, progress, stop, rows); },
        options.system->problem(v));
    if (!whole) break;
  }
  return rows;
}

}  // namespace solenoid
