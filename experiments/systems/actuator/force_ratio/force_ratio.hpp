#pragma once

#include "experiments/systems/actuator/force_ratio/force_ratio_design.hpp"

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace solenoid {

struct Result;

struct RatioSettings {
  std::vector<double> shares = {0.0, 0.025, 0.05, 0.104, 0.2, 0.4, 0.7, 1.0};  ///< the motor's, of the capability
  int evaluations = 12;                                                        ///< of each ratio's tuning
  int plants = 2;           ///< hidden mismatches a motion to tune on, and as many held out
  int judged = 10;          ///< a motion, others, that every figure comes from
  bool quick = false;       ///< motions of a second: for tests of the machinery, no figure
  int jobs = 0;             ///< worker processes; 0: one a core
  std::string assumptions;  ///< a file; empty: the shipped ones
  std::string out;          ///< folder; one that is there already is resumed
};

/// One ratio: designed, tuned, judged.
struct RatioResult {
  RatioDesign design;
  std::string law;                                    ///< of force_ratio_plants.toml
  std::vector<std::pair<std::string, double>> tuned;  ///< key and value
  int evaluations = 0;
  RatioMeasured measured;
};

struct RatioStudy {
  SizingTask task;
  RatioAssumptions assumptions;
  std::vector<RatioResult> ratios;  ///< those that are done, in the order of their shares
  std::string folder;
  bool interrupted = false;
};

/// Every ratio's cylinder and motor by the sizing formulas, its controller tuned on the truth plant with that cylinder
/// and motor, and judged on plants that tuning has not seen. OUT/share-S keeps all of it: an interrupted study goes on
/// where it was. Throws ConfigError for shares outside 0 to 1, and what tune() throws.
RatioStudy study_force_ratio(const RatioSettings& settings, const std::function<void(const std::string&)>& progress);

/// The ratios under the study's assumptions, or others.
std::vector<RatioCriteria> criteria_of(const RatioStudy& study, const RatioAssumptions& assumptions);

/// Which share is recommended under a change of the assumptions, and how far ahead it is.
struct RatioVerdict {
  std::string change;  ///< empty: the assumptions as they are
  double share = 0.0;
  double lead = 0.0;                   ///< of its score before the second's
  std::optional<double> hybrid_share;  ///< the best that has both, which is what the thesis asks for
};
std::vector<RatioVerdict> verdicts_of(const RatioStudy& study);

/// A row a ratio and a row a verdict; drawn is the error against price, mass and energy with the fronts.
Result result_of(const RatioStudy& study);

}  // namespace solenoid
