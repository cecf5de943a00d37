#include "solvers/minlp/bonmin.hpp"

#include <stdexcept>

#ifdef SOLENOID_HAVE_BONMIN
#include <cerrno>
#include <cmath>
#include <csignal>

#include <BonBonminSetup.hpp>
#include <BonCbc.hpp>
#include <BonTMINLP.hpp>
#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#endif

namespace solenoid::minlp {

#ifdef SOLENOID_HAVE_BONMIN
namespace {

constexpr double grace_s = 1.0;  // beyond its time limit, which Bonmin looks at between nodes

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

const char* name_of(Algorithm algorithm) {
  switch (algorithm) {
    case Algorithm::branch_and_bound:
      return "B-BB";
    case Algorithm::outer_approximation:
      return "B-OA";
    case Algorithm::feasibility_pump:
      return "B-iFP";
  }
  return "B-BB";
}

void configure(Bonmin::BonminSetup& setup, double seconds, Algorithm algorithm) {
  setup.initializeOptionsAndJournalist();
  const auto options = setup.options();
  options->SetStringValue("bonmin.algorithm", name_of(algorithm));
  options->SetNumericValue("bonmin.time_limit", std::min(seconds, 1e9));
  options->SetStringValue("hessian_approximation", "limited-memory");
  options->SetStringValue("sb", "yes");
  options->SetIntegerValue("print_level", 0);
  options->SetIntegerValue("bonmin.bb_log_level", 0);
  options->SetIntegerValue("bonmin.nlp_log_level", 0);
  options->SetIntegerValue("bonmin.lp_log_level", 0);
  options->SetIntegerValue("bonmin.milp_log_level", 0);
}

/// Bonmin itself, in this process. False if it failed in a way it reports.
bool search(Function& function, const std::vector<double>& start, double seconds, Algorithm algorithm, Answer& answer) {
  try {
    const Ipopt::SmartPtr<Bonmin::TMINLP> problem = new Choices(function, start, answer);
    Bonmin::BonminSetup setup;
    configure(setup, seconds, algorithm);
    setup.initialize(problem);
    Bonmin::Bab tree;
    tree(setup);
    answer.ended =
        tree.mipStatus() == Bonmin::Bab::FeasibleOptimal || tree.mipStatus() == Bonmin::Bab::ProvenInfeasible;
    answer.nodes = tree.numNodes();
    return true;
  } catch (...) {  // it throws its own types and pointers to them
    return false;
  }
}

bool write_all(int file, const void* data, std::size_t size) {
  for (const char* from = static_cast<const char*>(data); size > 0;) {
    const ssize_t written = ::write(file, from, size);
    if (written <= 0) return false;
    from += written;
    size -= static_cast<std::size_t>(written);
  }
  return true;
}

/// Reads until `size` bytes are there, the other end closes, or the moment comes.
bool read_all(int file, void* data, std::size_t size, Deadline until) {
  for (char* to = static_cast<char*>(data); size > 0;) {
    const double left_ms = std::min(1e3 * until.seconds_left(), 1e6);
    pollfd waiting{file, POLLIN, 0};
    const int ready = left_ms > 0 ? ::poll(&waiting, 1, static_cast<int>(left_ms) + 1) : 0;
    if (ready < 0 && errno == EINTR) continue;
    if (ready == 0 && until.seconds_left() > 0) continue;
    const ssize_t got = ready > 0 ? ::read(file, to, size) : 0;
    if (got <= 0) return false;
    to += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

struct Header {
  int found, ended, nodes;
};

[[noreturn]] void work(int into, Function& function, const std::vector<double>& start, double seconds,
                       Algorithm algorithm) {
  const int nowhere = ::open("/dev/null", O_WRONLY);
  ::dup2(nowhere, STDOUT_FILENO);
  ::dup2(nowhere, STDERR_FILENO);
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  Answer answer;
  if (!search(function, start, seconds, algorithm, answer)) ::_exit(1);
  answer.x.resize(start.size());
  const Header header{answer.found, answer.ended, answer.nodes};
  const bool sent =
      write_all(into, &header, sizeof header) && write_all(into, answer.x.data(), answer.x.size() * sizeof(double));
  ::_exit(sent ? 0 : 1);
}

}  // namespace

Answer minimise(Function& function, const std::vector<double>& start, double seconds, Algorithm algorithm) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("bonmin: no pipe");
  const pid_t child = ::fork();
  if (child == 0) work(ends[1], function, start, seconds, algorithm);
  ::close(ends[1]);
  Answer answer;
  answer.x.resize(start.size());
  Header header{};
  bool whole = false;
  if (child > 0) {
    const Deadline until = std::isfinite(seconds) ? Deadline::after(std::chrono::milliseconds(static_cast<std::int64_t>(
                                                        1e3 * std::min(std::max(seconds, 0.0) + grace_s, 1e9))))
                                                  : Deadline::never();
    whole = read_all(ends[0], &header, sizeof header, until) &&
            read_all(ends[0], answer.x.data(), answer.x.size() * sizeof(double), until);
    answer.overran = !whole && until.passed();
    if (!whole) ::kill(child, SIGKILL);
    while (::waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  ::close(ends[0]);
  if (!whole && !answer.overran) throw std::runtime_error("bonmin: its process failed");
  answer.found = whole && header.found != 0;
  answer.ended = whole && header.ended != 0;
  answer.nodes = header.nodes;
  return answer;
}

bool available() { return true; }

#else

Answer minimise(Function&, const std::vector<double>&, double, Algorithm) {
  throw std::runtime_error("Bonmin is not built in: apt-get install coinor-libbonmin-dev");
}

bool available() { return false; }

#endif

}  // namespace solenoid::minlp
