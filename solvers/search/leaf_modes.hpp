#pragma once

#include "core/mpc/mode_set.hpp"

#include <algorithm>
#include <bit>
#include <vector>

namespace solenoid {

/// Modes that a last block can do without: another one switches the model's inputs alike at every step from the command
/// on, with fewer switch changes, or as many and a lower number. Valves of equal size make many of them.
///
/// A row is the mode in force before, its edges over. Earlier blocks need them all: what follows depends on the pattern.
class LeafModes {
 public:
  /// Allocates. Without two modes of one point there is nothing to find.
  void prepare(const ModeSet& modes, const SwitchTiming& timing) {
    modes_ = static_cast<std::size_t>(modes.size());
    dominated_.clear();
    if (!any_twins(modes)) return;
    const std::vector<int> edges = timing.edges();
    dominated_.resize(modes_ * modes_);
    for (std::size_t row = 0; row < modes_; ++row) fill(modes, timing, edges, row);
  }

  bool dominated(std::size_t row, int mode) const noexcept {
    return !dominated_.empty() && dominated_[row * modes_ + static_cast<std::size_t>(mode)] != 0;
  }

 private:
  struct Way {
    std::vector<double> inputs;  // at each edge
    int changes = 0;
    std::size_t mode = 0;
  };

  static bool any_twins(const ModeSet& modes) {
    std::vector<std::vector<double>> points;
    for (const Mode& mode : modes.modes()) {
      const SwitchedPoint point = modes.point(mode.pattern);
      points.emplace_back(point.begin(), point.end());
    }
    std::ranges::sort(points);
    return std::ranges::adjacent_find(points) != points.end();
  }

  void fill(const ModeSet& modes, const SwitchTiming& timing, const std::vector<int>& edges, std::size_t row) {
    const SwitchPattern before = modes.modes()[row].pattern;
    std::vector<Way> ways;
    for (std::size_t m = 0; m < modes_; ++m) {
      DelayLines lines(before);
      const SwitchPattern pattern = modes.modes()[m].pattern;
      if (!lines.may_command(pattern, timing)) continue;  // for its groups: of dwells there are none
      lines.command(pattern, timing);
      Way way{{}, std::popcount(before ^ pattern), m};
      for (const int t : edges) {
        const SwitchedPoint point = modes.point(lines.effective(t));
        way.inputs.insert(way.inputs.end(), point.begin(), point.end());
      }
      ways.push_back(std::move(way));
    }
    std::ranges::sort(ways, [](const Way& a, const Way& b) {
      if (a.inputs != b.inputs) return a.inputs < b.inputs;
      return a.changes != b.changes ? a.changes < b.changes : a.mode < b.mode;
    });
    for (std::size_t i = 1; i < ways.size(); ++i)
      dominated_[row * modes_ + ways[i].mode] = ways[i].inputs == ways[i - 1].inputs;
  }

  std::size_t modes_ = 0;
  std::vector<char> dominated_;  // [row][mode]; empty: none
};

}  // namespace solenoid
