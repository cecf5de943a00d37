#pragma once

#include <functional>
#include <string>
#include <vector>

namespace solenoid {

struct Result;

/// The Lotka-Volterra fishing problem relaxed and rounded on ever finer grids, against its published answers
/// (mintoc.de). Costs are integrals by the trapezium rule on `model_steps` model steps, the same for every grid.
inline constexpr int fishing_model_steps = 1536;
inline constexpr double fishing_published_relaxed = 1.34408, fishing_published_two_switches = 1.38276;

struct FishingRow {
  int intervals = 0;
  double relaxed = 0.0;                      ///< optimum with weights held in each interval
  double sum_up = 0.0, approximated = 0.0;   ///< of the roundings, re-simulated
  double improved = 0.0;                     ///< the better of them after mode swaps
  double sum_up_gap = 0.0, guarantee = 0.0;  ///< integral gap, and what the theory allows [units of time]
  double approximated_gap = 0.0;
  int sum_up_switches = 0, improved_switches = 0;
  double relaxing_ms = 0.0;
  int iterations = 0;
};

/// The finest grid of at most 384 intervals again, with two switches at most.
struct FishingWithTwoSwitches {
  int intervals = 0;
  double gap = 0.0, gap_bound = 0.0;  ///< of the integral approximation [units of time]
  double approximated = 0.0;          ///< its cost
  double improved = 0.0;              ///< after mode swaps: the switches moved by intervals
  double refined = 0.0;               ///< and then by steps of a model 8 times finer
  double from = 0.0, to = 0.0;        ///< fishing from and to
  double milliseconds = 0.0;
};

struct FishingStudy {
  std::vector<FishingRow> rows;
  FishingWithTwoSwitches two;
  double order = 0.0;  ///< p of the fit: sum_up - published relaxed optimum ~ (length of an interval)^p
};

/// `intervals`: numbers that divide fishing_model_steps, coarse to fine. Stops between grids once `stop` says so.
FishingStudy study_fishing(const std::vector<int>& intervals, const std::function<void(const std::string&)>& progress,
                           const std::function<bool()>& stop);

/// A row a grid; drawn are costs and gaps against the length of an interval.
Result result_of(const FishingStudy& study);

}  // namespace solenoid
