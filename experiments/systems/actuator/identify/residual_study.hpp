#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

struct Result;

/// What is asked of residuals, and of how many plants.
struct ResidualStudySettings {
  int plants = 6;  ///< of each motion of `baselines_training`, and as many of `robustness`
  int jobs = 1;
};

/// One plant with hidden mismatches, under nine_robust, nine_residual, and nine_robust with the residual that was
/// identified from a run on the same plant, of cycloids to and fro that take 0.65 to 3 s, with other noise.
struct ResidualPlant {
  std::string name;
  bool training = false;
  double robust_mm = 0.0, shipped_mm = 0.0, own_mm = 0.0;  ///< true RMSE
  double switches_robust = 0.0, switches_own = 0.0;
  std::optional<double> held_out_without_n = {}, held_out_with_n = {};         ///< none where nothing was learned
  double ahead_without_mm = 0.0, ahead_with_mm = 0.0, ahead_shipped_mm = 0.0;  ///< 40 ms, on the judged run
  double outside = 0.0, outside_shipped = 0.0;                                 ///< shares of the judged run's ticks
  bool learned = false;                                                        ///< there was something to learn
};

/// The study's findings.
struct ResidualStudy {
  std::vector<ResidualPlant> plants;
  int failed = 0;  ///< workers that did not finish
  bool interrupted = false;
};

/// Simulates each plant in a process of its own.
ResidualStudy study_residual(const ResidualStudySettings& settings,
                             const std::function<void(const std::string&)>& progress,
                             const std::function<bool()>& interrupted);

/// A row a plant, means of the training plants and of the others.
Result result_of(const ResidualStudy& study);

}  // namespace solenoid
