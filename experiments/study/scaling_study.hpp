#pragma once

#include "controllers/any_solver.hpp"
#include "core/system/timing.hpp"
#include "experiments/study/scaling.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace solenoid::scaling {

/// How each row of the study is measured, whatever the model (scaling.hpp).

/// A recorded problem and the one a control period before.
struct Moment {
  Held<AnyProblem> before, now;
};

/// `count` of these moments, evenly over them.
std::vector<Moment> some_moments(const std::vector<Moment>& all, int count);

/// A tree search of one mode set.
struct ModeSetStudy {
  std::string name;
  std::vector<Moment> moments;
  Timing timing;
  std::function<std::unique_ptr<AnyProblem>(int blocks)> problem;  ///< no longer than the moments'
  std::function<AnySolverPtr(bool prune)> search;
};

/// The rows of one mode set: problems of 1 to most_blocks blocks, all on the same moments. False when stopped.
bool study_mode_set(const ModeSetStudy& study, const std::function<void(const std::string&)>& progress,
                    const std::function<bool()>& stop, std::vector<ScalingRow>& rows);

}  // namespace solenoid::scaling
