#include "solvers/rounding/dynamic_quantiser.hpp"

#include <bit>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr int longest_degree = 8;  // what no switch has reached by then is not waited for

}  // namespace

void DynamicQuantiser::prepare(const ModeSet&, const SwitchTiming& timing, const RelaxedGrid& grid) {
  if (plant_.states > max_switched)
    throw std::invalid_argument(
        fmt::format("dynamic quantiser: {} states (allowed: at most {})", plant_.states, max_switched));
  timing_ = timing;
  wanted_.prepare(timing, grid);
  xi_.assign(plant_.states, 0.0);
  ahead_xi_ = next_ = xi_;
  reversal_ = 0;
  for (std::size_t c = 0; c < static_cast<std::size_t>(timing.switches); ++c) {
    const int pulse = least_in_effect(timing, c, true), pause = least_in_effect(timing, c, false);
    reversal_ = std::max({reversal_, timing.rise[c] + pulse - 1, timing.fall[c] + pause - 1});
    most_.owed[c] = 0.5 * std::max(pulse, pause) + 1.0 + 0.5 * edge_price_;
  }
  const auto ahead = static_cast<std::size_t>(reversal_ + longest_degree);
  responses_.assign((ahead + 1) * plant_.switches * plant_.outputs, 0.0);
  base_.assign(ahead * plant_.outputs, 0.0);
  effects_.assign(plant_.switches * 2 * static_cast<std::size_t>(reversal_ + 1) * base_.size(), 0.0);
}

int DynamicQuantiser::relative_degree(const LinearPlant& plant, int most) {
  int degree = 1;
  for (std::size_t o = 0; o < plant.outputs; ++o) {
    if (!(plant.weight[o] > 0.0)) continue;
    std::array<double, max_switched> row{}, next{};
    for (std::size_t i = 0; i < plant.states; ++i) row[i] = plant.c[o * plant.states + i];
    const auto felt = [&] {
      double sum = 0.0, size = 0.0;
      for (std::size_t c = 0; c < plant.switches; ++c)
        for (std::size_t i = 0; i < plant.states; ++i)
          sum += std::abs(row[i] * push(plant, i, c)), size += std::abs(row[i]);
      return sum > 1e-14 * size;
    };
    int d = 1;
    for (; d < most && !felt(); ++d, row = next)
      for (std::size_t j = 0; j < plant.states; ++j) {
        next[j] = 0.0;
        for (std::size_t i = 0; i < plant.states; ++i) next[j] += row[i] * plant.a[i * plant.states + j];
      }
    degree = std::max(degree, d);
  }
  return degree;
}

void DynamicQuantiser::round(const ModeSet& modes, const DelayLines& lines, std::span<const double> weights,
                             const ModulatorState& at_begin, std::span<int> mode, std::span<SwitchStates<double>> owed,
                             std::span<SwitchStates<double>> owed_sum) noexcept {
  wanted_.read(modes, lines, weights);
  ModulatedSteps steps(modes, timing_, lines, at_begin);
  for (std::size_t i = 0; i < plant_.states; ++i) {
    xi_[i] = 0.0;
    for (std::size_t c = 0; c < plant_.switches; ++c) xi_[i] -= push(plant_, i, c) * at_begin.owed[c];
  }
  const int degree = relative_degree(plant_, longest_degree), ahead = reversal_ + degree;
  respond(degree, ahead);
  for (std::size_t j = 0; j < wanted_.steps(); ++j) {
    owed[j] = steps.state.owed, owed_sum[j] = {};
    look_ahead(j, steps.lines, ahead);
    mode[j] = steps.command(choose(modes, steps.lines, ahead));
    advance(xi_, wanted_.at(j), steps.lines.effective());
    steps.pass(wanted_.at(j), most_);
  }
}

/// The outputs' answers to each switch, sum_{k < i} C A^k B, and what a change of it costs.
void DynamicQuantiser::respond(int degree, int ahead) noexcept {
  const SwitchStates<double> nothing{};
  for (std::size_t c = 0; c < plant_.switches; ++c) {
    std::ranges::fill(ahead_xi_, 0.0);
    price_[c] = 0.0;
    for (std::size_t i = 1; i <= static_cast<std::size_t>(ahead); ++i) {
      advance(ahead_xi_, nothing, SwitchPattern{1} << c);
      for (std::size_t o = 0; o < plant_.outputs; ++o) {
        const std::size_t entry = (i * plant_.switches + c) * plant_.outputs + o;
        responses_[entry] = output(o);
        const double of_one_step = responses_[entry] - responses_[entry - plant_.switches * plant_.outputs];
        if (i <= static_cast<std::size_t>(degree))
          price_[c] += edge_price_ * plant_.weight[o] * (of_one_step * of_one_step);
      }
    }
  }
}

/// Fills base_ and effects_ for the steps from this one on.
void DynamicQuantiser::look_ahead(std::size_t step, const DelayLines& lines, int ahead) noexcept {
  std::ranges::copy(xi_, ahead_xi_.begin());
  for (int i = 0; i < ahead; ++i) {
    advance(ahead_xi_, wanted_.at(step + static_cast<std::size_t>(i)), lines.effective(i));
    for (std::size_t o = 0; o < plant_.outputs; ++o)
      base_[static_cast<std::size_t>(i) * plant_.outputs + o] = output(o);
  }
  for (std::size_t c = 0; c < plant_.switches; ++c) {
    const std::int64_t stays = lines.line(c).states;
    const bool on = (lines.commanded() >> c) & 1u;
    const int there = on ? timing_.fall[c] : timing_.rise[c], back = on ? timing_.rise[c] : timing_.fall[c];
    const std::int64_t changed = DelayLines::after_edge(stays, !on, there);
    for (int at = 0; at <= reversal_; ++at) {
      add_up(c, stays, DelayLines::after_edge(stays, !on, std::min(62, at + there)), ahead,
             effect(c, Course::changes, at));
      add_up(c, stays, DelayLines::after_edge(changed, on, std::min(62, at + back)), ahead,
             effect(c, Course::changes_and_returns, at));
    }
  }
}

