#include "experiments/systems/actuator/thesis/position_figures.hpp"

#include "core/systems/actuator/signals.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// A slide that jumps from 20 mm to `peak_mm`, and from 1 s on rests at `rest_mm` +- `ripple_mm` by turns; the sensor
/// reads `offset_mm` more. The goal is 80 mm, the steady part the last second of three.
std::vector<TickRecord> slide(double peak_mm, double rest_mm, double ripple_mm, double offset_mm = 0) {
  std::vector<TickRecord> ticks(3000);
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    Measurement& s = ticks[i].sensors;
    s.time_s = 1e-3 * static_cast<double>(i);
    const double y_mm = i == 0 ? 20 : i < 1000 ? peak_mm : rest_mm + (i % 2 == 0 ? ripple_mm : -ripple_mm);
    s.truth[position] = 1e-3 * y_mm;
    s.value[position_channel] = 1e-3 * (y_mm + offset_mm);
  }
  return ticks;
}

Trajectory step() { return Trajectory(0.02).step_to(0.08, 3.0).steady_from(2.0); }

TEST(PositionFigures, TrueErrorsAreThoseOfTheSteadyPart) {
  const PositionFigures f = position_figures(slide(95, 79.5, 1.0), step(), PositionSignal::truth);
  EXPECT_NEAR(f.sse_max_abs_mm, 1.5, 1e-9);
  EXPECT_NEAR(f.sse_mean_abs_mm, 1.0, 1e-9);
  EXPECT_NEAR(f.sse_abs_mean_mm, 0.5, 1e-9);
  EXPECT_NEAR(f.overshoot_percent, 100 * (95 - 79.5) / 59.5, 1e-9);
  EXPECT_NEAR(f.ssa_mm, 2.0, 1e-9);
  EXPECT_NEAR(f.mae_mm, 60.0, 1e-9);  // at the very first moment
  const double moving = 60.0 * 60 + 999 * 15.0 * 15, resting = 1000 * (1.5 * 1.5 + 0.5 * 0.5);
  EXPECT_NEAR(f.rmse_mm, std::sqrt((moving + resting) / 3000), 1e-9);
}

TEST(PositionFigures, WithoutASteadyPartHasErrorsOfTheMotionAlone) {
  const Trajectory moving = Trajectory(0.02).cycloid_to(0.08, 3.0);
  const PositionFigures f = position_figures(slide(95, 79.5, 1.0), moving, PositionSignal::truth);
  EXPECT_GT(f.rmse_mm, 0.0);
  EXPECT_EQ(f.sse_max_abs_mm, 0.0);
  EXPECT_EQ(f.ssa_mm, 0.0);
}

TEST(PositionFigures, TheFilterTakesTheRippleNotTheOffset) {
  const PositionFigures f = position_figures(slide(95, 79.5, 1.0, 0.2), step(), PositionSignal::filtered);
  EXPECT_NEAR(f.sse_max_abs_mm, 0.3, 0.01);
  EXPECT_NEAR(f.sse_mean_abs_mm, 0.3, 0.01);
}

TEST(PositionFigures, NoOvershootIsZeroAndADownwardStepCountsDownwards) {
  EXPECT_NEAR(position_figures(slide(60, 79, 0.0), step(), PositionSignal::truth).overshoot_percent, 0.0, 1e-9);
  std::vector<TickRecord> down = slide(95, 80, 0.0);
  for (TickRecord& t : down) t.sensors.truth[position] = 0.1 - t.sensors.truth[position];
  const Trajectory trajectory = Trajectory(0.08).step_to(0.02, 3.0).steady_from(2.0);
  EXPECT_NEAR(position_figures(down, trajectory, PositionSignal::truth).overshoot_percent, 25.0, 1e-9);
}

}  // namespace
}  // namespace solenoid
