// Both QP back ends on the recorded closed-loop problems, cold and warm. The solvers of a table take turns on each
// instance within one process, since a core may change its speed between two runs. An instance's time is the median over
// repetitions; printed are the median, the 99th and the largest of the 100 instances, and ratios of the worst cases and
// of instruction sets.
#include "solvers/qp/ocp_solver.hpp"
#include "solvers/qp/ocp_to_sparse.hpp"
#include "solvers/qp/sparse_solver.hpp"
#include "tests/support/recorded_qp.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>

namespace {

using namespace solenoid;
using namespace solenoid::qp;

constexpr int repetitions = 51;

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

/// One solver on one kind of start, and what it took on the instances so far.
struct Contender {
  std::string name;
  std::function<Info(std::size_t instance)> solve;
  std::vector<double> time_us{}, iterations{};
  int failures = 0;

  double us(double q) const { return quantile(time_us, q); }
  void print() const {
    double sum = 0.0;
    for (const double one : iterations) sum += one;
    std::printf("  %-44s %7.1f %7.1f %7.1f us   factorisations: mean %5.2f  max %2.0f   failures %d\n", name.c_str(),
                us(0.5), us(0.99), us(1.0), sum / static_cast<double>(iterations.size()), quantile(iterations, 1.0),
                failures);
  }
};

void take_turns(std::vector<Contender>& all, std::size_t instances) {
  for (std::size_t i = 0; i < instances; ++i) {
    std::vector<std::vector<double>> times(all.size());
    for (int repetition = -1; repetition < repetitions; ++repetition)
      for (std::size_t c = 0; c < all.size(); ++c) {
        const auto start = std::chrono::steady_clock::now();
        const Info info = all[c].solve(i);
        const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - start;
        if (repetition >= 0) times[c].push_back(took.count());
        if (repetition > 0) continue;
        if (repetition == 0) all[c].iterations.push_back(info.iterations);
        all[c].failures += repetition == 0 && info.status != Status::optimal;
      }
    for (std::size_t c = 0; c < all.size(); ++c) all[c].time_us.push_back(quantile(times[c], 0.5));
  }
}

void print(const char* title, int horizon, const std::vector<Contender>& all) {
  std::printf("\n%s, N = %d %*s median     p99   worst\n", title, horizon,
              32 - static_cast<int>(std::string(title).size()), "");
  for (const Contender& one : all) one.print();
}

/// The instruction sets of this processor by name.
std::map<std::string, Isa> instruction_sets() {
  std::map<std::string, Isa> all{{"baseline", Isa::baseline}};
  if (resolve(Isa::avx2) == Isa::avx2) all["avx2"] = Isa::avx2;
  if (resolve(Isa::avx512) == Isa::avx512) all["avx512"] = Isa::avx512;
  return all;
}

/// What the next period asks: one stage on, the last stage repeated, the state a little off the prediction.
OcpQp<4, 3> one_period_later(const OcpQp<4, 3>& problem, const OcpSolution<4, 3>& plan) {
  OcpQp<4, 3> next = problem;
  for (std::size_t k = 0; k + 2 < next.stages.size(); ++k) next.stages[k] = problem.stages[k + 1];
  next.stages[0].q_matrix.setZero();
  next.stages[next.stages.size() - 2].q_matrix = problem.stages.back().q_matrix;
  next.x0 = plan.x[1] * 1.01;
  return next;
}

OcpSolution<4, 3> shifted(const OcpSolution<4, 3>& plan) {
  OcpSolution<4, 3> next = plan;
  const auto move = [](auto& list) { std::move(list.begin() + 1, list.end(), list.begin()); };
  move(next.u), move(next.x), move(next.y), move(next.zu);
  return next;
}

/// The Riccati solver with a solution of its own.
struct Staged {
  Staged(const OcpQp<4, 3>& shape, const Settings& settings) : solution(shape.horizon()) {
    solver.setup(shape, settings);
  }
  OcpSolver<4, 3> solver;
  OcpSolution<4, 3> solution;
};

void by_instruction_set(int horizon) {
  const auto all = test::recorded_qps(horizon);
  std::vector<Contender> contenders;
  for (const auto& [name, isa] : instruction_sets())
    for (const int steps : {Settings{}.active_set_steps, 0}) {
      const auto one = std::make_shared<Staged>(all[0].problem, Settings{.active_set_steps = steps, .isa = isa});
      contenders.push_back({name + (steps == 0 ? ", interior point alone" : ", as shipped"),
                            [one, &all](std::size_t i) { return one->solver.solve(all[i].problem, one->solution); }});
    }
  take_turns(contenders, all.size());
  print("Riccati, cold", horizon, contenders);
  for (std::size_t c = 0; c < contenders.size(); c += 2) {
    const Contender &shipped = contenders[c], &interior = contenders[c + 1];
    std::printf("  %s: worst as shipped / interior point alone %.2f;  times baseline's, interior point alone: %.2f\n",
                shipped.name.substr(0, shipped.name.find(',')).c_str(), shipped.us(1.0) / interior.us(1.0),
                interior.us(0.5) / std::find_if(contenders.begin(), contenders.end(), [](const Contender& one) {
                                     return one.name == "baseline, interior point alone";
                                   })->us(0.5));
  }
}

void warm_starts(int horizon) {
  const auto all = test::recorded_qps(horizon);
  std::vector<OcpQp<4, 3>> later;
  std::vector<OcpSolution<4, 3>> plans, guesses;
  Staged reference(all[0].problem, {});
  for (const auto& one : all) {
    reference.solver.solve(one.problem, reference.solution);
    plans.push_back(reference.solution);
    guesses.push_back(shifted(reference.solution));
    later.push_back(one_period_later(one.problem, reference.solution));
  }
  std::vector<Contender> contenders;
  for (const int steps : {Settings{}.active_set_steps, 0}) {
    const std::string note = steps == 0 ? ", interior point alone" : ", as shipped";
    const auto make = [&] { return std::make_shared<Staged>(all[0].problem, Settings{.active_set_steps = steps}); };
    contenders.push_back({"one period later, cold" + note, [one = make(), &later](std::size_t i) {
                            return one->solver.solve(later[i], one->solution);
                          }});
    contenders.push_back({"one period later, warm" + note, [one = make(), &later, &guesses](std::size_t i) {
                            return one->solution = guesses[i], one->solver.solve(later[i], one->solution, Start::warm);
                          }});
    contenders.push_back({"warm from the neighbour" + note, [one = make(), &all, &plans](std::size_t i) {
                            one->solution = plans[i == 0 ? plans.size() - 1 : i - 1];
                            return one->solver.solve(all[i].problem, one->solution, Start::warm);
                          }});
  }
  take_turns(contenders, all.size());
  print("Riccati, one period later", horizon, contenders);
}

void sparse(int horizon) {
  const auto all = test::recorded_qps(horizon);
  std::vector<SparseQp> problems;
  problems.reserve(all.size());
  for (const auto& one : all) problems.push_back(to_sparse(one.problem));
  std::vector<Contender> contenders;
  for (const int steps : {Settings{}.active_set_steps, 0}) {
    const auto solver = std::make_shared<SparseSolver>();
    solver->setup(problems[0], {.active_set_steps = steps});
    contenders.push_back({steps == 0 ? "interior point alone" : "as shipped",
                          [solver, solution = SparseSolution(problems[0]), &problems](std::size_t i) mutable {
                            return solver->solve(problems[i], solution);
                          }});
  }
  take_turns(contenders, all.size());
  print("AMD + LDL, cold", horizon, contenders);
  std::printf("  worst as shipped / interior point alone %.2f\n", contenders[0].us(1.0) / contenders[1].us(1.0));
}

}  // namespace

int main() {
  for (const int horizon : {20, 40}) {
    by_instruction_set(horizon);
    warm_starts(horizon);
    sparse(horizon);
  }
}
