#pragma once

#include <array>
#include <cstdint>

namespace solenoid {

/// What the clock of an I/O node says in ours, from the requests that it answered.
///
/// A request that was sent at c0 and whose answer, of the node's time m, came at c1 bounds the offset,
///
///     m - c1 <= theta <= m - c0,      so theta = m - (c0 + c1)/2 +- r/2,     r = c1 - c0 the round trip
///
/// and the shortest of many round trips bounds it best, however the delays of the two directions are distributed (the
/// clock filter of NTP: Mills, RFC 5905, section 10). The window is `bins` times `bin_s` long; of each bin the shortest
/// is kept. The drift is the median of the slopes between all of them (Theil, Indag. Math. 12 (1950); Sen, JASA 63
/// (1968) 1379): a bin in which no packet was quick does not bend it. The offset is that of the bin with the least
///
///     e = r/2 + phi (time since),    phi = 200 ppm before the drift is known, 50 ppm after
///
/// carried on with the drift; e is the bound of its error, as long as the crystals are within 100 ppm of each other and
/// the drift is right to 50 ppm. An answer that contradicts the bound by more than a millisecond is not believed; if the
/// next one agrees with it, it is another clock, a node that was started anew, and all is forgotten but those.
///
/// promise   no allocation, lock or exception
class NodeClock {
 public:
  static constexpr int bins = 16;
  static constexpr double bin_s = 0.25;
  static constexpr double unknown_drift = 200e-6, known_drift = 50e-6;
  static constexpr double jump_s = 1e-3;

  void reset() noexcept { *this = NodeClock(); }
  /// An answered request: when it was sent and its answer came [s, our clock], what the node's clock said between [us].
  /// Whether it is believed.
  bool exchange(double sent_s, double received_s, std::uint64_t node_us) noexcept;

  /// Whether there has been an exchange.
  bool known() const noexcept { return count_ > 0; }
  /// How long before our time `at_s` something happened at the node's time; NaN before the first exchange.
  double age_s(std::uint64_t node_us, double at_s) const noexcept;
  /// The bound of its error.
  double error_s(double at_s) const noexcept;
  /// By how much the node's clock goes faster than ours, as a share, at most unknown_drift either way; 0 until a second
  /// has shown it.
  double drift() const noexcept { return drift_; }
  /// The shortest round trip in the window [s].
  double least_round_trip_s() const noexcept;
  /// How often the node's clock jumped.
  int jumps() const noexcept { return jumps_; }

 private:
  /// The shortest round trip of a bin.
  struct Exchange {
    double middle_s = 0.0, offset_s = 0.0, round_trip_s = 0.0;
  };
  double since_base_s(std::uint64_t node_us) const noexcept {
    return 1e-6 * static_cast<double>(static_cast<std::int64_t>(node_us - base_us_));
  }
  double bound_s(const Exchange& e, double at_s) const noexcept;
  double offset_at(double at_s) const noexcept { return best_.offset_s + drift_ * (at_s - best_.middle_s); }
  void fit() noexcept;
  bool contradicts(const Exchange& now) const noexcept;
  /// Whether `now` is of the clock that the last contradiction was of.
  bool again(const Exchange& now) const noexcept;

  std::array<Exchange, bins> kept_{};  // the newest at newest_, which is still open
  int count_ = 0, newest_ = 0, jumps_ = 0;
  std::int64_t bin_ = 0;
  std::uint64_t base_us_ = 0;
  Exchange best_, doubted_;
  bool doubts_ = false;
  double drift_ = 0.0;
  bool drift_known_ = false;
};

}  // namespace solenoid
