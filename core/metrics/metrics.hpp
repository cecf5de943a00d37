#pragma once

#include "core/rt/recorder.hpp"
#include "core/system/description.hpp"

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace solenoid {

/// These are order statistics of a sample, in its unit; all are 0 for an empty one.
struct Percentiles {
  double p50 = 0, p90 = 0, p99 = 0, p999 = 0, max = 0;
};
/// Returns nearest-rank percentiles and sorts its argument.
Percentiles percentiles(std::vector<double>& sample);

/// Metrics say how a run went: numbers by name, in the order in which tables show them, and what the solver did.
class Metrics {
 public:
  /// One of them.
  struct Number {
    std::string name;  ///< "rmse_mm", the unit included
    double value = 0.0;
  };

  /// Appends a number, or changes the one of that name.
  void set(std::string_view name, double value);
  /// The number of that name; throws std::out_of_range, naming it, if there is none.
  double number(std::string_view name) const;
  /// The same, for reading; a name that is not there yet is appended as 0 when it is assigned to.
  double operator[](std::string_view name) const { return number(name); }
  double& operator[](std::string_view name);
  bool has(std::string_view name) const;
  const std::vector<Number>& numbers() const { return numbers_; }

  Percentiles solve_us;
  int deadline_misses = 0;
  double proven_optimal_fraction = 0;  ///< of the solves
  bool finite = true;                  ///< false if any state was not: the run is unstable and its numbers mean nothing

 private:
  std::vector<Number> numbers_;
};

/// What a run drew of whatever the system's models consume, in their unit.
struct Consumed {
  double total = 0;
  double steady = 0;  ///< of it in the steady part
};

/// Adds the solver's part to the metrics: times, misses of `deadline_us`, proofs.
void add_solves(std::span<const TickRecord> ticks, double deadline_us, Metrics& metrics);

}  // namespace solenoid
