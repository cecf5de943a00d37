// When to fish so that prey and predators settle at (1, 1): the Lotka-Volterra fishing problem of mintoc.de.
#include <cstdio>

#include <solenoid/solvers/rounding/projected_gradient.hpp>
#include <solenoid/solvers/rounding/relax_and_round.hpp>
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

constexpr double dt = 0.05, published = 1.34408;  // published: the fleet's share w anywhere between 0 and 1

// `blocks` equal blocks over 12 units of time; weights of dt make the cost the integral, by right-hand rectangles.
solenoid::Problem<Fishing> fishing_problem(int blocks) {
  const solenoid::ModeSet fleet("fleet", {{"boats"}}, {{"ashore", 0}, {"fishing", 1}}, {0.0}, {{1.0}});
  const solenoid::Horizon horizon{dt, std::vector<int>(blocks, 240 / blocks)};
  solenoid::Problem<Fishing> problem({}, fleet, horizon, solenoid::Cost<Fishing>{.tracking = {dt, dt}});
  problem.initial = {0.5, 0.7};
  problem.reference.assign(problem.reference.size(), {1.0, 1.0});
  return problem;
}

// By the trapezium rule: half of the initial error's rectangle more (the last error is nearly 0).
double integral(double cost) { return cost + dt / 2 * (0.5 * 0.5 + 0.3 * 0.3); }

int main() {
  using namespace solenoid;

  // By search: the best of all 2^24 sequences, proven.
  const Problem<Fishing> coarse = fishing_problem(24);
  BranchAndBound<Fishing> search;
  search.prepare(coarse);
  Plan<Fishing> plan(coarse);
  const SolveReport found = search.solve(coarse, plan, Deadline::never());
  std::printf("searched %s, integral %.4f, %lld nodes of 33554430: ", std::string(to_string(found.status)).c_str(),
              integral(found.cost), static_cast<long long>(found.nodes));
  for (const int mode : plan.modes) std::printf("%d", mode);
  std::printf("\n");

  // By relaxation, on ten times as many blocks: w between 0 and 1 first, then rounded to 0 or 1 and improved.
  const Problem<Fishing> fine = fishing_problem(240);
  RelaxAndRound<Fishing> rounding(std::make_unique<ProjectedGradient<Fishing>>());
  rounding.prepare(fine);
  Plan<Fishing> rounded(fine);
  const SolveReport made = rounding.solve(fine, rounded, Deadline::never());
  const double relaxed = integral(rounding.trace().relaxed_cost);
  std::printf("relaxed  %s, integral %.4f\n", std::string(to_string(rounding.trace().relaxation)).c_str(), relaxed);
  std::printf("rounded  %s, integral %.4f, %d switches\n", std::string(to_string(made.status)).c_str(),
              integral(made.cost), made.switches);

  const bool right = found.status == Status::optimal && usable(made.status) && relaxed > published - 1e-3 &&
                     relaxed < published + 1e-3 && integral(made.cost) > relaxed && integral(found.cost) > relaxed;
  return right ? 0 : 1;
}
