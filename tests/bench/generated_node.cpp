// Time of a node of the search in models that solenoid.Model wrote (generated_models.py), beside hand-written headers of
// the same systems and methods, compiled alike, pinned to one core. Each problem is solved by both in turn; of each solve
// the best of a round counts, of the rounds the median. The ratio is to be at most 1.2.
#include "generated_fishing.hpp"
#include "generated_room.hpp"
#include "solvers/search/branch_and_bound.hpp"
#include "tests/bench/timing.hpp"
#include "tests/support/lotka_volterra.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include <fmt/format.h>

namespace solenoid::test {
namespace {

/// The generated model in two steps of half the length, as the hand-written one has them.
struct GeneratedFishing : models::fishing::Fishing {
  GeneratedFishing() : Fishing(std::array{0.4, 0.2}) {}
  template <class S>
  Vector<S, 2> step(const Vector<S, 2>& stocks, const Vector<S, 1>& fishing, const Vector<S, 0>& none,
                    double dt) const {
    Vector<S, 2> z = stocks;
    for (int i = 0; i < LotkaVolterraFishing::substeps; ++i)
      z = Fishing::step<S>(z, fishing, none, dt / LotkaVolterraFishing::substeps);
    return z;
  }
};

/// A room with a heater and the wall between it and the cold, by the classical Runge-Kutta method, as one would write it.
class HandWrittenRoom {
 public:
  static constexpr std::size_t state_size = 2, switched_size = 1, continuous_size = 0, output_size = 1;

  explicit HandWrittenRoom(std::span<const double> p)
      : outside_c_(p[1]),
        heating_(p[0] / p[2]),
        room_(1.0 / (p[4] * p[2])),
        wall_inwards_(1.0 / (p[4] * p[3])),
        wall_outwards_(1.0 / (p[5] * p[3])) {}

  template <class S>
  Vector<S, 2> rate(const Vector<S, 2>& x, const Vector<S, 1>& s) const {
    const S inwards = x[1] - x[0];
    return {S(S(room_) * inwards + S(heating_) * s[0]),
            S(S(wall_outwards_) * (S(outside_c_) - x[1]) - S(wall_inwards_) * inwards)};
  }
  template <class S>
  Vector<S, 2> step(const Vector<S, 2>& x, const Vector<S, 1>& s, const Vector<S, 0>&, double dt) const {
    const auto after = [&](const Vector<S, 2>& rate, double time) {
      return Vector<S, 2>{S(x[0] + S(time) * rate[0]), S(x[1] + S(time) * rate[1])};
    };
    const auto a = rate(x, s), b = rate(after(a, dt / 2), s), c = rate(after(b, dt / 2), s), d = rate(after(c, dt), s);
    const S sixth(dt / 6), two(2.0);
    return {S(x[0] + sixth * ((a[0] + d[0]) + two * (b[0] + c[0]))),
            S(x[1] + sixth * ((a[1] + d[1]) + two * (b[1] + c[1])))};
  }
  template <class S>
  Vector<S, 1> output(const Vector<S, 2>& x) const {
    return {x[0]};
  }

 private:
  double outside_c_, heating_, room_, wall_inwards_, wall_outwards_;
};

constexpr std::array room_parameters = {2000.0, 0.0, 1e5, 1e6, 0.003, 0.015};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// A problem of one model and what solves it.
template <HybridModel M>
struct Side {
  Problem<M> problem;
  BranchAndBound<M> search{};
  std::vector<double> rounds{};
  double cost = 0.0;
  std::int64_t nodes = 0;

  /// Nanoseconds a node from this state, the least of some solves.
  double solve(const StateOf<M>& from) {
    problem.initial = from;
    double best = 1e300;
    for (int r = 0; r < 5; ++r) {
      Plan<M> plan(problem);
      const SolveReport report = search.solve(problem, plan, Deadline::never());
      best = std::min(best, 1e3 * report.time_us / static_cast<double>(report.nodes));
      cost = report.cost;
      nodes = report.nodes;
    }
    return best;
  }
};

template <HybridModel Hand, HybridModel Generated, class Draw>
bool compare(const char* what, Problem<Hand> by_hand, Problem<Generated> generated, Draw draw) {
  Side<Hand> hand{std::move(by_hand)};
  Side<Generated> written{std::move(generated)};
  hand.search.prepare(hand.problem);
  written.search.prepare(written.problem);
  std::mt19937_64 random(1);
  std::vector<double> ratios;
  bool same = true;
  for (int round = 0; round < 200; ++round) {
    const auto from = draw(random);
    hand.rounds.push_back(hand.solve(from));
    written.rounds.push_back(written.solve(from));
    ratios.push_back(written.rounds.back() / hand.rounds.back());
    same = same && std::abs(hand.cost - written.cost) <= 1e-9 * std::abs(hand.cost);
  }
  fmt::print("{:8s} ns a node: by hand {:7.2f}, generated {:7.2f}, ratio {:.3f} (median of {}){}\n", what,
             median(hand.rounds), median(written.rounds), median(ratios), ratios.size(),
             same ? "" : ", AND COSTS THAT DIFFER");
  return same;
}

template <HybridModel M>
Problem<M> posed(M model, const ModeSet& modes, double dt, const std::vector<int>& blocks, const OutputOf<M>& wanted) {
  Cost<M> cost;
  cost.tracking.fill(dt);
  Problem<M> problem(std::move(model), modes, {dt, blocks}, cost);
  problem.reference.assign(problem.reference.size(), wanted);
  return problem;
}

}  // namespace
}  // namespace solenoid::test

int main() {
  using namespace solenoid;
  using namespace solenoid::test;
  solenoid::bench::pin_to_core(0);
  const std::vector<int> blocks = {1, 1, 2, 2, 4, 4, 6, 8, 12};
  const auto between = [](auto& random, double low, double high) {
    return std::uniform_real_distribution(low, high)(random);
  };
  const bool fishing = compare("fishing", fishing_problem(0.1, blocks),
                               posed(GeneratedFishing(), fishing_modes(), 0.1, blocks, {1.0, 1.0}), [&](auto& random) {
                                 return Vector<double, 2>{between(random, 0.3, 1.5), between(random, 0.3, 1.5)};
                               });
  const ModeSet heater("heater", {{"heater"}}, {{"off", 0}, {"on", 1}}, {0.0}, {{1.0}});
  const bool room =
      compare("room", posed(HandWrittenRoom(room_parameters), heater, 10.0, blocks, {20.0}),
              posed(models::room::Room(room_parameters), heater, 10.0, blocks, {20.0}), [&](auto& random) {
                return Vector<double, 2>{between(random, 15.0, 22.0), between(random, 8.0, 18.0)};
              });
  return fishing && room ? 0 : 1;
}
