#include "experiments/rig/node_clock.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

/// A wire between us and a node whose clock drifts; each direction delays each packet on its own.
struct Wire {
  double least_s = 50e-6, up_s = 0.0, down_s = 0.0;  ///< jitter: uniform up to these
  double drift = 0.0, lost = 0.0;
  double node_began_s = -12'345.678;  ///< when the node's clock said 0, of ours

  std::uint64_t node_us(double at_s) const {
    return static_cast<std::uint64_t>(std::floor(1e6 * (1.0 + drift) * (at_s - node_began_s)));
  }
};

struct ClockRun {
  explicit ClockRun(const Wire& w, std::uint64_t seed) : wire(w), random(seed) {}
  double uniform(double most) { return most * std::uniform_real_distribution<double>()(random); }

  /// A request a millisecond, as long as `seconds`; answers come in the order in which they arrive.
  template <class Look>
  void go(double seconds, const Look& look) {
    struct Answer {
      double sent, received;
      std::uint64_t node;
    };
    std::vector<Answer> under_way;
    for (const double end = now + seconds; now < end; now += 1e-3) {
      std::ranges::sort(under_way, {}, &Answer::received);
      while (!under_way.empty() && under_way.front().received <= now) {
        const Answer a = under_way.front();
        under_way.erase(under_way.begin());
        clock.exchange(a.sent, a.received, a.node);
      }
      look();
      if (uniform(1.0) < wire.lost) continue;
      const double at = now + wire.least_s + uniform(wire.up_s), back = at + wire.least_s + uniform(wire.down_s);
      under_way.push_back({now, back, wire.node_us(at)});
    }
  }
  /// The error of the age of what happened `before` ago.
  double error(double before) const { return clock.age_s(wire.node_us(now - before), now) - before; }

  Wire wire;
  std::mt19937_64 random;
  NodeClock clock;
  double now = 1000.0;
};

TEST(NodeClock, SaysTheAgeWithinItsBoundWhateverTheWireDoes) {
  std::mt19937_64 random(5);
  const auto between = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    Wire wire{.up_s = between(0, 2e-3), .down_s = between(0, 2e-3), .drift = between(-1e-4, 1e-4), .lost = 0.05};
    if (seed % 4 == 0) wire.up_s = 0.0;  // all of the jitter in one direction
    ClockRun run(wire, seed);
    double worst = 0.0;
    run.go(12.0, [&] {
      if (!run.clock.known()) return;
      const double error = std::abs(run.error(2e-3));
      ASSERT_LE(error, run.clock.error_s(run.now) + 2e-6) << seed << " at " << run.now;
      if (run.now > 1001.0) worst = std::max(worst, error);
    });
    EXPECT_LT(worst, 250e-6) << seed << ": jitter " << wire.up_s << ", " << wire.down_s;
    EXPECT_NEAR(run.clock.drift(), wire.drift, 50e-6) << seed;
    EXPECT_EQ(run.clock.jumps(), 0) << seed;
  }
}

TEST(NodeClock, OnAQuietWireIsRightToTheMicrosecondAndKnowsTheDrift) {
  ClockRun run({.drift = 80e-6}, 3);
  run.go(6.0, [] {});
  EXPECT_NEAR(run.error(1e-3), 0.0, 3e-6);
  EXPECT_NEAR(run.clock.drift(), 80e-6, 1e-6);
  EXPECT_NEAR(run.clock.least_round_trip_s(), 100e-6, 1e-9);
}

TEST(NodeClock, TakesANodeThatWasStartedAnewForAnother) {
  ClockRun run({.up_s = 2e-3, .down_s = 2e-3, .drift = 1e-4}, 9);
  run.go(5.0, [] {});
  run.wire.node_began_s = run.now - 0.5;
  run.go(0.02, [] {});  // answers that were under way come first
  EXPECT_EQ(run.clock.jumps(), 1);
  EXPECT_LE(std::abs(run.error(1e-3)), run.clock.error_s(run.now) + 2e-6);
  run.go(5.0, [] {});
  EXPECT_EQ(run.clock.jumps(), 1);
  EXPECT_LT(std::abs(run.error(1e-3)), 250e-6);
}

TEST(NodeClock, OneAnswerThatContradictsItIsNotBelieved) {
  ClockRun run({.drift = 50e-6}, 4);
  run.go(5.0, [] {});
  const double drift = run.clock.drift();
  EXPECT_FALSE(run.clock.exchange(run.now, run.now + 1e-4, run.wire.node_us(run.now + 3e-3)));
  EXPECT_EQ(run.clock.jumps(), 0);
  EXPECT_NEAR(run.error(1e-3), 0.0, 3e-6);
  EXPECT_TRUE(run.clock.exchange(run.now, run.now + 1e-4, run.wire.node_us(run.now + 5e-5)));
  EXPECT_EQ(run.clock.drift(), drift);
}

TEST(NodeClock, AClockThatIsAPercentOffJumps) {
  ClockRun run({.drift = 1e-2}, 6);
  run.go(3.0, [] {});
  EXPECT_GT(run.clock.jumps(), 5);
}

TEST(NodeClock, KnowsNothingBeforeItsFirstExchange) {
  NodeClock clock;
  EXPECT_FALSE(clock.known());
  EXPECT_TRUE(std::isnan(clock.age_s(5, 1.0)));
  EXPECT_TRUE(std::isinf(clock.error_s(1.0)));
  clock.exchange(2.0, 1.0, 7);  // an answer before its request is none
  EXPECT_FALSE(clock.known());
}

}  // namespace
}  // namespace solenoid
