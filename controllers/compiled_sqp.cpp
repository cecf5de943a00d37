#include "controllers/compiled_solvers.hpp"
#include "solvers/sqp/sqp.hpp"

namespace solenoid {
namespace {

/// The Sqp of whatever size the problem turns out to need.
template <HybridModel Model>
class SizedSqp final : public RelaxedSolver<Model> {
 public:
  void prepare(const Problem<Model>& problem, const RelaxedGrid& grid) override {
    sqp_ = make_sqp(problem, {.max_iterations = 8}, std::tuple<SqpSize<2, 2>, SqpSize<4, 4>>());
    sqp_->prepare(problem, grid);
  }
  SolveReport solve(const Problem<Model>& problem, RelaxedPlan<Model>& plan, Deadline deadline) noexcept override {
    return sqp_->solve(problem, plan, deadline);
  }
  bool anticipates() const override { return sqp_->anticipates(); }
  void anticipate(const Problem<Model>& expected, const RelaxedPlan<Model>& warm_start) noexcept override {
    sqp_->anticipate(expected, warm_start);
  }
  bool time_phases(PhaseTimes* into) noexcept override { return sqp_->time_phases(into); }

 private:
  std::unique_ptr<RelaxedSolver<Model>> sqp_;
};

}  // namespace

const MakerFor<AllModels, RelaxedPtr, AsCompiled>& relaxed_sqp_makers() {
  static const MakerFor<AllModels, RelaxedPtr, AsCompiled> makers = []<ActuatorModel M>(AsCompiled) -> RelaxedPtr<M> {
    return std::make_unique<SizedSqp<M>>();
  };
  return makers;
}

}  // namespace solenoid
