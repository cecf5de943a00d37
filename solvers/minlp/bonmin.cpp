#include "solvers/minlp/bonmin.hpp"

#include <stdexcept>

#ifdef SOLENOID_HAVE_BONMIN
#include <cmath>
#include <mutex>

#include <BonBonminSetup.hpp>
#include <BonCbc.hpp>
#include <BonTMINLP.hpp>
#include <CoinError.hpp>
#endif

namespace solenoid::minlp {

#ifdef SOLENOID_HAVE_BONMIN
namespace {

using Ipopt::Index;
using Ipopt::Number;

/// The function with one equation an interval, the sum of its choices, as Bonmin asks for it.
class Choices final : public Bonmin::TMINLP {
 public:
  Choices(Function& function, const std::vector<double>& start, Answer& answer)
      : function_(function), start_(start), answer_(answer), gradient_(start.size()) {}

  bool get_variables_types(Index n, VariableType* types) override {
    for (Index i = 0; i < n; ++i) types[i] = i < choices() ? BINARY : CONTINUOUS;
    return true;
  }
  bool get_variables_linearity(Index n, Ipopt::TNLP::LinearityType* types) override {
    std::fill_n(types, n, Ipopt::TNLP::NON_LINEAR);
    return true;
  }
  bool get_constraints_linearity(Index m, Ipopt::TNLP::LinearityType* types) override {
    std::fill_n(types, m, Ipopt::TNLP::LINEAR);
    return true;
  }
  bool get_nlp_info(Index& n, Index& m, Index& jacobian, Index& hessian, Ipopt::TNLP::IndexStyleEnum& style) override {
    n = static_cast<Index>(start_.size());
    m = function_.intervals;
    jacobian = choices();
    hessian = 0;  // limited memory
    style = Ipopt::TNLP::C_STYLE;
    return true;
  }
  bool get_bounds_info(Index n, Number* lower, Number* upper, Index m, Number* g_lower, Number* g_upper) override {
    for (Index i = 0; i < n; ++i) {
      const bool choice = i < choices();
      lower[i] = choice ? 0.0 : function_.lower[static_cast<std::size_t>(i - choices())];
      upper[i] = choice ? 1.0 : function_.upper[static_cast<std::size_t>(i - choices())];
    }
    std::fill_n(g_lower, m, 1.0);
    std::fill_n(g_upper, m, 1.0);
    return true;
  }
  bool get_starting_point(Index, bool, Number* x, bool, Number*, Number*, Index, bool, Number*) override {
    std::copy(start_.begin(), start_.end(), x);
    return true;
  }
  bool eval_f(Index n, const Number* x, bool, Number& value) override {
    value = function_(std::span(x, static_cast<std::size_t>(n)), gradient_);
    return std::isfinite(value);
  }
  bool eval_grad_f(Index n, const Number* x, bool, Number* gradient) override {
    const auto size = static_cast<std::size_t>(n);
    return std::isfinite(function_(std::span(x, size), std::span(gradient, size)));
  }
  bool eval_g(Index, const Number* x, bool, Index m, Number* g) override {
    for (Index k = 0; k < m; ++k) {
      g[k] = 0.0;
      for (Index i = 0; i < function_.modes; ++i) g[k] += x[k * function_.modes + i];
    }
    return true;
  }
  bool eval_jac_g(Index, const Number*, bool, Index, Index entries, Index* row, Index* column,
                  Number* values) override {
    for (Index i = 0; i < entries; ++i) {
      if (values != nullptr) values[i] = 1.0;
      if (row != nullptr) row[i] = i / function_.modes, column[i] = i;
    }
    return true;
  }
  bool eval_h(Index, const Number*, bool, Number, Index, const Number*, bool, Index, Index*, Index*, Number*) override {
    return false;
  }
  void finalize_solution(SolverReturn, Index n, const Number* x, Number) override {
    if (x == nullptr) return;
    answer_.x.assign(x, x + n);
    answer_.found = true;
  }
  const SosInfo* sosConstraints() const override { return nullptr; }
  const BranchingInfo* branchingInfo() const override { return nullptr; }

 private:
  Index choices() const { return function_.intervals * function_.modes; }

  Function& function_;
  const std::vector<double>& start_;
  Answer& answer_;
  std::vector<double> gradient_;
};

void configure(Bonmin::BonminSetup& setup, double seconds) {
  setup.initializeOptionsAndJournalist();
  const auto options = setup.options();
  options->SetStringValue("bonmin.algorithm", "B-BB");
  options->SetNumericValue("bonmin.time_limit", std::min(seconds, 1e9));
  options->SetStringValue("hessian_approximation", "limited-memory");
  options->SetStringValue("sb", "yes");
  options->SetIntegerValue("print_level", 0);
  options->SetIntegerValue("bonmin.bb_log_level", 0);
  options->SetIntegerValue("bonmin.nlp_log_level", 0);
  options->SetIntegerValue("bonmin.lp_log_level", 0);
  options->SetIntegerValue("bonmin.milp_log_level", 0);
}

}  // namespace

Answer minimise(Function& function, const std::vector<double>& start, double seconds) {
  static std::mutex one_at_a_time;  // two Ipopt instances at once corrupt memory here
  const std::scoped_lock lock(one_at_a_time);
  Answer answer;
  const Ipopt::SmartPtr<Bonmin::TMINLP> problem = new Choices(function, start, answer);
  Bonmin::BonminSetup setup;
  configure(setup, seconds);
  try {
    setup.initialize(problem);
    Bonmin::Bab search;
    search(setup);
    answer.ended =
        search.mipStatus() == Bonmin::Bab::FeasibleOptimal || search.mipStatus() == Bonmin::Bab::ProvenInfeasible;
    answer.nodes = search.numNodes();
  } catch (const CoinError& error) {
    throw std::runtime_error(error.message());
  } catch (Bonmin::TNLPSolver::UnsolvedError* error) {
    const std::string message = error->errorName();
    delete error;
    throw std::runtime_error(message);
  }
  return answer;
}

bool available() { return true; }

#else

Answer minimise(Function&, const std::vector<double>&, double) {
  throw std::runtime_error("Bonmin is not built in: apt-get install coinor-libbonmin-dev");
}

bool available() { return false; }

#endif

}  // namespace solenoid::minlp
