// Bodies of riccati_kkt.hpp.
namespace solenoid::qp {

template <int NX, int NU>
void RiccatiKkt<NX, NU>::setup(const Problem& problem, const Settings& settings) {
  memory_.clear();
  stages_ = problem.horizon();
  state_bounds_ = problem.state_bounds;
  first_shift_ = settings.primal_shift;
  states_at_ = Workspace::padded(stages_ * NU);
  kernel_ = &riccati_kernels<NX, NU>(settings.isa);
  row_kernel_ = &row_kernels(settings.isa);
  const int n = stages_;
  pack_ = {n,
           memory_.carve(n * NX * W),
           memory_.carve(n * H * XL),
           memory_.carve(n * XL),
           memory_.carve((n + 1) * H * W),
           memory_.carve((n + 1) * W),
           memory_.carve(XL)};
  riccati_ = {memory_.carve((n + 1) * NX * XL),
              memory_.carve(n * NU * XL),
              memory_.carve(n * NX * UL),
              memory_.carve(n * NU * UL),
              memory_.carve(n * NX * XL),
              memory_.carve(n * NX * XL),
              memory_.carve(n * UL),
              memory_.carve((n + 1) * XL),
              memory_.carve((n + 1) * XL)};
  zero_ = memory_.carve((n + 1) * H * W + primal_size());
  homogeneous_ = pack_;
  homogeneous_.offset = homogeneous_.gradient = homogeneous_.x0 = zero_;
  adjoint_ = pack_;
  adjoint_.hessian = adjoint_.gradient = zero_;
  for (double** array : {&g_, &zeta_, &r_d_, &dw_}) *array = memory_.carve(primal_size());
  for (double** array : {&r_p_, &dy_}) *array = memory_.carve(dual_size());
}

/// Of the inputs' own cost, at most 1: what the shift adds must stay small beside it. 1 where one costs nothing, and only
/// the shift may bend it.
template <int NX, int NU>
double RiccatiKkt<NX, NU>::least_curvature(const Problem& problem) const noexcept {
  double least = 1.0;
  for (int k = 0; k < stages_; ++k)
    for (int j = 0; j < NU; ++j) {
      const double own = problem.stages[static_cast<std::size_t>(k)].r_matrix(j, j);
      if (!(own > 0.0)) return 1.0;
      least = std::min(least, own);
    }
  return least;
}

template <int NX, int NU>
bool RiccatiKkt<NX, NU>::load(const Problem& problem) noexcept {
  if (problem.horizon() != stages_ || problem.state_bounds != state_bounds_) return false;
  problem_ = &problem;
  shift_ = first_shift_ * least_curvature(problem);
  const auto& first = problem.stages[0];
  constant_ = problem.x0.dot(0.5 * first.q_matrix * problem.x0 + first.q);
  for (int i = 0; i < NX; ++i) pack_.x0[i] = problem.x0[i];
  for (int k = 0; k <= stages_; ++k) load_stage(problem, k);
  const auto all_finite = [&](int size, const double* x) { return row_kernel_->finite(Workspace::padded(size), x); };
  return problem.x0.allFinite() && all_finite(stages_ * NX * W, pack_.rows) && all_finite(stages_ * XL, pack_.offset) &&
         all_finite((stages_ + 1) * H * W, pack_.hessian) && all_finite((stages_ + 1) * W, pack_.gradient);
}

template <int NX, int NU>
void RiccatiKkt<NX, NU>::load_stage(const Problem& problem, int k) noexcept {
  // Columns of the matrices, as Eigen keeps them, are rows of a symmetric one: whole pieces are copied where they fit.
  const auto& stage = problem.stages[static_cast<std::size_t>(k)];
  double* hessian = pack_.hessian + k * H * W;
  double* gradient = pack_.gradient + k * W;
  piece<NX>(gradient) = stage.q;
  for (int i = 0; i < NX; ++i) piece<NX>(hessian + i * W) = stage.q_matrix.col(i);
  if (k == stages_) return;
  piece<NU>(gradient + NX) = stage.r;
  for (int i = 0; i < NX; ++i) {
    piece<NU>(hessian + i * W + NX) = stage.s_matrix.col(i);
    for (int j = 0; j < NU; ++j) hessian[(NX + j) * W + i] = stage.s_matrix(j, i);
  }
  for (int j = 0; j < NU; ++j) piece<NU>(hessian + (NX + j) * W + NX) = stage.r_matrix.col(j);
  double* rows = pack_.rows + k * NX * W;
  double* columns = pack_.columns + k * H * XL;
  for (int c = 0; c < NX; ++c) piece<NX>(columns + c * XL) = stage.a.col(c);
  for (int j = 0; j < NU; ++j) piece<NX>(columns + (NX + j) * XL) = stage.b.col(j);
  for (int i = 0; i < NX; ++i) {
    for (int c = 0; c < NX; ++c) rows[i * W + c] = stage.a(i, c);
    for (int j = 0; j < NU; ++j) rows[i * W + NX + j] = stage.b(i, j);
  }
  piece<NX>(pack_.offset + k * XL) = stage.c;
}

template <int NX, int NU>
bool RiccatiKkt<NX, NU>::bounds(Rows& rows) const noexcept {
  bool consistent = true;
  const auto row = [&](int at, double lower, double upper) {
    const bool has_lower = lower > -HUGE_VAL, has_upper = upper < HUGE_VAL, fixed = lower == upper;
    consistent = consistent && lower <= upper;
    rows.mask_l[at] = has_lower && !fixed ? 1.0 : 0.0;
    rows.mask_u[at] = has_upper && !fixed ? 1.0 : 0.0;
    rows.lower[at] = has_lower ? lower : 0.0;
    rows.upper[at] = has_upper ? upper : 0.0;
    // A fixed input is eliminated; a fixed state is held by its multiplier, step after step.
    rows.fixed[at] = !fixed ? 0.0 : at < states_at_ ? 1e20 : 1e6;
  };
  for (int k = 0; k < stages_; ++k) {
    const auto& stage = problem_->stages[static_cast<std::size_t>(k)];
    for (int j = 0; j < NU; ++j) row(k * NU + j, stage.u_lower[j], stage.u_upper[j]);
    const auto& next = problem_->stages[static_cast<std::size_t>(k) + 1];
    for (int i = 0; state_bounds_ && i < NX; ++i) row(states_at_ + k * XL + i, next.x_lower[i], next.x_upper[i]);
  }
  return consistent;
}

/// Inputs at 0 moved well inside their bounds, states by simulation, multipliers by the adjoint recursion: only the
/// inputs' stationarity is left to do.
template <int NX, int NU>
void RiccatiKkt<NX, NU>::start(double* w, double* y) noexcept {
  for (int k = 0; k < stages_; ++k) {
    const auto& stage = problem_->stages[static_cast<std::size_t>(k)];
    for (int j = 0; j < NU; ++j) {
      const double lower = stage.u_lower[j], upper = stage.u_upper[j], width = upper - lower;
      const double margin = std::isfinite(width) ? std::min(1.0, 0.25 * width) : 1.0;
      w[k * NU + j] = lower == upper ? lower : std::max(std::min(0.0, upper - margin), lower + margin);
    }
  }
  kernel_->simulate(pack_, states_at_, w);
  kernel_->costates(pack_, w, states_at_, y);
}

template <int NX, int NU>
void RiccatiKkt<NX, NU>::take(const double* r_d, const double* r_p, const double* h) noexcept {
  const int rows = row_size();
  row_kernel_->add(rows, r_d, h, g_);
  std::copy_n(r_d + rows, primal_size() - rows, g_ + rows);
  e_ = r_p, h_ = h;
}

template <int NX, int NU>
bool RiccatiKkt<NX, NU>::factor(const double* weight, const double* r_d, const double* r_p, const double* h) noexcept {
  weight_ = weight;
  take(r_d, r_p, h);
  return kernel_->factor(pack_, riccati_, weight_, g_, e_, states_at_, state_bounds_, shift_);
}

template <int NX, int NU>
void RiccatiKkt<NX, NU>::solve(const double* r_d, const double* r_p, const double* h, double* dw, double* dy,
                               double* nu, int refinements) noexcept {
  take(r_d, r_p, h);
  kernel_->backward(pack_, riccati_, g_, e_, states_at_);
  step(dw, dy, nu, refinements);
}

template <int NX, int NU>
void RiccatiKkt<NX, NU>::step(double* dw, double* dy, double* nu, int refinements) noexcept {
  const int rows = row_size();
  kernel_->forward(pack_, riccati_, e_, states_at_, dw, dy);
  if (dy != nullptr) adjoint(g_, dw, dy);
  for (int i = 0; i < refinements; ++i) {
    for (int r = 0; r < rows; ++r) zeta_[r] = weight_[r] * dw[r];
    kernel_->residual(homogeneous_, dw, states_at_, dy, zeta_, state_bounds_, r_d_, r_p_);
    for (int r = 0; r < primal_size(); ++r) r_d_[r] += g_[r] + shift_ * dw[r];
    for (int r = 0; r < dual_size(); ++r) r_p_[r] += e_[r];
    kernel_->backward(pack_, riccati_, r_d_, r_p_, states_at_);
    kernel_->forward(pack_, riccati_, r_p_, states_at_, dw_, dy_);
    adjoint(r_d_, dw_, dy_);
    row_kernel_->axpy(primal_size(), 1.0, dw_, dw);
    row_kernel_->axpy(dual_size(), 1.0, dy_, dy);
  }
  if (nu != nullptr) row_kernel_->multiply_add(rows, weight_, dw, h_, nu);
}

/// Weights of active states make P so large that P dx + p has lost the multipliers' digits; the states' stationarity,
/// taken backwards, gives them with none lost.
template <int NX, int NU>
void RiccatiKkt<NX, NU>::adjoint(const double* g, const double* dw, double* dy) const noexcept {
  if (!state_bounds_) return;
  for (int k = stages_; k > 0; --k)
    for (int i = 0; i < NX; ++i) {
      const int at = states_at_ + (k - 1) * XL + i;
      const double* hessian = pack_.hessian + (k * H + i) * W;
      double sum = g[at] + (weight_[at] + shift_) * dw[at];
      for (int c = 0; c < NX; ++c) sum += hessian[c] * dw[at - i + c];
      for (int j = 0; k < stages_ && j < NU; ++j) sum += hessian[NX + j] * dw[k * NU + j];
      for (int c = 0; k < stages_ && c < NX; ++c) sum += pack_.rows[(k * NX + c) * W + i] * dy[k * XL + c];
      dy[(k - 1) * XL + i] = sum;
    }
}

template <int NX, int NU>
Ray RiccatiKkt<NX, NU>::primal_ray(const double* y, const double* zeta, const Rows& rows) noexcept {
  double largest = 0.0, support = 0.0, cone = 0.0;
  for (int i = 0; i < stages_ * XL; ++i) largest = std::max(largest, std::abs(y[i]));
  for (int i = 0; i < row_size(); ++i) {
    const bool fixed = rows.fixed[i] > 0.0, upward = zeta[i] > 0.0;
    largest = std::max(largest, std::abs(zeta[i]));
    if (fixed || (upward ? rows.mask_u[i] : rows.mask_l[i]) > 0.0)
      support += zeta[i] * (upward ? rows.upper[i] : rows.lower[i]);
    else
      cone = std::max(cone, std::abs(zeta[i]));
  }
  const StageResidual at = kernel_->residual(adjoint_, zero_, states_at_, y, zeta, state_bounds_, r_d_, r_p_);
  for (int i = 0; i < stages_ * XL; ++i) support -= y[i] * r_p_[i];
  if (!(largest > 0.0)) return {1.0, 0.0};
  return {std::max(at.dual, cone) / largest, support / largest};
}

template <int NX, int NU>
Ray RiccatiKkt<NX, NU>::dual_ray(const double* w, const Rows& rows) noexcept {
  double largest = 0.0, slope = 0.0, cone = 0.0;
  for (int i = 0; i < primal_size(); ++i) largest = std::max(largest, std::abs(w[i]));
  for (int i = 0; i < row_size(); ++i) {
    if (rows.fixed[i] > 0.0) cone = std::max(cone, std::abs(w[i]));
    if (rows.mask_l[i] > 0.0) cone = std::max(cone, -w[i]);
    if (rows.mask_u[i] > 0.0) cone = std::max(cone, w[i]);
  }
  for (int k = 0; k <= stages_; ++k) {
    const double* gradient = pack_.gradient + k * W;
    for (int j = 0; k < stages_ && j < NU; ++j) slope += gradient[NX + j] * w[k * NU + j];
    for (int i = 0; k > 0 && i < NX; ++i) slope += gradient[i] * w[states_at_ + (k - 1) * XL + i];
  }
  // The constant x_0 adds S_0 x_0 to the slope of u_0.
  const auto& first = problem_->stages[0];
  for (int j = 0; j < NU; ++j) slope += w[j] * first.s_matrix.row(j).dot(problem_->x0);
  const StageResidual at = kernel_->residual(homogeneous_, w, states_at_, zero_, zero_, false, r_d_, r_p_);
  if (!(largest > 0.0)) return {1.0, 0.0};
  return {std::max({at.dual, at.primal, cone}) / largest, slope / largest};
}

template <int NX, int NU>
void RiccatiKkt<NX, NU>::unpack(const double* w, const double* y, const double* zeta,
                                Solution& solution) const noexcept {
  solution.x[0] = problem_->x0;
  for (int k = 0; k < stages_; ++k) {
    const auto at = static_cast<std::size_t>(k);
    for (int j = 0; j < NU; ++j) {
      solution.u[at][j] = w[k * NU + j];
      solution.zu[at][j] = zeta[k * NU + j];
    }
    for (int i = 0; i < NX; ++i) {
      solution.x[at + 1][i] = w[states_at_ + k * XL + i];
      solution.y[at][i] = y[k * XL + i];
      if (state_bounds_) solution.zx[at + 1][i] = zeta[states_at_ + k * XL + i];
    }
  }
}

template <int NX, int NU>
void RiccatiKkt<NX, NU>::repack(const Solution& solution, double* w, double* y, double* zeta) const noexcept {
  for (int k = 0; k < stages_; ++k) {
    const auto at = static_cast<std::size_t>(k);
    for (int j = 0; j < NU; ++j) {
      w[k * NU + j] = solution.u[at][j];
      zeta[k * NU + j] = solution.zu[at][j];
    }
    for (int i = 0; i < NX; ++i) {
      w[states_at_ + k * XL + i] = solution.x[at + 1][i];
      y[k * XL + i] = solution.y[at][i];
      if (state_bounds_) zeta[states_at_ + k * XL + i] = solution.zx[at + 1][i];
    }
  }
}

}  // namespace solenoid::qp
