#pragma once

#include "solvers/qp/sparse_kkt.hpp"

namespace solenoid::qp {

/// Interior point on AMD + LDL for one sparsity pattern.
///
/// promise   setup allocates and throws on shapes that do not fit; solve does neither, and always leaves a status
///           saying what `solution` (sized by SparseSolution(problem)) holds
class SparseSolver {
 public:
  void setup(const SparseQp& problem, const Settings& settings = {});
  Info solve(const SparseQp& problem, SparseSolution& solution, Start start = Start::cold,
             Deadline deadline = Deadline::never()) noexcept;
  const SparseKkt& kkt() const { return kkt_; }

 private:
  SparseKkt kkt_;
  InteriorPoint<SparseKkt> method_;
};

}  // namespace solenoid::qp
