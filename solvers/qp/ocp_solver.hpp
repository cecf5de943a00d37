#pragma once

#include "solvers/qp/riccati_kkt.hpp"

namespace solenoid::qp {

/// Interior point on the Riccati recursion for one horizon.
///
/// promise   setup allocates; solve does not, throws nothing, and always leaves a status saying what `solution` holds
template <int NX, int NU>
class OcpSolver {
 public:
  void setup(const OcpQp<NX, NU>& problem, const Settings& settings = {}) {
    kkt_.setup(problem, settings);
    method_.setup(kkt_, settings);
  }

  Info solve(const OcpQp<NX, NU>& problem, OcpSolution<NX, NU>& solution, Start start = Start::cold,
             Deadline deadline = Deadline::never()) noexcept {
    if (!kkt_.load(problem)) return Info{.status = Status::invalid_problem};
    if (start == Start::warm) kkt_.repack(solution, method_.w, method_.y, method_.rows.zeta);
    const Info info = method_.solve(kkt_, start == Start::warm, deadline);
    kkt_.unpack(method_.w, method_.y, method_.rows.zeta, solution);
    return info;
  }

 private:
  RiccatiKkt<NX, NU> kkt_;
  InteriorPoint<RiccatiKkt<NX, NU>> method_;
};

}  // namespace solenoid::qp
