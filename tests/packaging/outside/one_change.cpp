// An own solver on the recorded problems of an instance file, beside the proven optima it holds. Fails where the solver
// breaks a promise: a cost that is not its plan's, one below a proven optimum, or a plan worse than its warm start.
#include "one_change.hpp"

#include <algorithm>
#include <cstdio>
#include <exception>
#include <vector>

#include <solenoid/controllers/instances/instance_set.hpp>
#include <solenoid/controllers/systems/actuator/actuator_variant.hpp>

namespace {

using namespace solenoid;

struct Score {
  std::vector<double> gaps, times_us;
  int broken = 0;
};

template <HybridModel Model>
Score score(const InstanceSet& set, const VariantInstances& variant) {
  Score score;
  OneChange<Model> solver;
  for (std::uint32_t motion = 0; motion < set.motions.size(); ++motion) {
    auto problem = make_problem<Model>(told(variant.config, set.motions[motion]));
    solver.prepare(problem);
    Plan<Model> plan(problem);
    for (const InstanceRecord& record : variant.records) {
      if (record.motion != motion || record.plan_status != Status::optimal) continue;
      pose(set, record, problem, plan);
      const double before = evaluate(problem, plan).cost;
      const SolveReport report = solver.solve(problem, plan, Deadline::never());
      const bool kept = usable(report.status) && evaluate(problem, plan).cost == report.cost && report.cost <= before &&
                        report.cost >= record.plan_cost;
      score.broken += !kept;
      score.gaps.push_back(report.cost == record.plan_cost ? 0.0 : report.cost / record.plan_cost - 1.0);
      score.times_us.push_back(report.time_us);
    }
  }
  return score;
}

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) return 2;
  const InstanceSet set = read_instances(argv[1]);
  int judged = 0, broken = 0;
  for (const VariantInstances& variant : set.variants) {
    const bool in_prediction = actuator(variant.config).motor == "in_prediction";
    const Score s = in_prediction ? score<PrestabilisedActuator>(set, variant) : score<PneumaticActuator>(set, variant);
    if (s.gaps.empty()) continue;
    const auto optimal = std::count_if(s.gaps.begin(), s.gaps.end(), [](double gap) { return gap <= 0.0; });
    std::printf("%-18s %3d %% of %zu at the optimum, gap p90 %6.1f %%, time p50 %5.0f us\n", variant.name.c_str(),
                static_cast<int>(100 * optimal / static_cast<long>(s.gaps.size())), s.gaps.size(),
                100.0 * quantile(s.gaps, 0.9), quantile(s.times_us, 0.5));
    judged += static_cast<int>(s.gaps.size());
    broken += s.broken;
  }
  std::printf("%d of %d solves broke a promise\n", broken, judged);
  return judged > 0 && broken == 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
