// Bodies of relaxed_ipopt.hpp.
namespace solenoid {

template <HybridModel M, int P, int A>
void RelaxedIpopt<M, P, A>::prepare(const Problem<M>& problem, const RelaxedGrid& grid) {
  t_.prepare(problem, grid);
  candidate_ = RelaxedPlan<M>(problem, grid);
  const std::size_t variables = t_.stages() * static_cast<std::size_t>(U + NX);
  z_.assign(variables, 0.0);
  lower.assign(variables, 0.0), upper.assign(variables, 0.0);
  const auto rows = t_.stages() * static_cast<std::size_t>(NX + t_.sums);
  g_lower.assign(rows, 0.0), g_upper.assign(rows, 0.0);
  set_patterns();
}

template <HybridModel M, int P, int A>
SolveReport RelaxedIpopt<M, P, A>::solve(const Problem<M>& problem, RelaxedPlan<M>& plan, Deadline deadline) noexcept {
  const auto start = Deadline::Clock::now();
  SolveReport report;
  problem_ = &problem;
  const double before = relaxed_cost(problem, t_.grid, plan);
  cost_scale_ = 1.0;
  if (before > 0.0 && std::isfinite(before)) cost_scale_ = 1.0 / before;
  set_bounds();
  double best = before;
  for (int start_no = 0; start_no < starts_ && std::isfinite(before); ++start_no) {
    candidate_ = plan;
    if (start_no > 0) hold(start_no - 1);
    load(candidate_);
    const nlp::IpoptResult result = nlp::solve_with_ipopt(*this, z_, settings_, deadline);
    report.nodes += result.iterations;
    for (std::size_t k = 0; k < t_.stages(); ++k)
      t_.to_plan(Eigen::Map<const typename Trans::Input>(z_.data() + k * U), k, candidate_);
    const double cost = relaxed_cost(problem, t_.grid, candidate_);
    if (start_no == 0 || cost < best) report.status = result.status;
    if (cost < best) best = cost, plan = candidate_;
    if (result.status == Status::deadline_reached) break;
  }
  report.cost = relaxed_cost(problem, t_.grid, plan);
  report.time_us = us_since(start);
  return report;
}

template <HybridModel M, int P, int A>
template <class S>
std::pair<S, Vector<S, M::state_size>> RelaxedIpopt<M, P, A>::stage(std::size_t k, const Zeta<S>& zeta) const {
  const Problem<M>& problem = *problem_;
  Vector<S, M::state_size> x;
  for (std::size_t i = 0; i < M::state_size; ++i) x[i] = S(t_.scale[i]) * zeta[i];
  std::array<S, static_cast<std::size_t>(A)> a;
  for (int j = 0; j < A; ++j) {
    S sum(0.0);
    for (int p = 0; p < P; ++p)
      if (t_.memory(j, p) != 0.0) sum = sum + S(t_.memory(j, p)) * zeta[static_cast<std::size_t>(NX + p)];
    a[static_cast<std::size_t>(j)] = sum;
  }
  const auto v = std::span<const S>(zeta).template subspan<static_cast<std::size_t>(NX + P), P>();
  Vector<S, M::continuous_size> u{};
  for (std::size_t i = 0; i < M::continuous_size; ++i) u[i] = zeta[static_cast<std::size_t>(NX + P + P) + i];
  const auto c = t_.template commanded<S>(v);
  const auto previous = t_.template previous<S>(problem, k, a);
  S cost(0.0);
  if (problem.cost.switching != 0.0) cost = t_.template switching_cost<S>(problem, previous, c);
  roll_interval<M, Dynamics::smoothed, S>(
      problem, t_.timing, t_.first_step[k], t_.grid.intervals[k], previous, c, u, x,
      [&](std::size_t j, const Vector<S, M::state_size>& state) {
        const auto z = problem.model.template output<S>(state);
        cost = rollout_detail::weighted_square<M, S>(problem.cost.tracking, problem.reference[j], z, cost);
        if (j + 1 == problem.reference.size())
          cost = rollout_detail::weighted_square<M, S>(problem.cost.terminal, problem.reference[j], z, cost);
      },
      [&](const S& term) { cost = cost + term; });
  for (std::size_t i = 0; i < M::state_size; ++i) x[i] = S(1.0 / t_.scale[i]) * x[i];
  return {S(S(cost_scale_) * cost), x};
}

template <HybridModel M, int P, int A>
double RelaxedIpopt<M, P, A>::objective(std::span<const double> z) {
  double sum = 0.0;
  for (int k = 0; k < static_cast<int>(t_.stages()); ++k)
    sum += stage<double>(static_cast<std::size_t>(k), seeded<double>(z, k, [](double v, int) { return v; })).first;
  return sum;
}

template <HybridModel M, int P, int A>
void RelaxedIpopt<M, P, A>::gradient(std::span<const double> z, std::span<double> out) {
  std::fill(out.begin(), out.end(), 0.0);
  for (int k = 0; k < static_cast<int>(t_.stages()); ++k) {
    const First cost = stage<First>(static_cast<std::size_t>(k), dual(z, k)).first;
    for (int i = 0; i < Z; ++i)
      if (const int at = place(k, i); at >= 0) out[static_cast<std::size_t>(at)] += cost.derivatives()[i];
  }
}

/// Rows: the gaps of all stages, stage by stage, then the sums of their weights.
template <HybridModel M, int P, int A>
void RelaxedIpopt<M, P, A>::constraints(std::span<const double> z, std::span<double> out) {
  std::size_t row = 0;
  const int stages = static_cast<int>(t_.stages());
  for (int k = 0; k < stages; ++k) {
    const auto next =
        stage<double>(static_cast<std::size_t>(k), seeded<double>(z, k, [](double v, int) { return v; })).second;
    for (int i = 0; i < NX; ++i) out[row++] = next[static_cast<std::size_t>(i)] - entry(z, k + 1, i);
  }
  for (int k = 0; k < stages; ++k)
    for (int j = 0; j < t_.sums; ++j, ++row) {
      out[row] = 0.0;
      for (int p = 0; p < P; ++p) out[row] += t_.memory(j, p) * z[static_cast<std::size_t>(k * U + p)];
    }
}

template <HybridModel M, int P, int A>
void RelaxedIpopt<M, P, A>::jacobian_values(std::span<const double> z, std::span<double> out) {
  std::size_t at = 0;
  const int stages = static_cast<int>(t_.stages());
  for (int k = 0; k < stages; ++k) {
    const auto next = stage<First>(static_cast<std::size_t>(k), dual(z, k)).second;
    for (int i = 0; i < NX; ++i) {
      for (int c = 0; c < Z; ++c)
        if (place(k, c) >= 0) out[at++] = next[static_cast<std::size_t>(i)].derivatives()[c];
      out[at++] = -1.0;
    }
  }
  for (int k = 0; k < stages; ++k)
    for (int j = 0; j < t_.sums; ++j)
      for (int p = 0; p < P; ++p) out[at++] = t_.memory(j, p);
}

template <HybridModel M, int P, int A>
void RelaxedIpopt<M, P, A>::hessian_values(std::span<const double> z, double factor, std::span<const double> lambda,
                                           std::span<double> out) {
  std::size_t at = 0;
  for (int k = 0; k < static_cast<int>(t_.stages()); ++k) {
    const auto zeta = seeded<Second>(z, k, [](double value, int i) {
      Second one(First(value, Z, i));
      for (int j = 0; j < Z; ++j) one.derivatives()[j] = First(i == j ? 1.0 : 0.0);
      return one;
    });
    const auto [cost, next] = stage<Second>(static_cast<std::size_t>(k), zeta);
    Second lagrangian = Second(First(factor)) * cost;
    for (int i = 0; i < NX; ++i)
      lagrangian =
          lagrangian + Second(First(lambda[static_cast<std::size_t>(k * NX + i)])) * next[static_cast<std::size_t>(i)];
    for (int r = 0; r < Z; ++r)
      for (int c = 0; c <= r; ++c)
        if (place(k, r) >= 0 && place(k, c) >= 0) out[at++] = lagrangian.derivatives()[r].derivatives()[c];
  }
}

template <HybridModel M, int P, int A>
void RelaxedIpopt<M, P, A>::set_patterns() {
  jacobian.clear(), hessian.clear();
  const int stages = static_cast<int>(t_.stages());
  for (int k = 0; k < stages; ++k)
    for (int i = 0; i < NX; ++i) {
      for (int c = 0; c < Z; ++c)
        if (place(k, c) >= 0) jacobian.push_back({k * NX + i, place(k, c)});
      jacobian.push_back({k * NX + i, place(k + 1, i)});
    }
  for (int k = 0; k < stages; ++k)
    for (int j = 0; j < t_.sums; ++j)
      for (int p = 0; p < P; ++p) jacobian.push_back({stages * NX + k * t_.sums + j, k * U + p});
  for (int k = 0; k < stages; ++k)
    for (int r = 0; r < Z; ++r)
      for (int c = 0; c <= r; ++c)
        if (const int row = place(k, r), column = place(k, c); row >= 0 && column >= 0)
          hessian.push_back({std::max(row, column), std::min(row, column)});
}

template <HybridModel M, int P, int A>
void RelaxedIpopt<M, P, A>::set_bounds() {
  const int stages = static_cast<int>(t_.stages());
  const auto& bounds = problem_->bounds;
  for (int k = 0; k < stages; ++k) {
    for (int p = 0; p < P; ++p) {
      lower[static_cast<std::size_t>(k * U + p)] = 0.0;
      upper[static_cast<std::size_t>(k * U + p)] = 1.0;
    }
    for (int i = 0; i < NU; ++i) {
      lower[static_cast<std::size_t>(k * U + P + i)] = bounds.continuous_lower[static_cast<std::size_t>(i)];
      upper[static_cast<std::size_t>(k * U + P + i)] = bounds.continuous_upper[static_cast<std::size_t>(i)];
    }
    for (int i = 0; i < NX; ++i) {
      const auto s = static_cast<std::size_t>(i), at = static_cast<std::size_t>(place(k + 1, i));
      lower[at] = bounds.state_lower[s] / t_.scale[s];
      upper[at] = bounds.state_upper[s] / t_.scale[s];
    }
  }
  for (int r = 0; r < stages * t_.sums; ++r) {
    g_lower[static_cast<std::size_t>(stages * NX + r)] = -HUGE_VAL;
    g_upper[static_cast<std::size_t>(stages * NX + r)] = 1.0;
  }
}

/// One mode throughout, no continuous input.
template <HybridModel M, int P, int A>
void RelaxedIpopt<M, P, A>::hold(int mode) {
  std::fill(candidate_.weights.begin(), candidate_.weights.end(), 0.0);
  for (std::size_t k = 0; k < t_.stages(); ++k) {
    candidate_.row(k)[static_cast<std::size_t>(mode) % candidate_.modes] = 1.0;
    candidate_.continuous[k].fill(0.0);
  }
}

/// A plan's inputs, and the states they lead to.
template <HybridModel M, int P, int A>
void RelaxedIpopt<M, P, A>::load(const RelaxedPlan<M>& plan) {
  typename Trans::Input w;
  for (std::size_t k = 0; k < t_.stages(); ++k) {
    t_.from_plan(*problem_, plan, k, w);
    std::copy_n(w.data(), U, z_.begin() + static_cast<std::ptrdiff_t>(k * U));
  }
  for (int k = 0; k < static_cast<int>(t_.stages()); ++k) {
    const std::span<const double> z(z_);
    const auto next =
        stage<double>(static_cast<std::size_t>(k), seeded<double>(z, k, [](double v, int) { return v; })).second;
    for (int i = 0; i < NX; ++i) z_[static_cast<std::size_t>(place(k + 1, i))] = next[static_cast<std::size_t>(i)];
  }
}

}  // namespace solenoid
