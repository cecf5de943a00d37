// Bodies of sqp.hpp.
namespace solenoid {

template <HybridModel M, int P, int A>
void Sqp<M, P, A>::prepare(const Problem<M>& problem, const RelaxedGrid& grid) {
  t_.prepare(problem, grid);
  const auto stages = static_cast<int>(t_.stages());
  qp_ = qp::OcpQp<X, U>(stages, t_.sums > 0 || problem.bounds.constrain_state());
  step_ = qp::OcpSolution<X, U>(stages);
  qp_solver_.setup(qp_, settings_.qp);
  for (Point* point : {&at_, &trial_}) {
    point->x.assign(t_.stages() + 1, State{});
    point->w.assign(t_.stages(), Input::Zero());
  }
  candidate_ = RelaxedPlan<M>(problem, grid);
  anticipated_ = {false, problem.begins, problem.lines, problem.reference, problem.setpoint};
}

template <HybridModel M, int P, int A>
SolveReport Sqp<M, P, A>::solve(const Problem<M>& problem, RelaxedPlan<M>& plan, Deadline deadline) noexcept {
  const auto start = Deadline::Clock::now();
  SolveReport report;
  best_cost_ = exact_cost(problem, plan);
  bool prepared = report.anticipated = take_anticipated(problem);
  if (!prepared) load(problem, plan);
  Nodes nodes = Nodes::simulate;
  penalty_ = 0.0, damping_ = 0.0;
  report.status = std::isfinite(best_cost_) ? Status::iteration_limit : Status::numerical_failure;
  for (int refusals = 0; report.status != Status::numerical_failure && report.nodes < settings_.max_iterations;) {
    if (deadline.passed()) {
      report.status = Status::deadline_reached;
      break;
    }
    if (!prepared && !linearise(problem, nodes)) break;
    damp(damping_);
    ++report.nodes;
    const qp::Info info = solve_qp(deadline);
    if (info.status == qp::Status::primal_infeasible || info.status == qp::Status::deadline_reached) {
      report.status = info.status == qp::Status::deadline_reached ? Status::deadline_reached : Status::infeasible;
      break;
    }
    const bool solved = info.status == qp::Status::optimal || info.status == qp::Status::iteration_limit;
    if (std::exchange(prepared, false)) {
      take_measured(problem, solved, plan);
      nodes = solved ? Nodes::keep : Nodes::simulate;
      continue;
    }
    if (solved) raise_penalty();
    const double promised = solved ? slope() : 0.0;
    if (solved && -promised <= settings_.tolerance * std::abs(merit_) && largest_defect() <= settings_.defect) {
      report.status = Status::optimal;
      break;
    }
    if (solved && line_search(problem, promised)) {
      judge(problem, plan);
      nodes = Nodes::keep, refusals = 0, damping_ *= 0.1;
      continue;
    }
    // Linearisations that lead nowhere: shorter steps from a trajectory without gaps.
    if (++refusals > settings_.refusals) {
      report.status = Status::feasible;
      break;
    }
    nodes = Nodes::simulate, damping_ = std::max(settings_.damping, 10.0 * damping_);
  }
  report.cost = best_cost_;
  report.time_us = us_since(start);
  return report;
}

template <HybridModel M, int P, int A>
void Sqp<M, P, A>::anticipate(const Problem<M>& expected, const RelaxedPlan<M>& warm_start) noexcept {
  load(expected, warm_start);
  penalty_ = damping_ = 0.0;
  anticipated_.ready = linearise(expected, Nodes::simulate);
  anticipated_.begins = expected.begins;
  anticipated_.lines = expected.lines;
  std::ranges::copy(expected.reference, anticipated_.reference.begin());
  std::ranges::copy(expected.setpoint, anticipated_.setpoint.begin());
}

/// After the first QP of an anticipated problem: its whole step, which brings the measured state in and has no merit to
/// be shortened by, since that belongs to the forecast one. Without a solution the solve starts as any other.
template <HybridModel M, int P, int A>
void Sqp<M, P, A>::take_measured(const Problem<M>& problem, bool solved, RelaxedPlan<M>& plan) noexcept {
  if (!solved) return load(problem, plan);
  move(1.0);
  std::swap(at_.x, trial_.x);
  std::swap(at_.w, trial_.w);
  at_.x[0] = problem.initial;
  judge(problem, plan);
}

/// Whether the linearisation at hand was made for this problem; the measured state is then put into it. References are
/// the same but for the rounding of times and what an integral adds in a tick: `near` of what the horizon covers.
template <HybridModel M, int P, int A>
bool Sqp<M, P, A>::take_anticipated(const Problem<M>& problem) noexcept {
  constexpr double near = 1e-3;
  const auto same = [](const std::vector<OutputOf<M>>& was, const std::vector<OutputOf<M>>& is) {
    for (std::size_t i = 0; i < M::output_size; ++i) {
      double spread = 0.0, most = 0.0;
      for (std::size_t j = 0; j < is.size(); ++j) {
        spread = std::max(spread, std::abs(is[j][i] - is[0][i]));
        most = std::max(most, std::abs(is[j][i] - was[j][i]));
      }
      if (most > near * spread + 1e-9) return false;
    }
    return true;
  };
  if (!std::exchange(anticipated_.ready, false) || anticipated_.begins != problem.begins ||
      !(anticipated_.lines == problem.lines) || !same(anticipated_.reference, problem.reference) ||
      !same(anticipated_.setpoint, problem.setpoint))
    return false;
  for (std::size_t i = 0; i < M::state_size; ++i)
    qp_.x0[static_cast<int>(i)] = (problem.initial[i] - at_.x[0][i]) / t_.scale[i];
  return qp_.x0.allFinite();
}

/// The plan as the current point, and the cost's own size: the curvature of one interval's tracking.
template <HybridModel M, int P, int A>
void Sqp<M, P, A>::load(const Problem<M>& problem, const RelaxedPlan<M>& plan) noexcept {
  at_.x[0] = problem.initial;
  for (int i = 0; i < NU; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double half = 0.5 * (problem.bounds.continuous_upper[at] - problem.bounds.continuous_lower[at]);
    input_scale_[P + i] = half < HUGE_VAL && half > 0.0 ? half : 1.0;
  }
  for (std::size_t k = 0; k < t_.stages(); ++k) t_.from_plan(problem, plan, k, at_.w[k]);
  qp::OcpStage<X, U> probe;
  cost_scale_ = 1.0;
  add_output(problem.model, problem.cost.tracking, problem.reference[0], problem.initial, probe);
  const double longest = *std::max_element(t_.grid.intervals.begin(), t_.grid.intervals.end());
  double most = longest * probe.q_matrix.diagonal().maxCoeff();
  probe.q_matrix.setZero();
  add_output(problem.model, problem.cost.terminal, problem.reference[0], problem.initial, probe);
  most = std::max(most, probe.q_matrix.diagonal().maxCoeff());
  if (most > 0.0 && std::isfinite(most)) cost_scale_ = 1.0 / most;
}

template <HybridModel M, int P, int A>
qp::Info Sqp<M, P, A>::solve_qp(Deadline deadline) noexcept {
  const PhaseScope timed(phases_, Phase::factorisation);
  return qp_solver_.solve(qp_, step_, qp::Start::warm, deadline);
}

/// The quadratic model around the current point, and its merit; false where it is not finite.
template <HybridModel M, int P, int A>
bool Sqp<M, P, A>::linearise(const Problem<M>& problem, Nodes nodes) noexcept {
  const PhaseScope timed(phases_, Phase::derivatives);
  qp_.x0.setZero();
  cost_ = gaps_ = 0.0;
  for (std::size_t k = 0; k <= t_.stages(); ++k) {
    qp_.stages[k].q_matrix.setZero();
    qp_.stages[k].q.setZero();
  }
  for (std::size_t k = 0; k < t_.stages(); ++k) {
    with_best_lanes([&](auto lanes) { linearise_stage<lanes>(problem, k, nodes); });
    add_effort(problem, k);
    add_switching(problem, k);
    add_consumption(problem, k);
    set_bounds(problem, k);
  }
  add_output(problem.model, problem.cost.terminal, problem.reference.back(), at_.x.back(), qp_.stages.back());
  merit_ = cost_ + penalty_ * gaps_;
  guess_active_set();
  return std::isfinite(merit_);
}

/// Inputs on a bound are guessed to stay there: the QP starts from that set.
template <HybridModel M, int P, int A>
void Sqp<M, P, A>::guess_active_set() noexcept {
  constexpr double near = 1e-9;
  for (std::size_t k = 0; k < t_.stages(); ++k) {
    step_.u[k].setZero();
    step_.y[k].setZero();
    for (int i = 0; i < U; ++i)
      step_.zu[k][i] = qp_.stages[k].u_lower[i] > -near ? -1.0 : qp_.stages[k].u_upper[i] < near ? 1.0 : 0.0;
  }
  for (std::size_t k = 0; k <= t_.stages(); ++k) {
    step_.x[k].setZero();
    step_.zx[k].setZero();
  }
}

/// Dynamics and tracking of one interval. The output after its last step belongs to the next node.
template <HybridModel M, int P, int A>
template <int lanes>
void Sqp<M, P, A>::linearise_stage(const Problem<M>& problem, std::size_t k, Nodes nodes) noexcept {
  using StageDual = Dual<V, lanes>;
  using Gradient = Eigen::Matrix<double, StageDual::size, 1>;
  auto& stage = qp_.stages[k];
  Vector<StageDual, M::state_size> x;
  for (int i = 0; i < NX; ++i) {
    const auto at = static_cast<std::size_t>(i);
    x[at] = StageDual(at_.x[k][at], i, t_.scale[at]);
  }
  Vector<StageDual, static_cast<std::size_t>(A)> a;
  typename Trans::Memory before = Trans::Memory::Zero();
  if (k > 0) before = t_.remember(at_.w[k - 1]);
  for (int j = 0; j < A; ++j) a[static_cast<std::size_t>(j)] = StageDual(before[j], NX + j);
  std::array<StageDual, P> v;
  for (int p = 0; p < P; ++p) v[static_cast<std::size_t>(p)] = StageDual(at_.w[k][p], X + p);
  Vector<StageDual, M::continuous_size> u{};
  for (int i = 0; i < NU; ++i)
    u[static_cast<std::size_t>(i)] = StageDual(at_.w[k][P + i], X + P + i, input_scale_[P + i]);

  Eigen::Matrix<double, StageDual::size, V> hessian = Eigen::Matrix<double, StageDual::size, V>::Zero();
  Gradient gradient = Gradient::Zero(), row;
  const auto last = static_cast<std::size_t>(t_.first_step[k + 1] - 1);
  const auto track = [&](std::size_t j, const Vector<StageDual, M::state_size>& state) {
    if (j == last) return;
    const auto z = problem.model.template output<StageDual>(state);
    for (std::size_t i = 0; i < M::output_size; ++i) {
      const double weight = 2.0 * cost_scale_ * problem.cost.tracking[i];
      if (weight == 0.0) continue;
      const double error = z[i].value() - problem.reference[j][i];
      cost_ += 0.5 * weight * error * error;
      z[i].copy_derivatives(row.data());
      gradient += (weight * error) * row;
      for (int c = 0; c < V; ++c) hessian.col(c) += (weight * row[c]) * row;
    }
  };
  const auto running = [&](const StageDual& term) {
    cost_ += cost_scale_ * term.value();
    term.copy_derivatives(row.data());
    gradient += cost_scale_ * row;
  };
  const auto c = t_.template commanded<StageDual>(v);
  const auto previous = t_.template previous<StageDual>(problem, k, a);
  roll_interval<M, Dynamics::smoothed, StageDual>(problem, t_.timing, t_.first_step[k], t_.grid.intervals[k], previous,
                                                  c, u, x, track, running);
  stage.q_matrix += hessian.template topLeftCorner<X, X>();
  stage.s_matrix = hessian.template block<U, X>(X, 0);
  stage.r_matrix = hessian.template block<U, U>(X, X);
  stage.q += gradient.template head<X>();
  stage.r = gradient.template segment<U>(X);
  for (int i = 0; i < NX; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double per = 1.0 / t_.scale[at];
    x[at].copy_derivatives(row.data());
    stage.a.row(i) = per * row.template head<X>().transpose();
    stage.b.row(i) = per * row.template segment<U>(X).transpose();
    if (nodes == Nodes::simulate) at_.x[k + 1][at] = x[at].value();
    stage.c[i] = per * (x[at].value() - at_.x[k + 1][at]);
    gaps_ += std::abs(stage.c[i]);
  }
  for (int j = 0; j < A; ++j)
    for (int p = 0; p < P; ++p) stage.b(NX + j, p) = t_.memory(j, p);
  add_output(problem.model, problem.cost.tracking, problem.reference[last], at_.x[k + 1], qp_.stages[k + 1]);
}

template <HybridModel M, int P, int A>
void Sqp<M, P, A>::add_output(const M& model, const OutputOf<M>& weight, const OutputOf<M>& reference, const State& x,
                              qp::OcpStage<X, U>& stage) noexcept {
  if (std::all_of(weight.begin(), weight.end(), [](double w) { return w == 0.0; })) return;
  Vector<StateDual, M::state_size> dual;
  for (int i = 0; i < NX; ++i) {
    const auto at = static_cast<std::size_t>(i);
    dual[at] = StateDual(x[at], i, t_.scale[at]);
  }
  const auto z = model.template output<StateDual>(dual);
  for (std::size_t i = 0; i < M::output_size; ++i) {
    const double twice = 2.0 * cost_scale_ * weight[i];
    if (twice == 0.0) continue;
    Eigen::Matrix<double, StateDual::size, 1> all;
    z[i].copy_derivatives(all.data());
    const auto row = all.template head<NX>();
    cost_ += 0.5 * twice * (z[i].value() - reference[i]) * (z[i].value() - reference[i]);
    stage.q.template head<NX>() += twice * (z[i].value() - reference[i]) * row;
    stage.q_matrix.template topLeftCorner<NX, NX>() += twice * row * row.transpose();
  }
}

template <HybridModel M, int P, int A>
void Sqp<M, P, A>::add_effort(const Problem<M>& problem, std::size_t k) noexcept {
  for (int i = 0; i < NU; ++i) {
    const double scale = input_scale_[P + i];
    qp_.stages[k].r_matrix(P + i, P + i) +=
        2.0 * cost_scale_ * t_.grid.intervals[k] * scale * scale * problem.cost.continuous[static_cast<std::size_t>(i)];
  }
  qp_.stages[k].r_matrix.diagonal().array() += settings_.regularisation;
}

template <HybridModel M, int P, int A>
void Sqp<M, P, A>::add_switching(const Problem<M>& problem, std::size_t k) noexcept {
  if (problem.cost.switching == 0.0) return;
  auto& stage = qp_.stages[k];
  typename Trans::Memory a = Trans::Memory::Zero();
  if (k > 0) a = t_.remember(at_.w[k - 1]);
  const auto c = t_.template commanded<double>(at_.w[k]);
  const auto before = t_.template previous<double>(problem, k, std::span<const double>(a.data(), A));
  constexpr double e2 = switching_roundness * switching_roundness;
  const double weight = cost_scale_ * problem.cost.switching / (std::sqrt(1.0 + e2) - switching_roundness);
  for (Eigen::Index i = 0; i < t_.hull.offset.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double d = c[at] - before[at], root = std::sqrt(d * d + e2);
    const auto row = t_.change_gain(k, i);
    const auto ra = row.template head<A>();
    const auto rv = row.template tail<P>();
    cost_ += weight * (root - switching_roundness);
    const double slope = weight * d / root, curvature = weight * e2 / (root * root * root);
    stage.q.template tail<A>() += slope * ra;
    stage.r.template head<P>() += slope * rv;
    stage.q_matrix.template bottomRightCorner<A, A>() += curvature * ra * ra.transpose();
    stage.s_matrix.template topRightCorner<P, A>() += curvature * rv * ra.transpose();
    stage.r_matrix.template topLeftCorner<P, P>() += curvature * rv * rv.transpose();
  }
}

/// Curvature of the consumption in the switched inputs, at the interval's first state and with all delays over.
template <HybridModel M, int P, int A>
void Sqp<M, P, A>::add_consumption(const Problem<M>& problem, std::size_t k) noexcept {
  if constexpr (HasConsumption<M>) {
    if (problem.cost.consumption == 0.0) return;
    constexpr int n = static_cast<int>(M::switched_size);
    using First = Eigen::AutoDiffScalar<Eigen::Matrix<double, n, 1>>;
    using Second = Eigen::AutoDiffScalar<Eigen::Matrix<First, n, 1>>;
    const auto s = switched_inputs<M, double>(problem.modes, t_.template commanded<double>(at_.w[k]));
    Vector<Second, M::switched_size> dual;
    for (int i = 0; i < n; ++i) {
      auto& one = dual[static_cast<std::size_t>(i)];
      one.value() = First(s[static_cast<std::size_t>(i)], n, i);
      for (int j = 0; j < n; ++j) one.derivatives()[j] = First(i == j ? 1.0 : 0.0);
    }
    Vector<Second, M::state_size> x;
    for (std::size_t i = 0; i < M::state_size; ++i) x[i] = Second(First(at_.x[k][i]));
    const Second rate = problem.model.template consumption<Second>(x, dual);
    const double weight = cost_scale_ * problem.cost.consumption * problem.horizon.dt_s * t_.grid.intervals[k];
    for (int i = 0; i < n; ++i) {
      const auto row = rate.derivatives()[i].derivatives();
      const double dominant = 2.0 * row[i] - row.cwiseAbs().sum();  // h_ii - sum of the others, where h_ii > 0
      if (!(row[i] > 0.0 && dominant > 0.0)) continue;
      const auto gain = t_.switched_gain.row(i);
      qp_.stages[k].r_matrix.template topLeftCorner<P, P>() += weight * dominant * gain.transpose() * gain;
    }
  }
}

template <HybridModel M, int P, int A>
void Sqp<M, P, A>::set_bounds(const Problem<M>& problem, std::size_t k) noexcept {
  auto& stage = qp_.stages[k];
  for (int p = 0; p < P; ++p) {
    stage.u_lower[p] = -at_.w[k][p];
    stage.u_upper[p] = 1.0 - at_.w[k][p];
  }
  for (int i = P; i < U; ++i) {
    const auto at = static_cast<std::size_t>(i - P);
    const double per = 1.0 / input_scale_[i];
    stage.u_lower[i] = per * (problem.bounds.continuous_lower[at] - at_.w[k][i]);
    stage.u_upper[i] = per * (problem.bounds.continuous_upper[at] - at_.w[k][i]);
  }
  if (!qp_.state_bounds) return;
  auto& next = qp_.stages[k + 1];
  for (int i = 0; i < NX; ++i) {
    const auto at = static_cast<std::size_t>(i);
    next.x_lower[i] = (problem.bounds.state_lower[at] - at_.x[k + 1][at]) / t_.scale[at];
    next.x_upper[i] = (problem.bounds.state_upper[at] - at_.x[k + 1][at]) / t_.scale[at];
  }
  const auto a = t_.remember(at_.w[k]);
  for (int j = 0; j < t_.sums; ++j) next.x_upper[NX + j] = 1.0 - a[j];
}

template <HybridModel M, int P, int A>
void Sqp<M, P, A>::damp(double by) noexcept {
  if (by == 0.0) return;
  for (std::size_t k = 0; k < t_.stages(); ++k) qp_.stages[k].r_matrix.diagonal().array() += by;
}

/// cost + penalty |defects|_1, by the smooth physics, in units of the cost's scale.
template <HybridModel M, int P, int A>
[[SOLENOID_FLATTEN]] double Sqp<M, P, A>::merit(const Problem<M>& problem, const Point& at) noexcept {
  const PhaseScope timed(phases_, Phase::rollout);
  double cost = 0.0, gaps = 0.0;
  typename Trans::Memory a = Trans::Memory::Zero();
  for (std::size_t k = 0; k < t_.stages(); ++k) {
    const auto c = t_.template commanded<double>(at.w[k]);
    const auto previous = t_.template previous<double>(problem, k, std::span<const double>(a.data(), A));
    if (problem.cost.switching != 0.0) cost += t_.template switching_cost<double>(problem, previous, c);
    ContinuousOf<M> u{};
    for (int i = 0; i < NU; ++i) u[static_cast<std::size_t>(i)] = at.w[k][P + i];
    State x = at.x[k];
    const auto last = static_cast<std::size_t>(t_.first_step[k + 1] - 1);
    roll_interval<M, Dynamics::smoothed, double>(
        problem, t_.timing, t_.first_step[k], t_.grid.intervals[k], previous, c, u, x,
        [&](std::size_t j, const State& state) {
          const auto z = problem.model.template output<double>(j == last ? at.x[k + 1] : state);
          cost = rollout_detail::weighted_square<M, double>(problem.cost.tracking, problem.reference[j], z, cost);
        },
        [&](double term) { cost += term; });
    for (std::size_t i = 0; i < M::state_size; ++i) gaps += std::abs(x[i] - at.x[k + 1][i]) / t_.scale[i];
    a = t_.remember(at.w[k]);
  }
  cost = rollout_detail::weighted_square<M, double>(problem.cost.terminal, problem.reference.back(),
                                                    problem.model.template output<double>(at.x.back()), cost);
  return cost_scale_ * cost + penalty_ * gaps;
}

/// Above the multipliers the merit falls along the QP's step.
template <HybridModel M, int P, int A>
void Sqp<M, P, A>::raise_penalty() noexcept {
  double most = 0.0;
  for (const auto& y : step_.y) most = std::max(most, y.template lpNorm<Eigen::Infinity>());
  if (penalty_ >= 1.1 * most) return;
  penalty_ = 1.5 * most;
  merit_ = cost_ + penalty_ * gaps_;
}

/// Directional derivative of the merit along the QP's step.
template <HybridModel M, int P, int A>
double Sqp<M, P, A>::slope() const noexcept {
  double sum = 0.0;
  for (std::size_t k = 0; k < t_.stages(); ++k)
    sum += qp_.stages[k].q.dot(step_.x[k]) + qp_.stages[k].r.dot(step_.u[k]) -
           penalty_ * qp_.stages[k].c.template lpNorm<1>();
  return sum + qp_.stages.back().q.dot(step_.x.back());
}

template <HybridModel M, int P, int A>
double Sqp<M, P, A>::largest_defect() const noexcept {
  double most = 0.0;
  for (std::size_t k = 0; k < t_.stages(); ++k)
    most = std::max(most, qp_.stages[k].c.template lpNorm<Eigen::Infinity>());
  return most;
}

/// Backtracking on the merit; leaves the accepted point as the current one.
template <HybridModel M, int P, int A>
bool Sqp<M, P, A>::line_search(const Problem<M>& problem, double promised) noexcept {
  for (double length = 1.0; length > 0.01; length *= 0.5) {
    move(length);
    const double after = merit(problem, trial_);
    if (after <= merit_ + 1e-4 * length * promised) {
      std::swap(at_.x, trial_.x);
      std::swap(at_.w, trial_.w);
      return true;
    }
  }
  return false;
}

/// The trial point: the current one plus `length` times the QP's step.
template <HybridModel M, int P, int A>
void Sqp<M, P, A>::move(double length) noexcept {
  for (std::size_t k = 0; k <= t_.stages(); ++k)
    for (std::size_t i = 0; i < M::state_size; ++i)
      trial_.x[k][i] = at_.x[k][i] + length * t_.scale[i] * step_.x[k][static_cast<int>(i)];
  for (std::size_t k = 0; k < t_.stages(); ++k)
    for (int i = 0; i < U; ++i) trial_.w[k][i] = at_.w[k][i] + length * input_scale_[i] * step_.u[k][i];
}

/// relaxed_cost() with everything inlined, as the rollouts of the searches are.
template <HybridModel M, int P, int A>
[[SOLENOID_FLATTEN]] double Sqp<M, P, A>::exact_cost(const Problem<M>& problem, RelaxedPlan<M>& plan) const noexcept {
  const PhaseScope timed(phases_, Phase::rollout);
  return relaxed_cost<M, double>(problem, t_.timing, t_.grid, std::span<const double>(plan.weights), plan.continuous,
                                 plan.outputs);
}

/// Keeps the current inputs in `best` if by the exact physics they are.
template <HybridModel M, int P, int A>
void Sqp<M, P, A>::judge(const Problem<M>& problem, RelaxedPlan<M>& best) noexcept {
  for (std::size_t k = 0; k < t_.stages(); ++k) t_.to_plan(at_.w[k], k, candidate_);
  const double cost = exact_cost(problem, candidate_);
  if (!(cost < best_cost_)) return;
  best_cost_ = cost;
  std::copy(candidate_.weights.begin(), candidate_.weights.end(), best.weights.begin());
  std::copy(candidate_.continuous.begin(), candidate_.continuous.end(), best.continuous.begin());
  if (!best.outputs.empty()) std::copy(candidate_.outputs.begin(), candidate_.outputs.end(), best.outputs.begin());
}

}  // namespace solenoid
