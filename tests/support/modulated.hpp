#pragma once

#include "solvers/rounding/modulator.hpp"
#include "tests/support/uniform.hpp"

#include <random>

#include <gtest/gtest.h>

namespace solenoid::test {

inline constexpr double step_s = 0.001;

/// One switch of one input.
inline ModeSet one_switch(double rise_s = 0.0, double fall_s = 0.0, double least_on_s = 0.0, double least_off_s = 0.0) {
  return {"one", {{"valve", rise_s, fall_s, 0.0, least_on_s, least_off_s}}, {{"off", 0}, {"on", 1}}, {0.0}, {{1.0}}};
}

/// What became of the wanted duties of one switch in a single round.
struct Modulated {
  std::vector<double> error;  ///< wanted - in effect, each step
  std::vector<double> owed, owed_sum;
  int edges = 0;
};

/// Of a duty an interval.
inline Modulated modulated(Modulator& modulator, const ModeSet& modes, const std::vector<double>& duties,
                           int interval) {
  const SwitchTiming timing(modes, step_s);
  const RelaxedGrid grid{std::vector<int>(duties.size(), interval)};
  modulator.prepare(modes, timing, grid);
  std::vector<double> weights;
  for (const double duty : duties) weights.insert(weights.end(), {1.0 - duty, duty});
  std::vector<int> mode(duties.size() * static_cast<std::size_t>(interval));
  std::vector<SwitchStates<double>> owed(mode.size()), owed_sum(mode.size());
  modulator.round(modes, DelayLines(0), weights, {}, mode, owed, owed_sum);
  WantedStates wanted;
  wanted.prepare(timing, grid);
  wanted.read(modes, DelayLines(0), weights);
  Modulated m;
  DelayLines lines(0);
  for (std::size_t j = 0; j < mode.size(); ++j) {
    const SwitchPattern pattern = modes.pattern(mode[j]);
    EXPECT_TRUE(lines.may_command(pattern, timing)) << j;
    m.edges += pattern != lines.commanded();
    lines.command(pattern, timing);
    m.error.push_back(wanted.at(j)[0] - static_cast<double>(lines.effective() & 1u));
    m.owed.push_back(owed[j][0]), m.owed_sum.push_back(owed_sum[j][0]);
    lines.advance(1);
  }
  return m;
}
/// Of a constant duty over so many steps.
inline Modulated modulated(Modulator& modulator, const ModeSet& modes, double duty, int steps, int interval) {
  return modulated(modulator, modes, std::vector<double>(static_cast<std::size_t>(steps / interval), duty), interval);
}

/// Random convex combinations of modes, a row an interval.
inline std::vector<double> random_rows(std::mt19937_64& random, int modes, std::size_t intervals) {
  std::vector<double> weights;
  for (std::size_t k = 0; k < intervals; ++k) {
    std::vector<double> row;
    double sum = 0.0;
    for (int m = 0; m < modes; ++m)
      sum += row.emplace_back(uniform(random, 0.0, 1.0) < 0.5 ? 0.0 : uniform(random, 0, 1));
    if (sum == 0.0) row[0] = sum = 1.0;
    for (const double w : row) weights.push_back(w / sum);
  }
  return weights;
}

}  // namespace solenoid::test
