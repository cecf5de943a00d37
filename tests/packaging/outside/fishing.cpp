// When to fish so that prey and predators settle at (1, 1): the Lotka-Volterra fishing problem of mintoc.de.
#include <cstdio>

#include <solenoid/solvers/search/branch_and_bound.hpp>

struct Fishing {
  static constexpr std::size_t state_size = 2, switched_size = 1, continuous_size = 0, output_size = 2;

  // One Runge-Kutta step of x' = x - x y - 0.4 x w, y' = -y + x y - 0.2 y w under a held w.
  template <class S>
  solenoid::Vector<S, 2> step(const solenoid::Vector<S, 2>& z, const solenoid::Vector<S, 1>& w,
                              const solenoid::Vector<S, 0>&, double dt) const {
    const auto rate = [&](const S& x, const S& y) {
      return solenoid::Vector<S, 2>{x * (S(1.0) - y - S(0.4) * w[0]), y * (x - S(1.0) - S(0.2) * w[0])};
    };
    const S half(dt / 2), sixth(dt / 6), two(2.0);
    const auto a = rate(z[0], z[1]);
    const auto b = rate(z[0] + half * a[0], z[1] + half * a[1]);
    const auto c = rate(z[0] + half * b[0], z[1] + half * b[1]);
    const auto d = rate(z[0] + S(dt) * c[0], z[1] + S(dt) * c[1]);
    return {z[0] + sixth * (a[0] + two * (b[0] + c[0]) + d[0]), z[1] + sixth * (a[1] + two * (b[1] + c[1]) + d[1])};
  }

  template <class S>
  solenoid::Vector<S, 2> output(const solenoid::Vector<S, 2>& z) const {
    return z;
  }
};

int main() {
  using namespace solenoid;
  const ModeSet fleet("fleet", {{"boats"}}, {{"ashore", 0}, {"fishing", 1}}, {0.0}, {{1.0}});
  const double dt = 0.05;
  const Horizon horizon{dt, std::vector<int>(24, 10)};  // 24 blocks of 0.5
  Problem<Fishing> problem({}, fleet, horizon, Cost<Fishing>{.tracking = {dt, dt}});
  problem.initial = {0.5, 0.7};
  problem.reference.assign(problem.reference.size(), {1.0, 1.0});

  BranchAndBound<Fishing> search;
  search.prepare(problem);
  Plan<Fishing> plan(problem);
  const Report report = search.solve(problem, plan, Deadline::never());

  std::printf("%s, cost %.4f, %lld nodes of 33554430: ", std::string(to_string(report.status)).c_str(), report.cost,
              static_cast<long long>(report.nodes));
  for (const int mode : plan.modes) std::printf("%d", mode);
  std::printf("\n");
  return report.status == Status::optimal && report.cost > 1.344 && report.cost < 1.38 ? 0 : 1;
}
