#pragma once

#include "core/mpc/deadline.hpp"
#include "core/mpc/plan.hpp"

#include <span>
#include <vector>

namespace solenoid::nlp {

/// A sparse nonlinear program with first and second derivatives.
///
///   minimise f(z)   subject to  g_lower <= g(z) <= g_upper,  lower <= z <= upper
///
/// Evaluations fill preallocated arrays in the order of the pattern; entries that occur twice add up. The Hessian is
/// that of  objective_factor f + lambda'g, lower triangle.
class Program {
 public:
  virtual ~Program() = default;

  /// The place of an entry in the Jacobian or the Hessian.
  struct Entry {
    int row, column;
  };
  std::vector<double> lower, upper, g_lower, g_upper;
  std::vector<Entry> jacobian, hessian;

  virtual double objective(std::span<const double> z) = 0;
  virtual void gradient(std::span<const double> z, std::span<double> out) = 0;
  virtual void constraints(std::span<const double> z, std::span<double> out) = 0;
  virtual void jacobian_values(std::span<const double> z, std::span<double> out) = 0;
  virtual void hessian_values(std::span<const double> z, double objective_factor, std::span<const double> lambda,
                              std::span<double> out) = 0;
};

/// When Ipopt stops by itself.
struct IpoptSettings {
  int max_iterations = 300;
  double tolerance = 1e-8;
};

/// How Ipopt ended.
struct IpoptResult {
  Status status = Status::numerical_failure;
  double objective = 0.0;
  int iterations = 0;
};

/// Solves from z and leaves the last iterate in it. Not real time: allocates, and takes a process-wide lock, because
/// two Ipopts with MUMPS in two threads corrupt each other's memory. The deadline is kept from the intermediate
/// callback, between iterations. No exception leaves.
///
/// status   optimal: a first-order point; feasible: Ipopt's acceptable level; iteration_limit; deadline_reached;
///          infeasible: converged to a point of local infeasibility; numerical_failure: all else
IpoptResult solve_with_ipopt(Program& program, std::vector<double>& z, const IpoptSettings& settings,
                             Deadline deadline) noexcept;

}  // namespace solenoid::nlp