/// What switch c adds to the outputs with these states in effect in place of those: each difference that begins or ends
/// answers from its step on.
void DynamicQuantiser::add_up(std::size_t c, std::int64_t stays, std::int64_t course, int ahead,
                              std::size_t effect) noexcept {
  const std::span into = std::span(effects_).subspan(effect, base_.size());
  std::ranges::fill(into, 0.0);
  int before = 0;
  for (int k = 0; k < ahead; ++k) {
    const int bit = std::min(k, 63);
    const int now = static_cast<int>((course >> bit) & 1) - static_cast<int>((stays >> bit) & 1);
    const int edge = now - std::exchange(before, now);
    if (edge == 0) continue;
    for (int i = k; i < ahead; ++i)
      for (std::size_t o = 0; o < plant_.outputs; ++o)
        into[static_cast<std::size_t>(i) * plant_.outputs + o] +=
            edge * responses_[(static_cast<std::size_t>(i - k + 1) * plant_.switches + c) * plant_.outputs + o];
  }
}

/// The pattern of least error: to go on, with one change later, or to change now, and back later.
SwitchPattern DynamicQuantiser::choose(const ModeSet& modes, const DelayLines& lines, int ahead) const noexcept {
  const SwitchPattern before = lines.commanded();
  const std::span groups(timing_.group.data(), timing_.groups);
  SwitchPattern chosen = before;
  double best = error(0, Course::changes, 0, ahead, std::numeric_limits<double>::infinity());
  std::array<int, max_switches> wait{};  // steps until a switch that stays may change
  for (std::size_t c = 0; c < plant_.switches; ++c) wait[c] = timing_.least(c, (before >> c) & 1u) - lines.line(c).age;
  for (const Mode& later : modes.modes()) {
    const SwitchPattern changed = later.pattern ^ before;
    if (changed == 0 || !one_at_a_time(changed, groups)) continue;
    int first = 1;
    for (SwitchPattern left = changed; left != 0; left &= left - 1)
      first = std::max(first, wait[static_cast<std::size_t>(std::countr_zero(left))]);
    for (int at = first; at <= reversal_; ++at) best = std::min(best, error(changed, Course::changes, at, ahead, best));
  }
  for (const Mode& now : modes.modes()) {
    const SwitchPattern changed = now.pattern ^ before;
    if (changed == 0 || !lines.may_command(now.pattern, timing_)) continue;
    const auto consider = [&](double found) {
      if (found < best * (1.0 - least_gain)) best = found, chosen = now.pattern;
    };
    consider(error(changed, Course::changes, 0, ahead, best));
    int first = 1;
    for (SwitchPattern left = changed; left != 0; left &= left - 1) {
      const auto c = static_cast<std::size_t>(std::countr_zero(left));
      first = std::max(first, timing_.least(c, (now.pattern >> c) & 1u));
    }
    for (int at = first; at <= reversal_; ++at) consider(error(changed, Course::changes_and_returns, at, ahead, best));
  }
  return chosen;
}

/// The weighted output errors ahead and the price of the changes if these switches take that course; any number beyond
/// `best` if not below.
double DynamicQuantiser::error(SwitchPattern changed, Course course, int at, int ahead, double best) const noexcept {
  double sum = 0.0;
  for (SwitchPattern left = changed; left != 0; left &= left - 1)
    sum += price_[static_cast<std::size_t>(std::countr_zero(left))] * (course == Course::changes ? 1.0 : 2.0);
  for (std::size_t i = 0; i < static_cast<std::size_t>(ahead) && sum < best; ++i)
    for (std::size_t o = 0; o < plant_.outputs; ++o) {
      if (!(plant_.weight[o] > 0.0)) continue;
      const std::size_t entry = i * plant_.outputs + o;
      double z = base_[entry];
      for (SwitchPattern left = changed; left != 0; left &= left - 1)
        z += effects_[effect(static_cast<std::size_t>(std::countr_zero(left)), course, at) + entry];
      sum += plant_.weight[o] * (z * z);
    }
  return sum;
}

/// Output o at the state ahead.
double DynamicQuantiser::output(std::size_t o) const noexcept {
  double z = 0.0;
  for (std::size_t k = 0; k < plant_.states; ++k) z += plant_.c[o * plant_.states + k] * ahead_xi_[k];
  return z;
}

/// xi <- A xi + B (v - w).
void DynamicQuantiser::advance(std::vector<double>& xi, const SwitchStates<double>& wanted,
                               SwitchPattern in_effect) noexcept {
  SwitchStates<double> excess;
  for (std::size_t c = 0; c < plant_.switches; ++c) excess[c] = static_cast<double>((in_effect >> c) & 1u) - wanted[c];
  for (std::size_t i = 0; i < plant_.states; ++i) {
    double sum = 0.0;
    for (std::size_t k = 0; k < plant_.states; ++k) sum += plant_.a[i * plant_.states + k] * xi[k];
    for (std::size_t c = 0; c < plant_.switches; ++c) sum += push(plant_, i, c) * excess[c];
    next_[i] = sum;
  }
  xi.swap(next_);
}

}  // namespace solenoid
