#pragma once

#include "core/mpc/mode_set.hpp"
#include "solvers/search/rollout_kernel.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <vector>

namespace solenoid {

/// Turns commands into the switched inputs of lanes, piece by piece of time, and into their hulls.
///
/// The pattern in effect t steps after a command p, the pattern before it having been on its way to e(t), is
///     (e(t) without the falling switches whose delay is over) with the rising switches whose delay is over.
template <HybridModel M>
class LaneInputBuilder {
 public:
  void prepare(const ModeSet& modes, const SwitchTiming& timing) {
    timing_ = timing;
    points_.clear();
    for (SwitchPattern p = 0; p < (1u << modes.switch_count()); ++p) {
      SwitchedOf<M> point{};
      std::ranges::copy(modes.point(p), point.begin());
      points_.push_back(point);
    }
    edges_ = {0};
    for (std::size_t c = 0; c < static_cast<std::size_t>(timing.switches); ++c)
      edges_.insert(edges_.end(), {timing.rise[c], timing.fall[c]});
    std::ranges::sort(edges_);
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
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
      write(points_[in_effect], lane, inputs.piece[k]);
    }
  }

  /// Hulls of what can be in effect after a settled command of `pattern`, whatever is commanded from now on with at
  /// most `changes` switch changes in all.
  void hull(SwitchPattern pattern, int changes, int lane, LaneInputs<M>& lowest, LaneInputs<M>& highest) const {
    const std::size_t budget = static_cast<std::size_t>(std::min(changes, timing_.switches));
    for (std::size_t k = 0; k < edges_.size(); ++k) {
      const std::size_t at = (budget * points_.size() + pattern) * edges_.size() + k;
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
    for (int budget = 0; budget <= timing_.switches; ++budget)
      for (SwitchPattern p = 0; p < points_.size(); ++p) {
        const Reach reach = within(modes, p, budget);
        for (const int t : edges_)
          add_hull(p | (reach.on & over(timing_.rise, t)), ~p | (reach.off & over(timing_.fall, t)));
      }
  }

  /// Switches that can come to be on, and off.
  struct Reach {
    SwitchPattern on = 0, off = 0;
  };

  /// What `budget` switch changes can reach from pattern p, by way of the allowed patterns.
  Reach within(const ModeSet& modes, SwitchPattern p, int budget) const {
    Reach reach;
    for (int m = 0; m < modes.size(); ++m) {
      const SwitchPattern q = modes.pattern(m);
      if (budget < timing_.switches && std::popcount(p ^ q) > budget) continue;
      reach.on |= q;
      reach.off |= ~q;
    }
    return reach;
  }

  void add_hull(SwitchPattern may_be_on, SwitchPattern may_be_off) {
    SwitchedOf<M> low, high;
    low.fill(Bounds<M>::infinity);
    high.fill(-Bounds<M>::infinity);
    for (SwitchPattern b = 0; b < points_.size(); ++b) {
      if ((b & ~may_be_on) != 0 || (~b & ~may_be_off & (points_.size() - 1)) != 0) continue;
      for (std::size_t i = 0; i < M::switched_size; ++i) {
        low[i] = std::min(low[i], points_[b][i]);
        high[i] = std::max(high[i], points_[b][i]);
      }
    }
    hull_low_.push_back(low);
    hull_high_.push_back(high);
  }

  struct Over {
    SwitchPattern risen = 0, fallen = 0;
  };

  SwitchTiming timing_;
  std::array<Over, max_delay_steps + 2> over_{};  // switches whose rise, whose fall is over after so many steps
  std::vector<int> edges_;  // delays at which a pattern can change after a command, ascending from 0
  std::vector<SwitchedOf<M>> points_, hull_low_, hull_high_;  // hulls: budget-major, then pattern, then edge
};

}  // namespace solenoid
