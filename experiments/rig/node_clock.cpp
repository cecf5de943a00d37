#include "experiments/rig/node_clock.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace solenoid {
namespace {

constexpr int least_bins_for_drift = 4;

}  // namespace

double NodeClock::bound_s(const Exchange& e, double at_s) const noexcept {
  return e.round_trip_s / 2 + (drift_known_ ? known_drift : unknown_drift) * std::abs(at_s - e.middle_s);
}

bool NodeClock::contradicts(const Exchange& now) const noexcept {
  return std::abs(now.offset_s - offset_at(now.middle_s)) >
         now.round_trip_s / 2 + bound_s(best_, now.middle_s) + jump_s;
}

bool NodeClock::again(const Exchange& now) const noexcept {
  return doubts_ &&
         std::abs(now.offset_s - doubted_.offset_s) <= (now.round_trip_s + doubted_.round_trip_s) / 2 + jump_s;
}

bool NodeClock::exchange(double sent_s, double received_s, std::uint64_t node_us) noexcept {
  if (!(received_s >= sent_s)) return false;
  if (count_ == 0) base_us_ = node_us;
  const double middle = (sent_s + received_s) / 2;
  Exchange now{middle, since_base_s(node_us) - middle, received_s - sent_s};
  const bool doubtful = count_ > 0 && contradicts(now);
  if (doubtful && !again(now)) {
    doubted_ = now;
    doubts_ = true;
    return false;
  }
  doubts_ = false;
  if (doubtful) {
    const int jumps = jumps_ + 1;
    reset();
    jumps_ = jumps;
    base_us_ = node_us;
    now.offset_s = -middle;
  }
  const auto bin = static_cast<std::int64_t>(std::floor(received_s / bin_s));
  if (count_ > 0 && bin == bin_) {
    Exchange& open = kept_[static_cast<std::size_t>(newest_)];
    if (now.round_trip_s < open.round_trip_s) open = now;
  } else {
    fit();  // the bin that ends
    newest_ = (newest_ + 1) % bins;
    kept_[static_cast<std::size_t>(newest_)] = now;
    count_ = std::min(count_ + 1, bins);
    bin_ = bin;
  }
  best_ = kept_[static_cast<std::size_t>(newest_)];
  for (int i = 1; i < count_; ++i) {
    const Exchange& older = kept_[static_cast<std::size_t>((newest_ - i + bins) % bins)];
    if (bound_s(older, received_s) < bound_s(best_, received_s)) best_ = older;
  }
  return true;
}

void NodeClock::fit() noexcept {
  if (count_ < least_bins_for_drift) return;
  std::array<double, bins*(bins - 1) / 2> slopes;
  std::size_t found = 0;
  for (int i = 0; i < count_; ++i)
    for (int j = 0; j < i; ++j) {
      const Exchange &a = kept_[static_cast<std::size_t>((newest_ - i + bins) % bins)],
                     &b = kept_[static_cast<std::size_t>((newest_ - j + bins) % bins)];
      if (b.middle_s - a.middle_s > bin_s / 2) slopes[found++] = (b.offset_s - a.offset_s) / (b.middle_s - a.middle_s);
    }
  if (found == 0) return;
  const auto middle = slopes.begin() + static_cast<std::ptrdiff_t>(found / 2);
  std::nth_element(slopes.begin(), middle, slopes.begin() + static_cast<std::ptrdiff_t>(found));
  drift_ = std::clamp(*middle, -unknown_drift, unknown_drift);
  drift_known_ = count_ == bins;
}

double NodeClock::age_s(std::uint64_t node_us, double at_s) const noexcept {
  if (!known()) return std::numeric_limits<double>::quiet_NaN();
  // theta(c) = theta_b + d (c - c_b) at our time c, and c + theta(c) is the node's.
  const double then = since_base_s(node_us) - best_.offset_s + drift_ * best_.middle_s;
  return at_s - then / (1.0 + drift_);
}

double NodeClock::error_s(double at_s) const noexcept {
  return known() ? bound_s(best_, at_s) : std::numeric_limits<double>::infinity();
}

double NodeClock::least_round_trip_s() const noexcept {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < count_; ++i)
    least = std::min(least, kept_[static_cast<std::size_t>((newest_ - i + bins) % bins)].round_trip_s);
  return least;
}

}  // namespace solenoid
