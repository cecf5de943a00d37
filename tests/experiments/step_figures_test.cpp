#include "experiments/thesis/step_figures.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// A slide that jumps from 20 mm to `peak_mm`, and from 1 s on rests at `rest_mm` +- `ripple_mm` by turns; the sensor
/// reads `offset_mm` more. The goal is 80 mm, the steady part the last second of three.
std::vector<TickRecord> slide(double peak_mm, double rest_mm, double ripple_mm, double offset_mm = 0) {
  std::vector<TickRecord> ticks(3000);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    Sensors& s = ticks[i].sensors;
    s.time_s = 1e-3 * static_cast<double>(i);
    const double y_mm = i == 0 ? 20 : i < 1000 ? peak_mm : rest_mm + (i % 2 == 0 ? ripple_mm : -ripple_mm);
    s.truth[position] = 1e-3 * y_mm;
    s.position_m = 1e-3 * (y_mm + offset_mm);
  }
  return ticks;
}

Trajectory step() { return Trajectory(0.02).step_to(0.08, 3.0).steady_from(2.0); }

TEST(StepFigures, TrueErrorsAreThoseOfTheSteadyPart) {
  const StepFigures f = step_figures(slide(95, 79.5, 1.0), step(), PositionSignal::truth);
  EXPECT_NEAR(f.max_abs_error_mm, 1.5, 1e-9);
  EXPECT_NEAR(f.mean_abs_error_mm, 1.0, 1e-9);
  EXPECT_NEAR(f.abs_mean_error_mm, 0.5, 1e-9);
  EXPECT_NEAR(f.overshoot_percent, 100 * (95 - 79.5) / 59.5, 1e-9);
}

TEST(StepFigures, TheFilterTakesTheRippleNotTheOffset) {
  const StepFigures f = step_figures(slide(95, 79.5, 1.0, 0.2), step(), PositionSignal::filtered);
  EXPECT_NEAR(f.max_abs_error_mm, 0.3, 0.01);
  EXPECT_NEAR(f.mean_abs_error_mm, 0.3, 0.01);
}

TEST(StepFigures, NoOvershootIsZeroAndADownwardStepCountsDownwards) {
  EXPECT_NEAR(step_figures(slide(60, 79, 0.0), step(), PositionSignal::truth).overshoot_percent, 0.0, 1e-9);
  std::vector<TickRecord> down = slide(95, 80, 0.0);
  for (TickRecord& t : down) t.sensors.truth[position] = 0.1 - t.sensors.truth[position];
  const Trajectory trajectory = Trajectory(0.08).step_to(0.02, 3.0).steady_from(2.0);
  EXPECT_NEAR(step_figures(down, trajectory, PositionSignal::truth).overshoot_percent, 25.0, 1e-9);
}

}  // namespace
}  // namespace solenoid
