#include "solvers/rounding/integral_approximation.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>

namespace solenoid {
namespace {

std::uint64_t mix(std::uint64_t hash, std::uint64_t value) noexcept {
  hash = (hash ^ value) * 0x9e3779b97f4a7c15u;
  return hash ^ (hash >> 29);
}

}  // namespace

void IntegralApproximation::prepare(std::size_t intervals, int modes, int switches) {
  if (intervals < 1 || modes < 1) throw std::invalid_argument("integral approximation: needs an interval and a mode");
  if (switches < 0 || static_cast<std::size_t>(switches) > SwitchLimits::most_switches)
    throw std::invalid_argument("integral approximation: takes at most 32 switches");
  if (!std::has_single_bit(settings_.table_entries) && settings_.table_entries != 0)
    throw std::invalid_argument("integral approximation: table_entries must be a power of two, or 0");
  most_intervals_ = intervals;
  most_modes_ = static_cast<std::size_t>(modes);
  most_switches_ = static_cast<std::size_t>(switches);
  path_.assign(intervals + 1, State());
  time_.assign(intervals + 1, 0.0);
  due_.assign((intervals + 1) * most_modes_, 0.0);
  served_ = due_;
  changed_at_.assign((intervals + 1) * most_switches_, 0.0);
  count_.assign((intervals + 1) * most_switches_, 0);
  order_.assign(intervals * most_modes_, 0);
  child_gap_.assign(intervals * most_modes_, 0.0);
  chosen_.assign(intervals, 0);
  best_.assign(intervals, 0);
  table_.assign(settings_.table_entries, Searched());
  table_served_.assign(settings_.table_entries * most_modes_, 0.0);
  table_changed_at_.assign(settings_.table_entries * most_switches_, 0.0);
  table_count_.assign(settings_.table_entries * most_switches_, 0);
}

ApproximationReport IntegralApproximation::solve(const ModeWeights& weights, const SwitchLimits& limits,
                                                 std::span<int> modes, Deadline deadline) noexcept {
  const auto start = Deadline::Clock::now();
  report_ = ApproximationReport();
  if (!fits(weights, limits, modes) || !is_normalised(weights)) return report_;
  begin(weights, limits);
  adopt(weights, limits, modes);
  const bool complete = search(limits, weights.dt, deadline);
  const bool found = std::isfinite(report_.cost);
  if (complete) {
    report_.status = found ? Status::optimal : Status::infeasible;
    report_.bound = report_.cost;
  } else {
    report_.bound = std::min(report_.cost, open_bound(depth_));
  }
  if (found) std::copy_n(best_.begin(), intervals_, modes.begin());
  report_.time_us = us_since(start);
  return report_;
}

/// Whether the problem has the sizes prepared for, and no pattern a switch beyond those there are.
bool IntegralApproximation::fits(const ModeWeights& weights, const SwitchLimits& limits,
                                 std::span<const int> modes) const noexcept {
  const auto count = static_cast<std::size_t>(std::max(weights.modes, 0));
  if (count < 1 || count > most_modes_ || limits.patterns.size() != count) return false;
  if (limits.switches.size() > most_switches_) return false;
  const auto beyond = [&](std::int64_t pattern) { return pattern >> limits.switches.size() > 0; };
  if (beyond(limits.in_force) || std::any_of(limits.patterns.begin(), limits.patterns.end(), beyond)) return false;
  return weights.intervals() >= 1 && weights.intervals() <= most_intervals_ && modes.size() == weights.intervals() &&
         weights.weight.size() == weights.intervals() * count;
}

void IntegralApproximation::begin(const ModeWeights& weights, const SwitchLimits& limits) noexcept {
  intervals_ = weights.intervals();
  modes_ = limits.patterns.size();
  switches_ = limits.switches.size();
  ++solve_;
  std::fill_n(due_.begin(), modes_, 0.0);
  std::fill_n(served_.begin(), modes_, 0.0);
  time_[0] = 0.0;
  for (std::size_t k = 0; k < intervals_; ++k) {
    time_[k + 1] = time_[k] + weights.dt[k];
    for (std::size_t m = 0; m < modes_; ++m)
      due_[(k + 1) * modes_ + m] = due_[k * modes_ + m] + weights.dt[k] * weights.at(k, m);
  }
  path_[0] = State();
  path_[0].pattern = limits.in_force;
  for (std::size_t c = 0; c < switches_; ++c) {
    changed_at_[c] = -limits.switches[c].age;
    count_[c] = 0;
  }
  least_changes_ = std::numeric_limits<int>::max();
  for (std::size_t m = 0; m < modes_; ++m)
    for (std::size_t n = 0; n < m; ++n)
      least_changes_ = std::min(least_changes_, std::popcount(limits.patterns[m] ^ limits.patterns[n]));
}

/// The warm start becomes the incumbent if it is a sequence that keeps to the limits.
void IntegralApproximation::adopt(const ModeWeights& weights, const SwitchLimits& limits,
                                  std::span<const int> modes) noexcept {
  for (const int mode : modes)
    if (mode < 0 || mode >= weights.modes) return;
  if (!walk_limits(limits, weights.dt, modes).allowed) return;
  for (std::size_t k = 0; k < intervals_; ++k) {  // by the search's own additions, so that gaps compare exactly
    path_[k].next = path_[k].children = 0;
    assign(limits, weights.dt, k, modes[k]);
  }
  keep(intervals_);
}

/// False when stopped before the end; depth_ is then where.
bool IntegralApproximation::search(const SwitchLimits& limits, std::span<const double> dt, Deadline deadline) noexcept {
  depth_ = 0;
  branch(limits, dt, depth_);
  for (;;) {
    State& state = path_[depth_];
    if (state.next == state.children ||
        !(child_gap_[depth_ * modes_ + static_cast<std::size_t>(state.next)] < report_.cost)) {
      if (depth_ == 0) return true;
      --depth_;
      continue;
    }
    if (stopped(deadline)) return false;
    assign(limits, dt, depth_, order_[depth_ * modes_ + static_cast<std::size_t>(state.next++)]);
    ++report_.nodes;
    const std::size_t child = depth_ + 1;
    if (child == intervals_) {
      keep(child);
    } else if (!lacks_changes(limits, child) && !searched_before(limits, child)) {
      branch(limits, dt, child);
      depth_ = child;
    }
  }
}

bool IntegralApproximation::stopped(Deadline deadline) noexcept {
  if (report_.nodes >= settings_.max_nodes) {
    report_.status = Status::iteration_limit;
    return true;
  }
  const bool first_dive = report_.nodes < static_cast<std::int64_t>(intervals_);
  if (first_dive || report_.nodes % 64 != 0 || !deadline.passed()) return false;
  report_.status = Status::deadline_reached;
  return true;
}

/// Lists the modes that may follow a state, least gap first; of one gap the mode that is owed most, then lowest number.
void IntegralApproximation::branch(const SwitchLimits& limits, std::span<const double> dt, std::size_t depth) noexcept {
  State& state = path_[depth];
  state.next = state.children = 0;
  const double* owed_until = due(depth + 1);
  double largest = 0.0, second = 0.0;  // of all |owed|
  std::size_t largest_mode = 0;
  for (std::size_t m = 0; m < modes_; ++m) {
    const double owed = std::abs(owed_until[m] - served(depth)[m]);
    if (owed > largest) {
      second = largest;
      largest = owed;
      largest_mode = m;
    } else {
      second = std::max(second, owed);
    }
  }
  for (std::size_t m = 0; m < modes_; ++m) {
    if (!allowed(limits, depth, limits.patterns[m])) continue;
    const double own = std::abs(owed_until[m] - (served(depth)[m] + dt[depth]));
    const double gap = std::max({state.gap, own, m == largest_mode ? second : largest});
    if (gap < report_.cost) insert_child(depth, static_cast<int>(m), gap);
  }
}

bool IntegralApproximation::allowed(const SwitchLimits& limits, std::size_t depth, SwitchPattern next) const noexcept {
  const State& state = path_[depth];
  if (state.pattern < 0) return true;
  SwitchPattern changed = static_cast<SwitchPattern>(state.pattern) ^ next;
  if (state.changes > limits.max_changes - std::popcount(changed)) return false;
  if (!one_at_a_time(changed, limits.one_at_a_time)) return false;
  for (std::size_t c = 0; c < switches_ && changed != 0; ++c, changed >>= 1) {
    if ((changed & 1u) == 0) continue;
    const SwitchLimits::PerSwitch& s = limits.switches[c];
    const std::size_t at = depth * switches_ + c;
    if (count_[at] >= s.max_changes) return false;
    if (!has_dwelt(time_[depth] - changed_at_[at], (next >> c & 1u) ? s.min_off : s.min_on)) return false;
  }
  return true;
}

void IntegralApproximation::insert_child(std::size_t depth, int mode, double gap) noexcept {
  State& state = path_[depth];
  int* order = order_.data() + depth * modes_;
  double* gaps = child_gap_.data() + depth * modes_;
  const auto owed = [&](int m) {
    return due(depth + 1)[static_cast<std::size_t>(m)] - served(depth)[static_cast<std::size_t>(m)];
  };
  int i = state.children++;
  for (; i > 0 && (gap < gaps[i - 1] || (gap == gaps[i - 1] && owed(mode) > owed(order[i - 1]))); --i) {
    order[i] = order[i - 1];
    gaps[i] = gaps[i - 1];
  }
  order[i] = mode;
  gaps[i] = gap;
}

/// Makes the state at depth + 1 that follows from `mode` in interval `depth`.
void IntegralApproximation::assign(const SwitchLimits& limits, std::span<const double> dt, std::size_t depth,
                                   int mode) noexcept {
  const State& from = path_[depth];
  State& to = path_[depth + 1];
  chosen_[depth] = mode;
  std::copy_n(served(depth), modes_, served(depth + 1));
  served(depth + 1)[mode] += dt[depth];
  to.gap = from.gap;
  for (std::size_t m = 0; m < modes_; ++m)
    to.gap = std::max(to.gap, std::abs(due(depth + 1)[m] - served(depth + 1)[m]));
  const std::int64_t next = limits.patterns[static_cast<std::size_t>(mode)];
  const std::int64_t changed = from.pattern < 0 ? 0 : from.pattern ^ next;
  to.pattern = next;
  to.changes = from.changes + std::popcount(static_cast<std::uint64_t>(changed));
  for (std::size_t c = 0; c < switches_; ++c) {
    const std::size_t at = depth * switches_ + c;
    const bool changes = (changed >> c & 1) != 0;
    changed_at_[at + switches_] = changes ? time_[depth] : changed_at_[at];
    count_[at + switches_] = count_[at] + (changes ? 1 : 0);
  }
}

/// Whether no completion can stay below the incumbent, because more modes are owed that much time by the end than there
/// are changes left to command them.
bool IntegralApproximation::lacks_changes(const SwitchLimits& limits, std::size_t depth) const noexcept {
  if (limits.max_changes == SwitchLimits::unlimited) return false;
  const State& state = path_[depth];
  int in_need = 0;
  for (std::size_t m = 0; m < modes_; ++m)
    in_need += state.pattern != limits.patterns[m] && due(intervals_)[m] - served(depth)[m] >= report_.cost;
  return in_need > (limits.max_changes - state.changes) / least_changes_;
}

/// Whether the table holds a state that had every possibility of this one; else this one is put there. The search is
/// depth first: a state met again at its depth has been searched to the end.
bool IntegralApproximation::searched_before(const SwitchLimits& limits, std::size_t depth) noexcept {
  if (table_.empty()) return false;
  const State& state = path_[depth];
  std::uint64_t hash = mix(depth, static_cast<std::uint64_t>(state.pattern));
  for (std::size_t m = 0; m < modes_; ++m) hash = mix(hash, std::bit_cast<std::uint64_t>(served(depth)[m]));
  const std::size_t row = (hash >> 17) & (table_.size() - 1);
  Searched& entry = table_[row];
  const bool same = entry.solve == solve_ && entry.depth == depth && entry.pattern == state.pattern &&
                    std::equal(served(depth), served(depth) + modes_, table_served_.data() + row * modes_);
  if (same && dominated(limits, entry, row, depth)) return true;
  entry = {depth, state.gap, state.pattern, state.changes, solve_};
  std::copy_n(served(depth), modes_, table_served_.data() + row * modes_);
  std::copy_n(changed_at_.data() + depth * switches_, switches_, table_changed_at_.data() + row * switches_);
  std::copy_n(count_.data() + depth * switches_, switches_, table_count_.data() + row * switches_);
  return false;
}

bool IntegralApproximation::dominated(const SwitchLimits& limits, const Searched& entry, std::size_t row,
                                      std::size_t depth) const noexcept {
  const State& state = path_[depth];
  if (entry.gap > state.gap) return false;
  if (limits.max_changes != SwitchLimits::unlimited && entry.changes > state.changes) return false;
  for (std::size_t c = 0; c < switches_; ++c) {
    const SwitchLimits::PerSwitch& s = limits.switches[c];
    const std::size_t here = depth * switches_ + c, there = row * switches_ + c;
    if (s.max_changes != SwitchLimits::unlimited && table_count_[there] > count_[here]) return false;
    const double least = (state.pattern >> c & 1) ? s.min_on : s.min_off;
    const bool free = has_dwelt(time_[depth] - table_changed_at_[there], least);
    if (!free && table_changed_at_[there] > changed_at_[here]) return false;
  }
  return true;
}

void IntegralApproximation::keep(std::size_t depth) noexcept {
  const State& leaf = path_[depth];
  if (!(leaf.gap < report_.cost)) return;
  report_.cost = leaf.gap;
  report_.changes = leaf.changes;
  std::copy_n(chosen_.begin(), intervals_, best_.begin());
}

/// The least gap of the children not searched.
double IntegralApproximation::open_bound(std::size_t depth) const noexcept {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t d = 0; d <= depth; ++d) {
    const State& state = path_[d];
    if (state.next < state.children)
      least = std::min(least, child_gap_[d * modes_ + static_cast<std::size_t>(state.next)]);
  }
  return least;
}

}  // namespace solenoid
