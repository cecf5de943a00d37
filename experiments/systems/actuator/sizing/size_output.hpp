#pragma once

#include "experiments/systems/actuator/sizing/size_task.hpp"

#include <optional>
#include <string>
#include <vector>

namespace solenoid {

struct Result;

/// A step of the sizing three ways: as printed for the task, from the printed values of the steps before it, and from
/// the task's data through every equation. In the unit that is shown.
struct SizingQuantity {
  std::string name, meaning, unit, equation;
  std::optional<PrintedFigure> printed;
  std::optional<double> stepped;  ///< where something is printed
  double computed = 0.0;

  /// The printed value is not what its own step gives, to the digits printed.
  bool own_difference() const;
  /// The printed value is not what the equations give from the data.
  bool differs() const;
};
std::vector<SizingQuantity> sizing_quantities(const SizingInput& input);

/// Names that a task's [printed] may have.
std::vector<std::string> printable_quantities();

/// Appendix A side by side. With printed figures: as printed, with (A.2)'s speed, with the standard formula's m/s;
/// always: rad/s in the formula as the thesis does, the standard formula, and the pinion's tooth.
std::vector<ToothReading> tooth_readings(const SizingInput& input);

/// Where printed figures and their own equations part, a sentence each.
std::vector<std::string> sizing_differences(const SizingInput& input);

/// All of it; drawn is figure 3-3: acceleration, gravity and total torque against time, with the peak.
Result result_of(const SizingInput& input);

}  // namespace solenoid
