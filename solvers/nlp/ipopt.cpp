#include "solvers/nlp/nlp.hpp"

#include <mutex>

// Ipopt 3.11's headers want to be told which standard headers there are.
#define HAVE_CSTDDEF
#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>
#include <IpTNLP.hpp>

namespace solenoid::nlp {
namespace {

using Ipopt::Index;
using Ipopt::Number;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

class Adapter final : public Ipopt::TNLP {
 public:
  Adapter(Program& program, std::vector<double>& z, Deadline deadline)
      : program_(program), z_(z), deadline_(deadline) {}

  bool stopped() const { return stopped_; }
  double objective() const { return objective_; }

  bool get_nlp_info(Index& n, Index& m, Index& jacobian, Index& hessian, IndexStyleEnum& style) override {
    n = static_cast<Index>(program_.lower.size());
    m = static_cast<Index>(program_.g_lower.size());
    jacobian = static_cast<Index>(program_.jacobian.size());
    hessian = static_cast<Index>(program_.hessian.size());
    style = C_STYLE;
    return true;
  }
  bool get_bounds_info(Index, Number* lower, Number* upper, Index, Number* g_lower, Number* g_upper) override {
    std::copy(program_.lower.begin(), program_.lower.end(), lower);
    std::copy(program_.upper.begin(), program_.upper.end(), upper);
    std::copy(program_.g_lower.begin(), program_.g_lower.end(), g_lower);
    std::copy(program_.g_upper.begin(), program_.g_upper.end(), g_upper);
    return true;
  }
  bool get_starting_point(Index, bool, Number* z, bool, Number*, Number*, Index, bool, Number*) override {
    std::copy(z_.begin(), z_.end(), z);
    return true;
  }
  bool eval_f(Index n, const Number* z, bool, Number& value) override {
    value = program_.objective({z, at(n)});
    return true;
  }
  bool eval_grad_f(Index n, const Number* z, bool, Number* out) override {
    program_.gradient({z, at(n)}, {out, at(n)});
    return true;
  }
  bool eval_g(Index n, const Number* z, bool, Index m, Number* out) override {
    program_.constraints({z, at(n)}, {out, at(m)});
    return true;
  }
  bool eval_jac_g(Index n, const Number* z, bool, Index, Index count, Index* rows, Index* columns,
                  Number* out) override {
    if (out) {
      program_.jacobian_values({z, at(n)}, {out, at(count)});
      return true;
    }
    pattern(program_.jacobian, rows, columns);
    return true;
  }
  bool eval_h(Index n, const Number* z, bool, Number factor, Index m, const Number* lambda, bool, Index count,
              Index* rows, Index* columns, Number* out) override {
    if (out) {
      program_.hessian_values({z, at(n)}, factor, {lambda, at(m)}, {out, at(count)});
      return true;
    }
    pattern(program_.hessian, rows, columns);
    return true;
  }
  bool intermediate_callback(Ipopt::AlgorithmMode, Index, Number, Number, Number, Number, Number, Number, Number,
                             Number, Index, const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    stopped_ = deadline_.passed();
    return !stopped_;
  }
  void finalize_solution(Ipopt::SolverReturn, Index n, const Number* z, const Number*, const Number*, Index,
                         const Number*, const Number*, Number objective, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {
    z_.assign(z, z + n);
    objective_ = objective;
  }

 private:
  static void pattern(const std::vector<Program::Entry>& entries, Index* rows, Index* columns) {
    for (std::size_t i = 0; i < entries.size(); ++i) rows[i] = entries[i].row, columns[i] = entries[i].column;
  }

  Program& program_;
  std::vector<double>& z_;
  Deadline deadline_;
  bool stopped_ = false;
  double objective_ = 0.0;
};

Status status_of(Ipopt::ApplicationReturnStatus outcome, bool stopped) {
  if (stopped) return Status::deadline_reached;
  switch (outcome) {
    case Ipopt::Solve_Succeeded:
      return Status::optimal;
    case Ipopt::Solved_To_Acceptable_Level:
      return Status::feasible;
    case Ipopt::Maximum_Iterations_Exceeded:
      return Status::iteration_limit;
    case Ipopt::Infeasible_Problem_Detected:
      return Status::infeasible;
    default:
      return Status::numerical_failure;
  }
}

IpoptResult run(Program& program, std::vector<double>& z, const IpoptSettings& settings, Deadline deadline) {
  Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication();
  application->Options()->SetIntegerValue("print_level", 0);
  application->Options()->SetStringValue("sb", "yes");
  application->Options()->SetIntegerValue("max_iter", settings.max_iterations);
  application->Options()->SetNumericValue("tol", settings.tolerance);
  application->Options()->SetStringValue("linear_solver", "mumps");
  if (application->Initialize("") != Ipopt::Solve_Succeeded) return {};
  Adapter* adapter = new Adapter(program, z, deadline);
  const Ipopt::SmartPtr<Ipopt::TNLP> owner = adapter;
  const auto outcome = application->OptimizeTNLP(owner);
  const auto statistics = application->Statistics();
  return {status_of(outcome, adapter->stopped()), adapter->objective(),
          IsValid(statistics) ? statistics->IterationCount() : 0};
}

}  // namespace

IpoptResult solve_with_ipopt(Program& program, std::vector<double>& z, const IpoptSettings& settings,
                             Deadline deadline) noexcept {
  static std::mutex one_at_a_time;
  try {
    const std::lock_guard lock(one_at_a_time);
    return run(program, z, settings, deadline);
  } catch (...) {  // what Ipopt throws it documents as its own failures
    return {};
  }
}

}  // namespace solenoid::nlp
