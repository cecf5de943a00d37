// The interior point beside HPIPM on the recorded problems: every solver in turn on every instance in one process, for a
// core may change its speed between two runs by more than the solvers differ. docs/results/peers.md
#include "tests/bench/peers_solvers.hpp"
#include "tests/support/recorded_qp.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>

#include <CLI/CLI.hpp>

namespace {

using namespace solenoid;
using namespace solenoid::peers;

struct Options {
  int rounds = 5, repetitions = 11;
  std::vector<int> blocks = {0, 5};
};

struct NamedIsa {
  qp::Isa isa;
  const char* name;
};

/// Those that this processor has.
std::vector<NamedIsa> instruction_sets() {
  std::vector<NamedIsa> all = {{qp::Isa::avx512, "AVX-512"}, {qp::Isa::avx2, "AVX2"}, {qp::Isa::baseline, "baseline"}};
  std::erase_if(all, [](const NamedIsa& one) { return qp::resolve(one.isa) != one.isa; });
  return all;
}

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  const double rank = std::ceil(q * static_cast<double>(values.size()));
  return values[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

/// What one solver did with all instances of a set.
struct Row {
  std::unique_ptr<Contender> solver;
  bool ours = false;
  std::vector<std::vector<double>> rounds_us;  // by instance: the median of its repetitions in each round
  std::vector<double> iterations;
  int unsolved = 0;
  double absolute_error = 0.0, relative_error = 0.0;  // of the cost, the largest

  double time_us(double q) const {
    std::vector<double> of_instances;
    for (const auto& rounds : rounds_us) of_instances.push_back(quantile(rounds, 0.5));
    return quantile(of_instances, q);
  }
};

constexpr double median = 0.5, p99 = 0.99, largest = 1.0;

/// Cost, without x_0's share, of these inputs brought into their bounds and applied: never below the optimum.
double applied_cost(const Problem& problem, const Inputs& inputs) {
  double cost = 0.0;
  qp::OcpStage<4, 3>::X x = problem.x0;
  for (int k = 0; k <= problem.horizon(); ++k) {
    const auto& stage = problem.stages[static_cast<std::size_t>(k)];
    if (k > 0) cost += 0.5 * x.dot(stage.q_matrix * x) + stage.q.dot(x);
    if (k == problem.horizon()) break;
    const qp::OcpStage<4, 3>::U u = inputs[static_cast<std::size_t>(k)].cwiseMax(stage.u_lower).cwiseMin(stage.u_upper);
    cost += 0.5 * u.dot(stage.r_matrix * u) + u.dot(stage.s_matrix * x) + stage.r.dot(u);
    x = stage.a * x + stage.b * u + stage.c;
  }
  return cost;
}

/// The least cost that tight solves by both programs come to; prints how far from it they and the record are.
///
/// throws  std::runtime_error where they differ by more than the errors that are to be judged
std::vector<double> optima(const std::vector<test::RecordedQp>& all) {
  const auto& like = all.front().problem;
  Solenoid ours("", like, {.tolerance = 1e-11, .gap_relative = 1e-12, .gap_absolute = 1e-15});
  Hpipm theirs("", like.horizon(), {.mode = ROBUST, .mu0 = 1.0, .tolerance = 1e-13});
  std::vector<double> least;
  double between = 0.0, recorded = 0.0, recorded_relative = 0.0, smallest = INFINITY;
  for (const auto& one : all) {
    const auto cost = [&](Contender& solver) {
      return solver.pose(one.problem), solver.solve(), applied_cost(one.problem, solver.inputs());
    };
    const double a = cost(ours), b = cost(theirs);
    least.push_back(std::min(a, b));
    between = std::max(between, std::abs(a - b) / std::abs(least.back()));
    const double off = std::abs(one.optimal_cost - least.back());
    recorded = std::max(recorded, off);
    recorded_relative = std::max(recorded_relative, off / std::abs(least.back()));
    smallest = std::min(smallest, std::abs(least.back()));
  }
  std::printf(
      "optima: least %.1e; tight solves by Solenoid and HPIPM differ by at most %.1e of it, the recorded ones from "
      "their least by %.1e, %.1e of it\n",
      smallest, between, recorded, recorded_relative);
  if (!(std::max(between, recorded_relative) < 5e-8))
    throw std::runtime_error("the optima are not known well enough to judge by");
  return least;
}

std::vector<Row> contenders(const Problem& like, const Options& options) {
  std::vector<Row> rows;
  const auto ours = [&](const std::string& name, const qp::Settings& settings) {
    rows.emplace_back().solver = std::make_unique<Solenoid>(name, like, settings);
    rows.back().ours = true;
  };
  for (const auto& [isa, name] : instruction_sets()) {
    ours(std::string(name) + ", shipped", {.isa = isa});
    ours(std::string(name) + ", interior point", {.active_set_steps = 0, .isa = isa});
    // Stops where HPIPM's SPEED_ABS does, on the products alone.
    ours(std::string(name) + ", interior point, rough",
         {.tolerance = 1e-8, .gap_relative = 1e9, .active_set_steps = 0, .isa = isa});
  }
  const std::pair<hpipm_mode, const char*> modes[] = {{SPEED_ABS, "SPEED_ABS"}, {SPEED, "SPEED"}, {BALANCE, "BALANCE"}};
  for (const auto& [mode, mode_name] : modes) {
    for (const double tolerance : {1e-8, 1e-10, 1e-12}) {
      for (const double mu0 : {0.1, 1.0}) {
        for (const int blocks : options.blocks) {
          char name[80];
          std::snprintf(name, sizeof name, "HPIPM %s %.0e, mu0 %g, %s", mode_name, tolerance, mu0,
                        blocks > 0 ? ("N2 = " + std::to_string(blocks)).c_str() : "not condensed");
          rows.emplace_back().solver =
              std::make_unique<Hpipm>(name, like.horizon(), HpipmSettings{mode, mu0, tolerance, blocks});
        }
      }
    }
  }
  return rows;
}

double timed_us(Contender& solver, int repetitions) {
  std::vector<double> times;
  solver.solve();  // brings its memory into the caches
  for (int i = 0; i < repetitions; ++i) {
    const auto start = std::chrono::steady_clock::now();
    solver.solve();
    times.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
  }
  return quantile(std::move(times), median);
}

void judge(Row& row, const Problem& problem, double optimum) {
  const double error = std::abs(applied_cost(problem, row.solver->inputs()) - optimum);
  row.iterations.push_back(row.solver->iterations());
  row.unsolved += !row.solver->solved();
  // Inputs that are not numbers are as wrong as can be.
  row.absolute_error = std::isfinite(error) ? std::max(row.absolute_error, error) : INFINITY;
  row.relative_error =
      std::max(row.relative_error, row.absolute_error < INFINITY ? error / std::abs(optimum) : INFINITY);
}

void measure(std::vector<Row>& rows, const std::vector<test::RecordedQp>& all, const std::vector<double>& optimum,
             const Options& options) {
  for (auto& row : rows) row.rounds_us.resize(all.size());
  for (int round = 0; round < options.rounds; ++round) {
    for (std::size_t i = 0; i < all.size(); ++i) {
      for (auto& row : rows) {
        row.solver->pose(all[i].problem);
        row.rounds_us[i].push_back(timed_us(*row.solver, options.repetitions));
        if (round == 0) judge(row, all[i].problem, optimum[i]);
      }
    }
  }
}

void print(const std::vector<Row>& rows, int horizon, std::size_t instances) {
  const auto which = static_cast<int>(std::ceil(p99 * static_cast<double>(instances)));
  std::printf("N = %d; us: median, %dth and largest of %zu instances; largest error of the cost\n", horizon, which,
              instances);
  std::printf("%-46s %8s %6dth %8s   %-17s %8s   %10s %10s\n", "", "median", which, "largest", "iterations, most",
              "unsolved", "absolute", "relative");
  for (const Row& row : rows) {
    double sum = 0.0;
    for (const double one : row.iterations) sum += one;
    std::printf("%-46s %8.1f %8.1f %8.1f   %10.2f %6.0f %8d   %10.1e %10.1e\n", row.solver->name().c_str(),
                row.time_us(median), row.time_us(p99), row.time_us(largest),
                sum / static_cast<double>(row.iterations.size()), quantile(row.iterations, largest), row.unsolved,
                row.absolute_error, row.relative_error);
  }
}

/// HPIPM's way that is quickest by this quantile among those that solve all and pass; null: none.
const Row* quickest(const std::vector<Row>& rows, double q, const std::function<bool(const Row&)>& accurate) {
  const Row* best = nullptr;
  for (const Row& row : rows) {
    if (row.ours || row.unsolved > 0 || !accurate(row)) continue;
    if (best == nullptr || row.time_us(q) < best->time_us(q)) best = &row;
  }
  return best;
}

void print_ratio(const Row& ours, const std::vector<Row>& rows, const char* class_name,
                 const std::function<bool(const Row&)>& accurate) {
  const Row* by_median = quickest(rows, median, accurate);
  const Row* by_largest = quickest(rows, largest, accurate);
  if (by_median == nullptr) {
    std::printf("%-32s %-14s HPIPM has none\n", ours.solver->name().c_str(), class_name);
    return;
  }
  const auto ratio = [&](const Row& theirs, double q) { return ours.time_us(q) / theirs.time_us(q); };
  std::printf("%-32s %-14s %8.2f %8.2f %8.2f   %-40s %8.2f   %s\n", ours.solver->name().c_str(), class_name,
              ratio(*by_median, median), ratio(*by_median, p99), ratio(*by_median, largest),
              by_median->solver->name().c_str(), ratio(*by_largest, largest), by_largest->solver->name().c_str());
}

void print_ratios(const std::vector<Row>& rows) {
  std::printf("Solenoid / HPIPM\n%-32s %-14s %8s %8s %8s   %-40s %8s   %s\n", "", "HPIPM's error", "median", "99%",
              "largest", "to its least median", "largest", "to its least largest");
  for (const Row& row : rows) {
    if (!row.ours) continue;
    print_ratio(row, rows, "1e-6 absolute", [](const Row& theirs) { return theirs.absolute_error <= 1e-6; });
    // Where the active set makes ours exact nobody else could compete: 1e-7 counts as equal.
    const double own = std::max(row.relative_error, 1e-7);
    print_ratio(row, rows, "as ours", [own](const Row& theirs) { return theirs.relative_error <= own; });
  }
}

}  // namespace

int main(int argc, char** argv) try {
  Options options;
  CLI::App app("Solenoid's QP solver beside HPIPM's on the recorded problems, in turn on each instance");
  app.add_option("--rounds", options.rounds, "over all instances; an instance's time is the median of them")
      ->check(CLI::PositiveNumber);
  app.add_option("--repetitions", options.repetitions, "in a row, in each round; their median counts")
      ->check(CLI::PositiveNumber);
  app.add_option("--blocks", options.blocks, "stages that HPIPM condenses to, one after the other; 0: not condensed")
      ->delimiter(',')
      ->check(CLI::Range(0, 20));
  CLI11_PARSE(app, argc, argv);
  std::printf("BLASFEO for %s; %d rounds of %d repetitions\n", SOLENOID_BLASFEO_TARGET, options.rounds,
              options.repetitions);
  for (const int horizon : {20, 40}) {
    const auto all = test::recorded_qps(horizon);
    const auto optimum = optima(all);
    auto rows = contenders(all.front().problem, options);
    measure(rows, all, optimum, options);
    print(rows, horizon, all.size());
    print_ratios(rows);
  }
} catch (const std::exception& error) {
  std::fprintf(stderr, "bench_peers: %s\n", error.what());
  return 1;
}
