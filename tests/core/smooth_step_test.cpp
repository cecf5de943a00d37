// What rounding off the friction's kink costs, as core/systems/actuator/dynamics.hpp states it.
#include "core/systems/actuator/prestabilised.hpp"

#include <random>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

TEST(SmoothStep, DiffersFromTheStepByNoMoreThanStated) {
  const PneumaticActuator model;
  const ActuatorParameters& p = model.parameters();
  const double dt = 0.001, most = dt / p.equivalent_mass_kg() * (p.static_friction_n + p.coulomb_friction_n);
  std::mt19937_64 random(5);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  double worst = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const double v = i % 4 == 0 ? 0.0 : uniform(-1.0, 1.0) * (i % 4 == 1 ? 1e-3 : 0.3);
    const Vector<double, 4> x = {uniform(0.0, 0.11), v, uniform(1e5, 2.5e5), uniform(1e5, 2.5e5)};
    const Vector<double, 4> opening = {uniform(0, 1), uniform(0, 1), uniform(0, 1), uniform(0, 1)};
    const Vector<double, 1> motor = {uniform(-8, 8)};
    const auto exact = model.step<double>(x, opening, motor, dt),
               smooth = model.smooth_step<double>(x, opening, motor, dt);
    for (const std::size_t same : {position, pressure_a, pressure_b}) EXPECT_EQ(exact[same], smooth[same]);
    const double off = std::abs(exact[velocity] - smooth[velocity]);
    // Reversals: step() stops at rest for a step, smooth_step goes through, by no more than the velocity it gains.
    const bool reverses = v * smooth[velocity] < 0.0 || exact[velocity] == 0.0;
    if (v == 0.0 && exact[velocity] == 0.0) worst = std::max(worst, off);
    if (v == 0.0) {
      EXPECT_LE(off, most * (1.0 + 1e-9));
    } else if (!reverses) {
      EXPECT_LE(off, dt / p.equivalent_mass_kg() * p.coulomb_friction_n *
                             (1.0 - std::tanh(std::abs(v) / PneumaticActuator::creep_speed_m_per_s)) * (1.0 + 1e-6) +
                         1e-15);
    }
  }
  EXPECT_GT(worst, 1e-6);  // a stuck slide creeps: that is what it is for
}

}  // namespace
}  // namespace solenoid
