// Solves the recorded problems of an instance file with the installed library: the solver the variant names, and
// another one that knows nothing of SIMD. Fails unless each finds the plan and the cost of the record, bit for bit.
#include <cstdio>
#include <exception>

#include <solenoid/controllers/instances/instance_set.hpp>
#include <solenoid/controllers/systems/actuator/actuator_variant.hpp>
#include <solenoid/solvers/search/exhaustive.hpp>

namespace {

using namespace solenoid;

struct Count {
  int solved = 0, same = 0, enumerated = 0, enumerated_same = 0;
};

/// Instances that the scalar enumeration is fast enough for.
constexpr std::size_t most_sequences = 1000;

template <HybridModel Model>
void solve_all(const InstanceSet& set, const VariantInstances& variant, Count& count) {
  const auto solver = make_solver<Model>(variant.config.solver);
  Exhaustive<Model> enumeration;
  for (std::uint32_t motion = 0; motion < set.motions.size(); ++motion) {
    auto problem = make_problem<Model>(told(variant.config, set.motions[motion]));
    solver->prepare(problem);
    enumeration.prepare(problem);
    std::size_t sequences = 1;
    for (std::size_t b = 0; b < problem.horizon.blocks.size(); ++b)
      sequences *= static_cast<std::size_t>(problem.modes.size());
    Plan<Model> plan(problem);
    for (std::size_t i = 0; i < variant.records.size(); ++i) {
      const InstanceRecord& record = variant.records[i];
      if (record.motion != motion) continue;
      pose(set, record, problem, plan);
      const SolveReport report = solver->solve(problem, plan, Deadline::never());
      ++count.solved;
      count.same += same_plan(record, plan) && report.cost == record.plan_cost;
      if (sequences > most_sequences || i % 20 != 0) continue;
      pose(set, record, problem, plan);
      const SolveReport judged = enumeration.solve(problem, plan, Deadline::never());
      ++count.enumerated;
      count.enumerated_same += same_plan(record, plan) && judged.cost == record.plan_cost;
    }
  }
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) return 2;
  const InstanceSet set = read_instances(argv[1]);
  bool all = !set.variants.empty();
  for (const VariantInstances& variant : set.variants) {
    Count count;
    if (actuator(variant.config).motor == "in_prediction")
      solve_all<PrestabilisedActuator>(set, variant, count);
    else
      solve_all<PneumaticActuator>(set, variant, count);
    std::printf("%s: %d of %d plans as recorded, %d of %d by enumeration\n", variant.name.c_str(), count.same,
                count.solved, count.enumerated_same, count.enumerated);
    all = all && count.solved > 0 && count.same == count.solved && count.enumerated_same == count.enumerated;
  }
  return all ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
