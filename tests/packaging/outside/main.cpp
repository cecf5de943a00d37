// An outside project with a system of its own: a tank whose inlet and outlet valves switch, solved by the installed
// library's search. Fails if the level is not where holding the inlet open must bring it.
#include <cmath>
#include <cstdio>

#include <solenoid/core/systems/actuator/dynamics.hpp>
#include <solenoid/solvers/search/exhaustive.hpp>

struct Tank {
  static constexpr std::size_t state_size = 1, switched_size = 2, continuous_size = 0, output_size = 1;
  template <class S>
  solenoid::Vector<S, 1> step(const solenoid::Vector<S, 1>& level, const solenoid::Vector<S, 2>& valve,
                              const solenoid::Vector<S, 0>&, double dt) const {
    return {level[0] + S(dt) * (valve[0] - valve[1])};
  }
  template <class S>
  solenoid::Vector<S, 1> output(const solenoid::Vector<S, 1>& level) const {
    return level;
  }
};

int main() {
  using namespace solenoid;
  const ModeSet modes("tank", {{"inlet"}, {"outlet"}}, {{"hold", 0}, {"fill", 1}, {"drain", 2}}, {0, 0},
                      {{1, 0}, {0, 1}});
  Problem<Tank> problem(Tank{}, modes, Horizon{0.1, {5, 5}}, Cost<Tank>{.tracking = {1.0}});
  problem.reference.assign(problem.reference.size(), {0.5});
  Exhaustive<Tank> search;
  search.prepare(problem);
  Plan<Tank> plan(problem);
  const SolveReport report = search.solve(problem, plan, Deadline::never());
  plan.outputs.resize(problem.reference.size());
  evaluate(problem, plan);
  const PneumaticActuator actuator;
  std::printf("plan %d %d, cost %.3f, gravity at the equilibrium %.1e N\n", plan.modes[0], plan.modes[1], report.cost,
              actuator.gravity_force(actuator.parameters().equilibrium_position_m()));
  const bool right = report.status == Status::optimal && plan.modes[0] == 1 && plan.modes[1] == 0 &&
                     std::abs(plan.outputs.back()[0] - 0.5) < 1e-12;
  return right ? 0 : 1;
}
