// Bodies of interior_point.hpp.
namespace solenoid::qp {

template <class Kkt>
void InteriorPoint<Kkt>::setup(const Kkt& kkt, const Settings& settings) {
  settings_ = settings;
  kernel_ = &row_kernels(settings.isa);
  memory_.clear();
  primal_ = kkt.primal_size();
  dual_ = kkt.dual_size();
  rows.size = kkt.row_size();
  for (double** array : {&w, &r_d_, &dw_, &as_w_, &as_rd_}) *array = memory_.carve(primal_);
  for (double** array : {&y, &r_p_, &dy_, &as_y_, &as_rp_}) *array = memory_.carve(dual_);
  Rows& a = rows;
  for (double** array : {&a.lower, &a.upper, &a.mask_l, &a.mask_u,   &a.fixed,    &a.z_l,     &a.z_u,     &a.v,
                         &a.r_l,   &a.r_u,   &a.inv_l,  &a.inv_u,    &a.inv_z_l,  &a.inv_z_u, &a.dt_l,    &a.dt_u,
                         &a.dz_l,  &a.dz_u,  &a.dv,     &a.second_l, &a.second_u, &a.weight,  &a.shift,   &a.nu,
                         &a.z_f,   &a.zeta,  &as_v_,    &as_zeta_,   &as_weight_, &as_shift_, &as_target_})
    *array = memory_.carve(rows.size);
  for (double** array : {&a.t_l, &a.t_u}) *array = memory_.carve(rows.size, 1.0);
  for (auto* set : {&side_, &guess_, &tried_}) set->assign(static_cast<std::size_t>(rows.size), 0);
}

template <class Kkt>
Info InteriorPoint<Kkt>::solve(Kkt& kkt, bool warm, Deadline deadline) noexcept {
  info_ = Info{};
  if (!kkt.bounds(rows)) {
    info_.status = Status::primal_infeasible;
    std::fill_n(y, dual_, 0.0);
    std::fill_n(rows.zeta, rows.size, 0.0);
    return info_;
  }
  compact_ = kkt.compact(rows);
  if (start(kkt, warm, deadline) == Verdict::stop) return info_;
  while (true) {
    evaluate(kkt);
    if (judge(kkt, deadline) == Verdict::stop) return info_;
    kkt.adapt(at_.dual);
    if (!factor(kkt, rows.weight, rows.shift)) return info_;
    const double target = predict(kkt);
    const bool finish = settled();
    correct(kkt, target);
    if (finish && finish_on_active_set(kkt, deadline)) return info_;
  }
}

/// An active set to try first: the last solution's (warm) or none at all (cold), which is often right or nearly so;
/// failing that, a point inside.
template <class Kkt>
auto InteriorPoint<Kkt>::start(Kkt& kkt, bool warm, Deadline deadline) noexcept -> Verdict {
  std::fill_n(rows.z_f, rows.size, 0.0);
  at_ = {HUGE_VAL, HUGE_VAL, 0.0};
  length_ = 0.0, refinements_ = 0;
  follow_ = stale_ = false;
  bounded_ = 0;
  if (warm) kkt.row_values(w, rows.v);
  for (int i = 0; i < rows.size; ++i) {
    bounded_ += rows.mask_l[i] + rows.mask_u[i] > 0.0;
    const bool lower = warm && rows.mask_l[i] > 0.0 && -rows.zeta[i] > rows.v[i] - rows.lower[i];
    const bool upper = warm && rows.mask_u[i] > 0.0 && rows.zeta[i] > rows.upper[i] - rows.v[i];
    guess_[static_cast<std::size_t>(i)] = side_[static_cast<std::size_t>(i)] = static_cast<signed char>(upper - lower);
  }
  if (!warm) kkt.start(w, y);
  tried_ = guess_;
  tried_wrong_ = 0;
  correctable_ = few();
  if (finish_on_active_set(kkt, deadline)) return Verdict::stop;
  // Around a wrong set the old solution is a poor centre; a warm interior start is for solving without sets.
  const bool keep = warm && settings_.active_set_steps == 0;
  if (warm && !keep) kkt.start(w, y);
  start_inside(kkt, keep);
  return Verdict::go_on;
}

template <class Kkt>
void InteriorPoint<Kkt>::start_inside(Kkt& kkt, bool warm) noexcept {
  if (!warm) std::fill_n(rows.zeta, rows.size, 0.0);
  if (!warm && !Kkt::balanced_start) balance(kkt);
  kkt.row_values(w, rows.v);
  const Residual at = kkt.residual(w, y, rows.zeta, r_d_, r_p_);
  // The multipliers' size is that of the gradient they have to balance.
  enter_interior(std::max(1e-4, 0.005 * at.dual));
}

/// Moves w little where it is bounded, freely elsewhere, onto the equalities, and finds multipliers to match: what
/// simulation and adjoint do where there are stages.
template <class Kkt>
void InteriorPoint<Kkt>::balance(Kkt& kkt) noexcept {
  for (int i = 0; i < rows.size; ++i) {
    // A little weight everywhere: what only the rows of G bound must not run away.
    as_weight_[i] = i >= primal_ ? 0.0 : rows.mask_l[i] + rows.mask_u[i] > 0.0 ? 1e3 : std::max(1e-3, rows.fixed[i]);
    as_shift_[i] = 0.0;
  }
  kkt.residual(w, y, rows.zeta, r_d_, r_p_);
  if (!factor(kkt, as_weight_, as_shift_)) return;
  kkt.step(dw_, dy_, nullptr, 0);
  kernel_->axpy(primal_, 1.0, dw_, w);
  kernel_->axpy(dual_, 1.0, dy_, y);
}

/// Slacks and multipliers well inside their cones, with products near `product`; fixed rows carry neither.
template <class Kkt>
void InteriorPoint<Kkt>::enter_interior(double product) noexcept {
  sides_ = 0;
  const auto enter = [&](double mask, double slack, double width, double multiplier, double& t, double& z) {
    if (mask == 0.0) {
      t = 1.0, z = 0.0;
      return;
    }
    ++sides_;
    t = std::max(slack, std::min(1.0, 0.1 * width));
    z = std::max(multiplier, product / t);
  };
  for (int i = 0; i < rows.size; ++i) {
    const double width = rows.mask_l[i] * rows.mask_u[i] > 0.0 ? rows.upper[i] - rows.lower[i] : 1e3,
                 zeta = rows.zeta[i];
    enter(rows.mask_l[i], rows.v[i] - rows.lower[i], width, -zeta, rows.t_l[i], rows.z_l[i]);
    enter(rows.mask_u[i], rows.upper[i] - rows.v[i], width, zeta, rows.t_u[i], rows.z_u[i]);
  }
}

template <class Kkt>
void InteriorPoint<Kkt>::evaluate(Kkt& kkt) noexcept {
  kkt.row_values(w, rows.v);
  row_at_ = kernel_->evaluate(rows);
  info_.complementarity = row_at_.largest;
  if (follow_ && refinements_ == 0 && info_.complementarity > settings_.tolerance)
    follow_residuals();
  else
    take_residuals(kkt);
  info_.objective = at_.objective;
  info_.stationarity = at_.dual;
  info_.feasibility = std::max(at_.primal, kkt.row_violation(rows, row_at_.residual));
}

/// What an exact step leaves of the residuals, 1 - its length, while products alone say that this is not the end.
template <class Kkt>
void InteriorPoint<Kkt>::follow_residuals() noexcept {
  kernel_->axpy(primal_, -length_, r_d_, r_d_);
  kernel_->axpy(dual_, -length_, r_p_, r_p_);
  at_.dual *= 1.0 - length_, at_.primal *= 1.0 - length_;
  stale_ = true;
}

template <class Kkt>
void InteriorPoint<Kkt>::take_residuals(Kkt& kkt) noexcept {
  // More than 1 - length of the residuals left means that the linear solves lack digits. The shifts cost a little of
  // every step; the next one makes up for it.
  const double left = stale_ ? 1.0 : 2.0 * (1.0 - length_) + 1e-2, floor = settings_.tolerance;
  const Residual before = at_;
  at_ = kkt.residual(w, y, rows.zeta, r_d_, r_p_);
  const bool short_of_digits = at_.dual > left * before.dual + floor || at_.primal > left * before.primal + floor;
  if (short_of_digits && refinements_ == settings_.refinement_steps) kkt.stiffen();
  refinements_ =
      short_of_digits ? std::min(refinements_ + 1, settings_.refinement_steps) : std::max(refinements_ - 1, 0);
  follow_ = kkt.exact_steps() && !short_of_digits;
  stale_ = false;
}

template <class Kkt>
bool InteriorPoint<Kkt>::converged() const noexcept {
  return info_.stationarity <= settings_.tolerance && info_.feasibility <= settings_.tolerance &&
         info_.complementarity <= settings_.tolerance && row_at_.product <= allowed_gap();
}

template <class Kkt>
auto InteriorPoint<Kkt>::judge(Kkt& kkt, Deadline deadline) noexcept -> Verdict {
  if (!std::isfinite(at_.objective + at_.dual + at_.primal + row_at_.product)) return end(Status::numerical_failure);
  if (converged()) return end(Status::optimal);
  const bool exhausted = info_.iterations >= settings_.max_iterations;
  if (!exhausted && info_.iterations > 4 && certified(kkt)) return Verdict::stop;
  if (!exhausted && !deadline.passed()) return Verdict::go_on;
  if (stale_) {
    take_residuals(kkt);
    info_.objective = at_.objective, info_.stationarity = at_.dual;
    info_.feasibility = std::max(at_.primal, kkt.row_violation(rows, row_at_.residual));
  }
  return end(exhausted ? Status::iteration_limit : Status::deadline_reached);
}

template <class Kkt>
auto InteriorPoint<Kkt>::end(Status status) noexcept -> Verdict {
  info_.status = status;
  return Verdict::stop;
}

/// Rounding can cost a pivot its sign; a few stiffer shifts restore it where the problem is convex at all.
template <class Kkt>
bool InteriorPoint<Kkt>::factor(Kkt& kkt, const double* weight, const double* h) noexcept {
  ++info_.iterations;
  for (int attempt = 0; attempt < 4; ++attempt) {
    if (kkt.factor(weight, r_d_, r_p_, h)) return true;
    kkt.stiffen();
  }
  info_.status = Status::numerical_failure;
  return false;
}

/// The affine step; returns Mehrotra's target for the products, sigma mu.
template <class Kkt>
double InteriorPoint<Kkt>::predict(Kkt& kkt) noexcept {
  kkt.step(dw_, Kkt::primal_alone && refinements_ == 0 ? nullptr : dy_, nullptr, refinements_);
  kkt.row_values(dw_, rows.dv);
  const RowStep affine = kernel_->predict(rows);
  const double p = step_length(affine.ratio.primal, 1.0), d = step_length(affine.ratio.dual, 1.0);
  const double after = row_at_.product + d * affine.t_dz + p * affine.z_dt + p * d * affine.dt_dz;
  affine_ratio_ = row_at_.product > 0.0 ? std::clamp(after / row_at_.product, 0.0, 1.0) : 0.0;
  // Products far below what convergence asks for buy nothing and cost digits: weights are multipliers over slacks.
  const double floor = 0.3 * std::min(settings_.tolerance, mean(allowed_gap()));
  return std::max(floor, affine_ratio_ * affine_ratio_ * affine_ratio_ * mean(row_at_.product));
}

template <class Kkt>
void InteriorPoint<Kkt>::correct(Kkt& kkt, double target) noexcept {
  kernel_->correct(rows, target);
  kkt.solve(r_d_, r_p_, rows.shift, dw_, dy_, rows.nu, refinements_);
  kkt.row_values(dw_, rows.dv);
  const StepRatios ratio = kernel_->step(rows, target);
  const double fraction = std::max(0.99, 1.0 - 10.0 * mean(row_at_.product));
  advance(step_length(std::max(ratio.primal, ratio.dual), std::min(fraction, 0.9995)));
}

template <class Kkt>
void InteriorPoint<Kkt>::advance(double length) noexcept {
  length_ = length;
  kernel_->axpy(primal_, length, dw_, w);
  kernel_->axpy(dual_, length, dy_, y);
  kernel_->advance(rows, length);
}

/// Reads the active set off the affine step, free of scaling: it takes an active slack to 0, its multiplier nowhere,
/// and the other way round. True when the step goes far, few rows changed or are doubtful, and the guess is no neighbour
/// of one that failed.
template <class Kkt>
bool InteriorPoint<Kkt>::settled() noexcept {
  if (settings_.active_set_steps == 0) return false;
  constexpr double doubt = 0.2, far = 0.3;
  int changed = 0, doubtful = 0, elsewhere = 0;
  for (int i = 0; i < rows.size; ++i) {
    const double to_lower = -rows.mask_l[i] * (rows.r_l[i] + rows.dv[i]) * rows.inv_l[i];
    const double to_upper = -rows.mask_u[i] * (rows.r_u[i] - rows.dv[i]) * rows.inv_u[i];
    const double most = std::max(to_lower, to_upper);
    const auto side = static_cast<signed char>(most < 0.5 ? 0 : to_upper > to_lower ? 1 : -1);
    doubtful += most >= doubt && most <= 1.0 - doubt;
    changed += side != guess_[static_cast<std::size_t>(i)];
    elsewhere += side != tried_[static_cast<std::size_t>(i)];
    guess_[static_cast<std::size_t>(i)] = side;
  }
  if (affine_ratio_ > far || changed > few() || 2 * doubtful > 3 * few() || 2 * elsewhere < tried_wrong_) return false;
  tried_ = side_ = guess_;
  return true;
}

/// Primal-dual active-set steps (Hintermueller, Ito, Kunisch 2002) from the guess in side_, as long as they correct few
/// rows and no more than the step before: many corrections mean many steps, or none that ends. Each failure halves what
/// the next attempt may correct. On success the iterate is the exact solution; otherwise the interior iterate is
/// untouched.
template <class Kkt>
bool InteriorPoint<Kkt>::finish_on_active_set(Kkt& kkt, Deadline deadline) noexcept {
  int most = std::exchange(correctable_, std::max(1, correctable_ / 2));
  for (int step = 0; step < settings_.active_set_steps && info_.iterations < settings_.max_iterations; ++step) {
    if (deadline.passed() || !kkt.can_hold(side_.data())) return false;
    if (step == 0) std::copy_n(w, primal_, as_w_), std::copy_n(y, dual_, as_y_);
    ++info_.active_set_steps;
    if (!solve_on_active_set(kkt)) return false;
    const int changed = revise_active_set();
    if (step == 0) tried_wrong_ = std::min(changed, few());
    if (changed == 0) return accept_active_set(kkt);
    if (changed > most) return false;
    most = changed;
  }
  return false;
}

/// minimise the objective with the rows of side_ (and fixed ones) as equalities, all others dropped.
template <class Kkt>
bool InteriorPoint<Kkt>::solve_on_active_set(Kkt& kkt) noexcept {
  constexpr double hold = 1e20;
  for (int i = 0; i < rows.size; ++i) {
    const auto side = side_[static_cast<std::size_t>(i)];
    as_target_[i] = side > 0 ? rows.upper[i] : rows.lower[i];
    as_weight_[i] = side != 0 || rows.fixed[i] > 0.0 ? hold : 0.0;
    as_zeta_[i] = 0.0;
  }
  kkt.pin(as_w_, as_target_, as_weight_);
  kkt.row_values(as_w_, as_v_);
  for (int i = 0; i < rows.size; ++i)
    as_shift_[i] = as_weight_[i] > 0.0 ? as_weight_[i] * (as_v_[i] - as_target_[i]) : 0.0;
  kkt.residual(as_w_, as_y_, as_zeta_, as_rd_, as_rp_);
  ++info_.iterations;
  kkt.adapt(0.0);
  if (!kkt.factor(as_weight_, as_rd_, as_rp_, as_shift_)) return false;
  kkt.step(dw_, dy_, as_zeta_, std::max(refinements_, Kkt::least_refinements));
  kernel_->axpy(primal_, 1.0, dw_, as_w_);
  kernel_->axpy(dual_, 1.0, dy_, as_y_);
  kkt.row_values(as_w_, as_v_);
  return true;
}

/// Rows whose multiplier pulls the wrong way leave, violated rows enter; returns how many changed.
template <class Kkt>
int InteriorPoint<Kkt>::revise_active_set() noexcept {
  const double slack = settings_.tolerance;
  int changed = 0;
  for (int i = 0; i < rows.size; ++i) {
    auto& side = side_[static_cast<std::size_t>(i)];
    if (!(as_weight_[i] > 0.0)) as_zeta_[i] = 0.0;
    if (side != 0) {
      if (as_zeta_[i] * side < 0.0) side = 0, ++changed;
    } else if (rows.mask_l[i] > 0.0 && as_v_[i] < rows.lower[i] - slack) {
      side = -1, ++changed;
    } else if (rows.mask_u[i] > 0.0 && as_v_[i] > rows.upper[i] + slack) {
      side = 1, ++changed;
    }
  }
  return changed;
}

/// Takes the point over if it is a solution to the tolerance.
template <class Kkt>
bool InteriorPoint<Kkt>::accept_active_set(Kkt& kkt) noexcept {
  const Residual at = kkt.residual(as_w_, as_y_, as_zeta_, as_rd_, as_rp_);
  double feasibility = at.primal, complementarity = 0.0;
  for (int i = 0; i < rows.size; ++i) {
    if (!(as_weight_[i] > 0.0)) continue;
    const double away = std::abs(as_v_[i] - as_target_[i]);
    feasibility = std::max(feasibility, away);
    complementarity = std::max(complementarity, away * std::abs(as_zeta_[i]));
  }
  if (!std::isfinite(at.objective + at.dual + feasibility + complementarity) ||
      std::max({at.dual, feasibility, complementarity}) > settings_.tolerance)
    return false;
  std::swap(w, as_w_), std::swap(y, as_y_), std::swap(rows.zeta, as_zeta_), std::swap(rows.v, as_v_);
  info_.status = Status::optimal;
  info_.objective = at.objective;
  info_.stationarity = at.dual;
  info_.feasibility = feasibility;
  info_.complementarity = complementarity;
  return true;
}

template <class Kkt>
bool InteriorPoint<Kkt>::certified(Kkt& kkt) noexcept {
  // Certificates show in the steps first: a multiplier or a point that runs away does so along its ray.
  const auto proves = [&](const Ray& ray) {  // even if its error is no rounding, for every point of 1-norm below 10
    return ray.error <= settings_.certificate && -ray.value > std::max(settings_.certificate, 10.0 * ray.error);
  };
  if (info_.feasibility > settings_.tolerance) {
    for (const bool steps : {true, false}) {
      const double* dual = steps ? dy_ : y;
      const double* zeta = steps ? rows.nu : rows.zeta;
      if (!proves(kkt.primal_ray(dual, zeta, rows))) continue;
      std::copy_n(dual, dual_, y);
      // Traces on bounds that do not exist are within the accepted error, and infinite in the certificate's value.
      for (int i = 0; i < rows.size; ++i) {
        const bool exists = rows.fixed[i] > 0.0 || (zeta[i] > 0.0 ? rows.mask_u[i] : rows.mask_l[i]) > 0.0;
        rows.zeta[i] = exists ? zeta[i] : 0.0;
      }
      info_.status = Status::primal_infeasible;
      return true;
    }
  }
  if (compact_) return false;
  for (const double* direction : {dw_, w}) {
    if (!proves(kkt.dual_ray(direction, rows))) continue;
    std::copy_n(direction, primal_, w);
    info_.status = Status::dual_infeasible;
    return true;
  }
  return false;
}

}  // namespace solenoid::qp
