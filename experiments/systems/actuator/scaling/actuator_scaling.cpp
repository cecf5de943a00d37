#include "experiments/systems/actuator/scaling/actuator_scaling.hpp"

#include "controllers/systems/actuator/models.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/profile/replay.hpp"
#include "experiments/study/recorded_instances.hpp"
#include "experiments/study/scaling_study.hpp"

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr std::array valve_sets = {"three_way", "seven_mode", "two_way"};
constexpr double switching_m2 = 2e-8;  // weight of one coil change

/// Every moment over the thesis's two motions of a loop closed with four blocks.
template <HybridModel M>
std::vector<scaling::Moment> thesis_moments(const char* valves) {
  auto problem = actuator_problem<M>(valves, scaling_blocks(4), switching_m2);
  const double start = problem.model.parameters().equilibrium_position_m();
  const auto posed = [&](const RecordedInstance<M>& instance) {
    instance.pose(problem);
    return Held<AnyProblem>(problem);
  };
  std::vector<scaling::Moment> all;
  for (const Trajectory& motion : {thesis_sine(start), thesis_cycloidal(start)}) {
    const auto search = make_tree_search<M>(true);
    const auto recorded = record_closed_loop(problem, motion, *search);
    for (std::size_t k = 1; k < recorded.size(); ++k) all.push_back({posed(recorded[k - 1]), posed(recorded[k])});
  }
  return all;
}

template <HybridModel M>
std::vector<ScalingRow> study_valves(const ScalingOptions& options,
                                     const std::function<void(const std::string&)>& progress,
                                     const std::function<bool()>& stop) {
  std::vector<ScalingRow> rows;
  for (const char* valves : valve_sets) {
    progress(fmt::format("{}: recording", valves));
    const scaling::ModeSetStudy study{
        valves, scaling::some_moments(thesis_moments<M>(valves), options.instances), actuator_timing,
        [&](int blocks) { return actuator_problem<M>(valves, scaling_blocks(blocks), switching_m2).clone(); },
        [](bool prune) { return make_tree_search<M>(prune); }};
    if (!scaling::study_mode_set(study, progress, stop, rows)) break;
  }
  return rows;
}

}  // namespace

std::vector<int> scaling_blocks(int count) {
  static const std::array<std::vector<int>, most_blocks> ladder = {{{20},
                                                                    {4, 16},
                                                                    {2, 4, 14},
                                                                    {2, 2, 4, 12},
                                                                    {1, 1, 2, 4, 12},
                                                                    {1, 1, 2, 2, 4, 10},
                                                                    {1, 1, 1, 2, 2, 4, 9},
                                                                    {1, 1, 1, 1, 2, 2, 4, 8}}};
  return ladder.at(static_cast<std::size_t>(count - 1));
}

std::vector<ScalingRow> study_actuator_scaling(const ScalingOptions& options, bool cylinder,
                                               const std::function<void(const std::string&)>& progress,
                                               const std::function<bool()>& stop) {
  const PinnedCore pinned(-1);
  return cylinder ? study_valves<PneumaticActuator>(options, progress, stop)
                  : study_valves<PrestabilisedActuator>(options, progress, stop);
}

}  // namespace solenoid
