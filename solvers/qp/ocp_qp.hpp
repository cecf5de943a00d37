#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

namespace solenoid::qp {

/// One stage; defaults are those of an unconstrained stage of zero cost.
template <int NX, int NU>
struct OcpStage {
  static constexpr double infinity = std::numeric_limits<double>::infinity();
  using X = Eigen::Matrix<double, NX, 1>;
  using U = Eigen::Matrix<double, NU, 1>;

  Eigen::Matrix<double, NX, NX> a = Eigen::Matrix<double, NX, NX>::Zero();
  Eigen::Matrix<double, NX, NU> b = Eigen::Matrix<double, NX, NU>::Zero();
  X c = X::Zero();
  Eigen::Matrix<double, NX, NX> q_matrix = Eigen::Matrix<double, NX, NX>::Zero();
  Eigen::Matrix<double, NU, NU> r_matrix = Eigen::Matrix<double, NU, NU>::Zero();
  Eigen::Matrix<double, NU, NX> s_matrix = Eigen::Matrix<double, NU, NX>::Zero();
  X q = X::Zero();
  U r = U::Zero();
  U u_lower = U::Constant(-infinity), u_upper = U::Constant(infinity);
  X x_lower = X::Constant(-infinity), x_upper = X::Constant(infinity);
};

/// Convex QP with the structure of optimal control.
///
///   minimise    sum_{k<N} (x'Q x / 2 + u'S x + u'R u / 2 + q'x + r'u)  +  x_N'Q_N x_N / 2 + q_N'x_N
///   subject to  x_{k+1} = A_k x_k + B_k u_k + c_k,  x_0 given
///               u_lower <= u_k <= u_upper (k < N),  x_lower <= x_k <= x_upper (0 < k <= N, where state_bounds)
///
/// shapes   stages: N + 1, of the last one only Q, q and the bounds of x are read; [Q S'; S R] positive semidefinite
/// note     bounds of x_0, a constant, are not read; infinite bounds are absent
template <int NX, int NU>
struct OcpQp {
  using Stage = OcpStage<NX, NU>;

  explicit OcpQp(int horizon = 0, bool with_state_bounds = false)
      : state_bounds(with_state_bounds), stages(static_cast<std::size_t>(horizon) + 1) {}
  int horizon() const { return static_cast<int>(stages.size()) - 1; }

  bool state_bounds = false;
  typename Stage::X x0 = Stage::X::Zero();
  std::vector<Stage, Eigen::aligned_allocator<Stage>> stages;
};

/// Primal and dual solution, or a certificate where the status says so.
///
/// shapes   u: N, x: N + 1 (x[0] = x0), y: N (of A x + B u + c - x_next = 0), zu: N, zx: N + 1 (zx[0] = 0)
/// signs    a bound's multiplier is positive where the upper bound presses, negative where the lower does
template <int NX, int NU>
struct OcpSolution {
  using X = typename OcpStage<NX, NU>::X;
  using U = typename OcpStage<NX, NU>::U;
  template <class T>
  using List = std::vector<T, Eigen::aligned_allocator<T>>;

  explicit OcpSolution(int horizon = 0)
      : u(index(horizon), U::Zero()),
        x(index(horizon) + 1, X::Zero()),
        y(index(horizon), X::Zero()),
        zu(index(horizon), U::Zero()),
        zx(index(horizon) + 1, X::Zero()) {}

  List<U> u;
  List<X> x, y;
  List<U> zu;
  List<X> zx;

 private:
  static std::size_t index(int i) { return static_cast<std::size_t>(i); }
};

}  // namespace solenoid::qp
