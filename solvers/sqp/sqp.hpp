#pragma once

#include "core/mpc/phases.hpp"
#include "solvers/qp/ocp_solver.hpp"
#include "solvers/relaxed/dual.hpp"
#include "solvers/relaxed/transcription.hpp"

#include <memory>
#include <string>
#include <tuple>
#include <utility>

#include <unsupported/Eigen/AutoDiff>

namespace solenoid {

/// When Sqp ends, and how carefully it steps.
struct SqpSettings {
  int max_iterations = 40;
  double tolerance = 1e-6;       ///< ends when a step promises less than this share of the cost ...
  double defect = 1e-6;          ///< ... and the trajectory's gaps are below this, in units of HasStateScale
  double regularisation = 1e-6;  ///< added to the input Hessian, relative to the cost's own scale
  double damping = 1e-2;         ///< the same after a step was refused; tenfold at each further refusal
  int refusals = 4;              ///< steps refused in a row before the search ends
  qp::Settings qp{.max_iterations = 60, .tolerance = 1e-7, .gap_relative = 1e-6};
};

/// Sequential quadratic programming on the multiple-shooting transcription.             [theory-relaxed.md, sect. 4]
///
/// hessian    Gauss-Newton of the tracking terms, exact of effort and switching, of consumption the diagonally dominant
///            part in the switched inputs: positive semidefinite, plus regularisation
/// steps      QP by the stagewise interior point, then backtracking on  cost + nu |defects|_1; a refused step comes
///            back damped
/// physics    derivatives and merit of the model's smooth step where it has one; every accepted point is judged by
///            the exact physics, and the best of them, warm start included, is the result
/// real time  anticipate() linearises along the warm start from the state as it is forecast; the next solve of a problem
///            that is otherwise the same takes that for its first iteration and puts the measured state in [5]. With
///            max_iterations = 1 that is the real-time iteration.
/// status     optimal: a first-order point of the smooth problem; feasible: no better point was found along the
///            steps (at a kink or a jump); infeasible: no inputs meet the linearised state bounds;
///            numerical_failure: the warm start's prediction is not finite; deadline_reached, iteration_limit
template <HybridModel M, int P, int A>
class Sqp final : public RelaxedSolver<M> {
 public:
  using Trans = Transcription<M, P, A>;

  explicit Sqp(const SqpSettings& settings = {}) : settings_(settings) {}

  void prepare(const Problem<M>& problem, const RelaxedGrid& grid) override;
  SolveReport solve(const Problem<M>& problem, RelaxedPlan<M>& plan, Deadline deadline) noexcept override;
  bool anticipates() const override { return true; }
  void anticipate(const Problem<M>& expected, const RelaxedPlan<M>& warm_start) noexcept override;
  bool time_phases(PhaseTimes* into) noexcept override {
    phases_ = into;
    return true;
  }

 private:
  static constexpr int NX = Trans::NX, NU = Trans::NU, X = Trans::X, U = Trans::U, V = Trans::V;
  using StateDual = Dual<NX>;
  using State = StateOf<M>;
  using Input = typename Trans::Input;
  template <class T>
  using List = std::vector<T, Eigen::aligned_allocator<T>>;

  struct Point {
    std::vector<State> x;  ///< stages + 1
    List<Input> w;         ///< stages
  };
  enum class Nodes : std::uint8_t { keep, simulate };
  /// What a linearisation depends on beside the state and the plan.
  struct Anticipated {
    bool ready = false;
    std::int64_t begins = 0;
    DelayLines lines;
    std::vector<OutputOf<M>> reference, setpoint;
  };

  bool take_anticipated(const Problem<M>& problem) noexcept;
  void take_measured(const Problem<M>& problem, bool solved, RelaxedPlan<M>& plan) noexcept;
  void load(const Problem<M>& problem, const RelaxedPlan<M>& plan) noexcept;
  bool linearise(const Problem<M>& problem, Nodes nodes) noexcept;
  template <int lanes>
  void linearise_stage(const Problem<M>& problem, std::size_t k, Nodes nodes) noexcept;
  void add_output(const M& model, const OutputOf<M>& weight, const OutputOf<M>& reference, const State& x,
                  qp::OcpStage<X, U>& stage) noexcept;
  void add_switching(const Problem<M>& problem, std::size_t k) noexcept;
  void add_consumption(const Problem<M>& problem, std::size_t k) noexcept;
  void add_effort(const Problem<M>& problem, std::size_t k) noexcept;
  void set_bounds(const Problem<M>& problem, std::size_t k) noexcept;
  qp::Info solve_qp(Deadline deadline) noexcept;
  void guess_active_set() noexcept;
  void damp(double by) noexcept;
  double merit(const Problem<M>& problem, const Point& at) noexcept;
  double slope() const noexcept;
  void raise_penalty() noexcept;
  double largest_defect() const noexcept;
  bool line_search(const Problem<M>& problem, double promised) noexcept;
  void move(double step) noexcept;
  double exact_cost(const Problem<M>& problem, RelaxedPlan<M>& plan) const noexcept;
  void judge(const Problem<M>& problem, RelaxedPlan<M>& best) noexcept;

  SqpSettings settings_;
  PhaseTimes* phases_ = nullptr;
  Trans t_;
  qp::OcpQp<X, U> qp_;
  qp::OcpSolution<X, U> step_;
  qp::OcpSolver<X, U> qp_solver_;
  Point at_, trial_;
  RelaxedPlan<M> candidate_;
  Anticipated anticipated_;
  Input input_scale_ = Input::Ones();  // half the range of a bounded continuous input
  double cost_scale_ = 1.0, cost_ = 0.0, gaps_ = 0.0, penalty_ = 0.0, merit_ = 0.0, damping_ = 0.0;
  double best_cost_ = 0.0;
};

/// Sizes of a transcription: weights of the modes' hull, rows of memory.
template <int weights, int memory>
struct SqpSize {};
/// Of one to two independent switches without and with delays or a switching cost, the two-way valves, and the
/// actuator's subsets of their modes.
using AllSqpSizes =
    std::tuple<SqpSize<1, 0>, SqpSize<1, 1>, SqpSize<2, 0>, SqpSize<2, 2>, SqpSize<4, 4>, SqpSize<6, 5>>;

/// The Sqp of the size that the problem needs, out of those compiled; each costs a compiler half a minute, so ask for
/// few. Throws std::invalid_argument, naming the mode set, where there is none.
template <HybridModel M, class... Sizes>
std::unique_ptr<RelaxedSolver<M>> make_sqp(const Problem<M>& problem, const SqpSettings& settings = {},
                                           const std::tuple<Sizes...>& = AllSqpSizes()) {
  const auto [weights, memory] = transcription_sizes(problem);
  std::unique_ptr<RelaxedSolver<M>> made;
  const auto offer = [&, w = weights, m = memory]<int P, int A>(SqpSize<P, A>) {
    if (w == P && m == A) made = std::make_unique<Sqp<M, P, A>>(settings);
  };
  (offer(Sizes()), ...);
  if (!made) throw std::invalid_argument("sqp: no solver for the size of mode set '" + problem.modes.name() + "'");
  return made;
}

}  // namespace solenoid

#include "solvers/sqp/sqp.ipp"
