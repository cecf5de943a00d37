#pragma once

#include "core/mpc/problem.hpp"
#include "core/systems/inverter/inverter.hpp"
#include "core/systems/inverter/modes.hpp"

#include <cmath>
#include <numbers>
#include <random>

namespace solenoid::test {

/// The current control problem of Geyer and Quevedo 2014 over `steps` sampling times,
///
///     sum |i_ref - i|^2 + lambda |change of the levels|_1,   lambda in A^2
inline Problem<InverterLoad> inverter_problem(int steps, double lambda, const InverterParameters& parameters = {},
                                              const char* inverter = "three_level") {
  Cost<InverterLoad> cost;
  cost.tracking = {1.0, 1.0};
  cost.switching = lambda;
  return {InverterLoad(parameters),
          inverter_modes(inverter, parameters),
          {parameters.sampling_s, std::vector<int>(static_cast<std::size_t>(steps), 1)},
          cost};
}

/// The reference from this angle on: rated current, which lags the terminal voltage by the power factor 0.85 when the
/// electromotive force lags it by 13.7 degrees.
inline Vector<double, 2> rated_current(const InverterParameters& p, double angle_rad) {
  return {p.rated_current_a * std::cos(angle_rad), p.rated_current_a * std::sin(angle_rad)};
}
inline constexpr double current_lags_emf_rad = 0.3165;  // acos(0.85) - 13.66 degrees

/// Poses the problem at a moment of the rated point: reference and electromotive force turned to `angle_rad`, the
/// current off its reference by `off`.
inline void pose_rated(Problem<InverterLoad>& problem, double angle_rad, const Vector<double, 2>& off) {
  const InverterParameters& p = problem.model.parameters();
  const double turn = 2 * std::numbers::pi * p.emf_frequency_hz * problem.horizon.dt_s;
  const auto current = rated_current(p, angle_rad);
  const auto force = problem.model.emf(angle_rad + current_lags_emf_rad);
  problem.initial = {current[0] + off[0], current[1] + off[1], force[0], force[1]};
  for (std::size_t j = 0; j < problem.reference.size(); ++j)
    problem.reference[j] = rated_current(p, angle_rad + static_cast<double>(j + 1) * turn);
}

/// A random moment: angle and levels in force uniform, the current off its reference by 20 A in each coordinate (the
/// distortion at some 300 Hz is about that).
inline void pose_at_random(Problem<InverterLoad>& problem, std::mt19937_64& random) {
  std::uniform_real_distribution angle(0.0, 2 * std::numbers::pi);
  std::normal_distribution off(0.0, 20.0);
  const double at = angle(random);
  const double off_alpha = off(random);
  pose_rated(problem, at, {off_alpha, off(random)});
  const auto mode = static_cast<int>(random() % static_cast<std::uint64_t>(problem.modes.size()));
  problem.lines = DelayLines(problem.modes.pattern(mode));
}

}  // namespace solenoid::test
