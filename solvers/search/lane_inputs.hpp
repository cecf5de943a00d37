#pragma once

#include "core/mpc/mode_set.hpp"
#include "solvers/search/rollout_kernel.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <vector>

namespace solenoid {

/// Whether a command and all before it are over after a block of so many steps, and nothing holds a switch any more.
inline bool settles(const SwitchTiming& timing, int steps) noexcept {
  return timing.windowed == 0 && steps >= std::max(timing.longest_delay, timing.longest_dwell());
}

/// Turns commands into the switched inputs of lanes, piece by piece of time, and into their hulls.
///
/// The pattern in effect t steps after a command p, the pattern before it having been on its way to e(t), is
///     (e(t) without the falling switches whose delay is over) with the rising switches whose delay is over.
template <HybridModel M>
class LaneInputBuilder {
 public:
  void prepare(const ModeSet& modes, const SwitchTiming& timing) {
    timing_ = timing;
    modes_ = modes;
    edges_ = timing.edges();
    for (int t = 0; t < static_cast<int>(over_.size()); ++t)
      over_[static_cast<std::size_t>(t)] = {over(timing.rise, t), over(timing.fall, t)};
    prepare_hulls(modes);
  }

  /// The most pieces that begin() can ask for.
  static constexpr std::size_t most_pieces() { return 64; }

  /// Starts a set of lanes; `flight`: steps until the last edge still on its way in any of the lanes' parents, 0 for
  /// none.
  void begin(int flight, LaneInputs<M>& inputs) const {
    const bool settled = flight == 0;
    inputs.pieces = settled ? static_cast<int>(edges_.size()) : std::max(flight, edges_.back()) + 1;
    inputs.in_flight = !settled;
    for (int i = 0; i < inputs.pieces; ++i) {
      const auto k = static_cast<std::size_t>(i);
      inputs.begin[k] = settled ? edges_[k] : i;
    }
  }

  /// Lane `lane` commands `pattern` on top of `before`.
  void command(const DelayLines& before, SwitchPattern pattern, int lane, LaneInputs<M>& inputs) const {
    const SwitchPattern changed = pattern ^ before.commanded();
    for (int i = 0; i < inputs.pieces; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const int t = inputs.begin[k];
      const SwitchPattern on_way = inputs.in_flight ? before.effective(t) : before.commanded();
      const auto [risen, fallen] = over_[static_cast<std::size_t>(t)];
      const SwitchPattern in_effect = (on_way & ~(changed & ~pattern & fallen)) | (changed & pattern & risen);
      write(modes_->template inputs<M::switched_size>(in_effect), lane, inputs.piece[k]);
    }
  }

  /// Hulls of what can be in effect after a settled command of mode `mode`, whatever is commanded from now on with at
  /// most `changes` switch changes in all.
  void hull(std::size_t mode, int changes, int lane, LaneInputs<M>& lowest, LaneInputs<M>& highest) const {
    const std::size_t budget = static_cast<std::size_t>(std::min(changes, timing_.switches));
    for (std::size_t k = 0; k < edges_.size(); ++k) {
      const std::size_t at = (mode * (static_cast<std::size_t>(timing_.switches) + 1) + budget) * edges_.size() + k;
      write(hull_low_[at], lane, lowest.piece[k]);
      write(hull_high_[at], lane, highest.piece[k]);
    }
  }

 private:
  static void write(const SwitchedOf<M>& point, int lane, typename LaneInputs<M>::Piece& piece) {
    for (std::size_t i = 0; i < M::switched_size; ++i) piece.value[i][lane] = point[i];
  }

  /// Switches whose delay is over after t steps.
  SwitchPattern over(const std::array<int, max_switches>& delay, int t) const {
    SwitchPattern mask = 0;
    for (std::size_t c = 0; c < static_cast<std::size_t>(timing_.switches); ++c)
      mask |= static_cast<SwitchPattern>(t >= delay[c]) << c;
    return mask;
  }

  void prepare_hulls(const ModeSet& modes) {
    hull_low_.clear();
    hull_high_.clear();
    std::vector<Reach> reach(static_cast<std::size_t>(timing_.switches) + 1);
    for (const Mode& mode : modes.modes()) {
      std::ranges::fill(reach, Reach{});
      for (const Mode& other : modes.modes()) {
        Reach& there = reach[static_cast<std::size_t>(std::popcount(mode.pattern ^ other.pattern))];
        there.on |= other.pattern;
        there.off |= ~other.pattern;
      }
      for (std::size_t budget = 0; budget < reach.size(); ++budget) {
        if (budget > 0) reach[budget].on |= reach[budget - 1].on, reach[budget].off |= reach[budget - 1].off;
        for (const int t : edges_)
          add_hull(mode.pattern | (reach[budget].on & over(timing_.rise, t)),
                   ~mode.pattern | (reach[budget].off & over(timing_.fall, t)));
      }
    }
  }

  /// Switches that can come to be on, and off.
  struct Reach {
    SwitchPattern on = 0, off = 0;
  };

  /// The box of all patterns in which each switch is on or off as it may be: every input has its least and its most at
  /// a pattern of its own, so that the box holds what point() gives for each of them, its rounding included: sums are
  /// monotone in each term, in the same order.
  void add_hull(SwitchPattern may_be_on, SwitchPattern may_be_off) {
    const SwitchPattern always_on = may_be_on & ~may_be_off, free = may_be_on & may_be_off;
    SwitchedOf<M> low, high;
    for (std::size_t i = 0; i < M::switched_size; ++i) {
      low[i] = modes_->point(always_on | (free & modes_->lowering(i)))[i];
      high[i] = modes_->point(always_on | (free & ~modes_->lowering(i)))[i];
    }
    hull_low_.push_back(low);
    hull_high_.push_back(high);
  }

  struct Over {
    SwitchPattern risen = 0, fallen = 0;
  };

  std::optional<ModeSet> modes_;
  SwitchTiming timing_;
  std::array<Over, max_delay_steps + 2> over_{};  // switches whose rise, whose fall is over after so many steps
  std::vector<int> edges_;
  std::vector<SwitchedOf<M>> hull_low_, hull_high_;  // mode-major, then budget, then edge
};

/// Fills the unused lanes of the last register, which holds `width`, with copies of the first lane that cost infinity.
template <HybridModel M>
void pad_lanes(int width, LaneInputs<M>& inputs, Lanes<M>& lanes) noexcept {
  for (int lane = lanes.count; lane % width != 0; ++lane) {
    for (auto& row : lanes.state) row[lane] = row[0];
    lanes.cost[lane] = Bounds<M>::infinity;
    for (int p = 0; p < inputs.pieces; ++p)
      for (auto& row : inputs.piece[static_cast<std::size_t>(p)].value) row[lane] = row[0];
  }
}

}  // namespace solenoid
