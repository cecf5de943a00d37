#pragma once

#include "core/mpc/relaxation.hpp"

#include <random>

namespace solenoid::test {

/// A relaxed solver that answers with weights drawn anew for each problem: roundings must cope with any.
template <HybridModel M>
class DrawnWeights final : public RelaxedSolver<M> {
 public:
  explicit DrawnWeights(unsigned seed, Status status = Status::feasible) : random_(seed), status_(status) {}
  void prepare(const Problem<M>&, const RelaxedGrid& grid) override { grid_ = grid; }
  SolveReport solve(const Problem<M>& problem, RelaxedPlan<M>& plan, Deadline) noexcept override {
    std::uniform_real_distribution unit(0.0, 1.0);
    for (std::size_t k = 0; k < plan.intervals(); ++k) {
      double sum = 0.0;
      for (double& a : plan.row(k)) sum += a = unit(random_) * unit(random_);
      for (double& a : plan.row(k)) a /= sum;
    }
    SolveReport report;
    report.status = status_;
    report.cost = relaxed_cost(problem, grid_, plan);
    return report;
  }

 private:
  std::mt19937_64 random_;
  RelaxedGrid grid_;
  Status status_;
};

}  // namespace solenoid::test
