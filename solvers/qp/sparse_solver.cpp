#include "solvers/qp/sparse_solver.hpp"

namespace solenoid::qp {

void SparseSolver::setup(const SparseQp& problem, const Settings& settings) {
  kkt_.setup(problem, settings);
  method_.setup(kkt_, settings);
}

Info SparseSolver::solve(const SparseQp& problem, SparseSolution& solution, Start start, Deadline deadline) noexcept {
  if (!kkt_.load(problem)) return Info{.status = Status::invalid_problem};
  if (start == Start::warm) kkt_.repack(solution, method_.w, method_.y, method_.rows.zeta);
  const Info info = method_.solve(kkt_, start == Start::warm, deadline);
  kkt_.unpack(method_.w, method_.y, method_.rows.zeta, solution);
  return info;
}

}  // namespace solenoid::qp
