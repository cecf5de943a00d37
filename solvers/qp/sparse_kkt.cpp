#include "solvers/qp/sparse_kkt.hpp"

extern "C" {  // ldl.h, unlike its siblings, leaves this to C++ callers
#include <ldl.h>
}

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace solenoid::qp {
namespace {

bool finite(const Eigen::VectorXd& v) {
  double sum = 0.0;
  for (Eigen::Index i = 0; i < v.size(); ++i) sum += v[i] * 0.0;
  return sum == 0.0;
}

constexpr double weightless = 1e-20;  // a row without bounds: its multiplier is pressed to zero

}  // namespace

void SparseKkt::Block::copy_pattern(const SparseQp::Matrix& matrix, bool upper_only) {
  start.assign(1, 0);
  row.clear();
  for (int j = 0; j < matrix.outerSize(); ++j) {
    for (SparseQp::Matrix::InnerIterator entry(matrix, j); entry; ++entry)
      if (!upper_only || entry.row() <= j) row.push_back(static_cast<int>(entry.row()));
    start.push_back(static_cast<int>(row.size()));
  }
  value.assign(row.size(), 0.0);
  slot.assign(row.size(), 0);
}

bool SparseKkt::Block::load(const SparseQp::Matrix& matrix, bool upper_only) noexcept {
  if (matrix.outerSize() + 1 != static_cast<int>(start.size())) return false;
  std::size_t next = 0;
  double sum = 0.0;
  for (int j = 0; j < matrix.outerSize(); ++j) {
    for (SparseQp::Matrix::InnerIterator entry(matrix, j); entry; ++entry) {
      if (upper_only && entry.row() > j) continue;
      if (next >= row.size() || row[next] != entry.row() || static_cast<int>(next) >= start[at(j) + 1]) return false;
      sum += entry.value() * 0.0;
      value[next++] = entry.value();
    }
    if (static_cast<int>(next) != start[at(j) + 1]) return false;
  }
  return sum == 0.0;
}

void SparseKkt::Block::multiply(const double* x, double* out) const noexcept {
  const int columns = static_cast<int>(start.size()) - 1;
  for (int j = 0; j < columns; ++j)
    for (int e = start[at(j)]; e < start[at(j) + 1]; ++e) out[row[at(e)]] += value[at(e)] * x[j];
}

void SparseKkt::Block::multiply_transposed(const double* x, double* out) const noexcept {
  const int columns = static_cast<int>(start.size()) - 1;
  for (int j = 0; j < columns; ++j) {
    double sum = 0.0;
    for (int e = start[at(j)]; e < start[at(j) + 1]; ++e) sum += value[at(e)] * x[row[at(e)]];
    out[j] += sum;
  }
}

void SparseKkt::setup(const SparseQp& problem, const Settings& settings) {
  n_ = problem.variables(), p_ = problem.equalities(), m_ = problem.inequalities();
  const auto shape = [](const SparseQp::Matrix& matrix, int rows, int columns) {
    return matrix.rows() == rows && matrix.cols() == columns;
  };
  if (!shape(problem.p_matrix, n_, n_) || !shape(problem.a_matrix, p_, n_) || !shape(problem.g_matrix, m_, n_) ||
      problem.lower.size() != n_ || problem.upper.size() != n_ || problem.g_upper.size() != m_)
    throw std::invalid_argument("SparseKkt::setup: matrices and vectors of the problem differ in shape");
  first_primal_shift_ = settings.primal_shift, first_dual_shift_ = settings.dual_shift;
  hessian_.copy_pattern(problem.p_matrix, true);
  equality_.copy_pattern(problem.a_matrix, false);
  inequality_.copy_pattern(problem.g_matrix, false);
  c_.assign(at(n_), 0.0), b_.assign(at(p_), 0.0);
  column_scale_.assign(at(n_), 1.0), equality_scale_.assign(at(p_), 1.0), row_scale_.assign(at(m_), 1.0);
  assemble_pattern();
  top_.assign(at(primal_size()), 0.0), middle_.assign(at(dual_size()), 0.0), bottom_.assign(at(m_), 0.0);
  nu_g_.assign(at(m_), 0.0), rhs_.assign(at(n_ + p_ + m_), 0.0), correction_.assign(at(m_), 0.0);
  step_top_ = top_, step_middle_ = middle_, step_bottom_ = correction_;
}

bool SparseKkt::load(const SparseQp& problem) noexcept {
  if (problem.variables() != n_ || problem.equalities() != p_ || problem.inequalities() != m_ ||
      problem.lower.size() != n_ || problem.upper.size() != n_ || problem.g_upper.size() != m_)
    return false;
  if (!hessian_.load(problem.p_matrix, true) || !equality_.load(problem.a_matrix, false) ||
      !inequality_.load(problem.g_matrix, false) || !finite(problem.c) || !finite(problem.b))
    return false;
  problem_ = &problem;
  primal_shift_ = first_primal_shift_, dual_shift_ = first_dual_shift_;
  std::copy_n(problem.c.data(), n_, c_.begin());
  std::copy_n(problem.b.data(), p_, b_.begin());
  equilibrate();
  scatter();
  return true;
}

/// Ruiz's square-root scaling of the columns and of the rows of A and G, only where their sizes are far from 1.
void SparseKkt::equilibrate() noexcept {
  for (auto* scale : {&column_scale_, &equality_scale_, &row_scale_}) std::fill(scale->begin(), scale->end(), 1.0);
  scaled_ = false;
  const auto size = [](double& most, double value) { most = std::max(most, std::abs(value)); };
  for (int pass = 0; pass < 10; ++pass) {
    std::fill(top_.begin(), top_.end(), 0.0);
    std::fill(middle_.begin(), middle_.end(), 0.0);
    std::fill(bottom_.begin(), bottom_.end(), 0.0);
    for (int j = 0; j < n_; ++j) {
      for (int e = hessian_.start[at(j)]; e < hessian_.start[at(j) + 1]; ++e) {
        size(top_[at(j)], hessian_.value[at(e)]);
        size(top_[at(hessian_.row[at(e)])], hessian_.value[at(e)]);
      }
      for (int e = equality_.start[at(j)]; e < equality_.start[at(j) + 1]; ++e) {
        size(top_[at(j)], equality_.value[at(e)]);
        size(middle_[at(equality_.row[at(e)])], equality_.value[at(e)]);
      }
      for (int e = inequality_.start[at(j)]; e < inequality_.start[at(j) + 1]; ++e) {
        size(top_[at(j)], inequality_.value[at(e)]);
        size(bottom_[at(inequality_.row[at(e)])], inequality_.value[at(e)]);
      }
    }
    double least = 1.0, most = 1.0;
    const auto factors = [&](std::vector<double>& sizes, int count) {
      for (int i = 0; i < count; ++i) {
        double& entry = sizes[at(i)];
        if (entry > 0.0) least = std::min(least, entry), most = std::max(most, entry);
        entry = entry > 0.0 ? 1.0 / std::sqrt(entry) : 1.0;
      }
    };
    factors(top_, n_), factors(middle_, p_), factors(bottom_, m_);
    if (pass == 0 ? least > 1e-4 && most < 1e4 : least > 0.25 && most < 4.0) return;
    scaled_ = true;
    for (int j = 0; j < n_; ++j) {
      const double column = top_[at(j)];
      for (int e = hessian_.start[at(j)]; e < hessian_.start[at(j) + 1]; ++e)
        hessian_.value[at(e)] *= column * top_[at(hessian_.row[at(e)])];
      for (int e = equality_.start[at(j)]; e < equality_.start[at(j) + 1]; ++e)
        equality_.value[at(e)] *= column * middle_[at(equality_.row[at(e)])];
      for (int e = inequality_.start[at(j)]; e < inequality_.start[at(j) + 1]; ++e)
        inequality_.value[at(e)] *= column * bottom_[at(inequality_.row[at(e)])];
      c_[at(j)] *= column, column_scale_[at(j)] *= column;
    }
    for (int i = 0; i < p_; ++i) b_[at(i)] *= middle_[at(i)], equality_scale_[at(i)] *= middle_[at(i)];
    for (int i = 0; i < m_; ++i) row_scale_[at(i)] *= bottom_[at(i)];
  }
}

/// Numbers of the problem and dual shifts into the permuted triangle; weights and primal shifts come with each
/// factorisation.
void SparseKkt::scatter() noexcept {
  std::fill(base_.begin(), base_.end(), 0.0);
  for (const Block* block : {&hessian_, &equality_, &inequality_})
    for (std::size_t e = 0; e < block->slot.size(); ++e) base_[at(block->slot[e])] += block->value[e];
  for (int i = 0; i < p_; ++i) base_[at(diagonal_[at(n_ + i)])] = -dual_shift_;
}

/// Far from stationary, a direction nothing bends is walked with care; close to it, freely.
void SparseKkt::adapt(double stationarity) noexcept {
  primal_shift_ = std::clamp(1e-5 * stationarity, first_primal_shift_, std::max(first_primal_shift_, 1e-5));
}

void SparseKkt::stiffen() noexcept {
  constexpr double most = 1e-3;  // beyond this it would be another problem that is convex
  primal_shift_ = std::min(100.0 * primal_shift_, most), dual_shift_ = std::min(100.0 * dual_shift_, most);
  scatter();
}

bool SparseKkt::bounds(Rows& rows) const noexcept {
  bool consistent = true;
  const auto row = [&](int i, double lower, double upper, double scale) {
    const bool has_lower = lower > -HUGE_VAL, has_upper = upper < HUGE_VAL, fixed = lower == upper;
    consistent = consistent && lower <= upper;
    rows.mask_l[i] = has_lower && !fixed ? 1.0 : 0.0;
    rows.mask_u[i] = has_upper && !fixed ? 1.0 : 0.0;
    rows.lower[i] = has_lower ? lower * scale : 0.0;
    rows.upper[i] = has_upper ? upper * scale : 0.0;
    rows.fixed[i] = fixed ? 1e20 : 0.0;
  };
  for (int j = 0; j < n_; ++j) row(j, problem_->lower[j], problem_->upper[j], 1.0 / column_scale_[at(j)]);
  for (int i = 0; i < m_; ++i) row(primal_size() + i, problem_->g_lower[i], problem_->g_upper[i], row_scale_[at(i)]);
  return consistent;
}

/// The origin, moved well inside the boxes.
void SparseKkt::start(double* w, double* y) noexcept {
  std::fill_n(y, dual_size(), 0.0);
  for (int j = 0; j < n_; ++j) {
    const double scale = 1.0 / column_scale_[at(j)];
    const double lower = problem_->lower[j] * scale, upper = problem_->upper[j] * scale, width = upper - lower;
    const double margin = std::isfinite(width) ? std::min(1.0, 0.25 * width) : 1.0;
    w[j] = lower == upper ? lower : std::max(std::min(0.0, upper - margin), lower + margin);
  }
}

void SparseKkt::row_values(const double* w, double* v) const noexcept {
  std::copy_n(w, n_, v);
  std::fill_n(v + primal_size(), m_, 0.0);
  inequality_.multiply(w, v + primal_size());
}

double SparseKkt::row_violation(const Rows& rows, double seen) const noexcept {
  double most = 0.0;
  const auto row = [&](int i, double unit) {
    const double held = rows.fixed[i] > 0.0 ? rows.v[i] - rows.lower[i] : 0.0;
    most = std::max({most, std::abs(rows.r_l[i]) * unit, std::abs(rows.r_u[i]) * unit, std::abs(held) * unit});
  };
  if (m_ == 0 && !scaled_) return seen;
  for (int j = 0; j < n_; ++j) row(j, column_scale_[at(j)]);
  for (int i = 0; i < m_; ++i) row(primal_size() + i, 1.0 / row_scale_[at(i)]);
  return most;
}

void SparseKkt::multiply_hessian(const double* w, double* out) const noexcept {
  for (int j = 0; j < n_; ++j) {
    double sum = 0.0;
    for (int e = hessian_.start[at(j)]; e < hessian_.start[at(j) + 1]; ++e) {
      const int i = hessian_.row[at(e)];
      sum += hessian_.value[at(e)] * w[i];
      if (i != j) out[i] += hessian_.value[at(e)] * w[j];
    }
    out[j] += sum;
  }
}

Residual SparseKkt::residual(const double* w, const double* y, const double* zeta, double* r_d,
                             double* r_p) const noexcept {
  std::fill_n(r_d, n_, 0.0);
  multiply_hessian(w, r_d);
  Residual result;
  for (int j = 0; j < n_; ++j) {
    result.objective += w[j] * (0.5 * r_d[j] + c_[at(j)]);
    r_d[j] += c_[at(j)] + zeta[j];
  }
  equality_.multiply_transposed(y, r_d);
  inequality_.multiply_transposed(zeta + primal_size(), r_d);
  for (int i = 0; i < p_; ++i) r_p[i] = -b_[at(i)];
  equality_.multiply(w, r_p);
  for (int j = 0; j < n_; ++j) result.dual = std::max(result.dual, std::abs(r_d[j]) / column_scale_[at(j)]);
  for (int i = 0; i < p_; ++i) result.primal = std::max(result.primal, std::abs(r_p[i]) / equality_scale_[at(i)]);
  return result;
}

bool SparseKkt::factor(const double* weight, const double* r_d, const double* r_p, const double* h) noexcept {
  weight_ = weight, r_d_ = r_d, r_p_ = r_p, h_ = h;
  std::copy(base_.begin(), base_.end(), values_.begin());
  for (int j = 0; j < n_; ++j) values_[at(diagonal_[at(j)])] += weight[j] + primal_shift_;
  for (int i = 0; i < m_; ++i) {
    // A row held exactly is one more equality, and shifted like one.
    const double w = std::max(weight[primal_size() + i], weightless);
    values_[at(diagonal_[at(n_ + p_ + i)])] = -std::max(1.0 / w, w > 1e19 ? dual_shift_ : 0.0);
  }
  const int size = n_ + p_ + m_;
  const int done = ldl_numeric(size, start_.data(), row_.data(), values_.data(), l_start_.data(), parent_.data(),
                               count_.data(), l_row_.data(), l_values_.data(), pivot_.data(), work_.data(),
                               pattern_.data(), flag_.data(), nullptr, nullptr);
  bool signs = done == size;
  for (int i = 0; i < size; ++i) {
    const double pivot = pivot_[at(inverse_[at(i)])];
    signs = signs && (i < n_ ? pivot > 0.0 : pivot < 0.0);
  }
  return signs;
}

void SparseKkt::solve_once(double* top, double* middle, double* bottom) noexcept {
  const int size = n_ + p_ + m_;
  for (int j = 0; j < n_; ++j) rhs_[at(inverse_[at(j)])] = top[j];
  for (int i = 0; i < p_; ++i) rhs_[at(inverse_[at(n_ + i)])] = middle[i];
  for (int i = 0; i < m_; ++i) rhs_[at(inverse_[at(n_ + p_ + i)])] = bottom[i];
  ldl_lsolve(size, rhs_.data(), l_start_.data(), l_row_.data(), l_values_.data());
  ldl_dsolve(size, rhs_.data(), pivot_.data());
  ldl_ltsolve(size, rhs_.data(), l_start_.data(), l_row_.data(), l_values_.data());
  for (int j = 0; j < n_; ++j) top[j] = rhs_[at(inverse_[at(j)])];
  for (int i = 0; i < p_; ++i) middle[i] = rhs_[at(inverse_[at(n_ + i)])];
  for (int i = 0; i < m_; ++i) bottom[i] = rhs_[at(inverse_[at(n_ + p_ + i)])];
}

/// What (dw, dy, nu of G) leave of the system without its dual shifts, negated, into top_, middle_ and correction_;
/// returns the largest entry, infinity if one is no number.
double SparseKkt::defect(const double* r_d, const double* r_p, const double* h, const double* dw,
                         const double* dy) noexcept {
  const double *weight_g = weight_ + primal_size(), *h_g = h + primal_size();
  for (int j = 0; j < n_; ++j) top_[at(j)] = r_d[j] + h[j] + (weight_[j] + primal_shift_) * dw[j];
  multiply_hessian(dw, top_.data());
  equality_.multiply_transposed(dy, top_.data());
  inequality_.multiply_transposed(nu_g_.data(), top_.data());
  std::copy_n(r_p, p_, middle_.begin());
  equality_.multiply(dw, middle_.data());
  for (int i = 0; i < m_; ++i) correction_[at(i)] = (h_g[i] - nu_g_[at(i)]) / std::max(weight_g[i], weightless);
  inequality_.multiply(dw, correction_.data());
  double most = 0.0;
  bool finite = true;
  for (auto* part : {&top_, &middle_, &correction_})
    for (double& value : *part) {
      finite = finite && std::isfinite(value);
      most = std::max(most, std::abs(value)), value = -value;
    }
  return finite ? most : HUGE_VAL;
}

void SparseKkt::solve(const double* r_d, const double* r_p, const double* h, double* dw, double* dy, double* nu,
                      int refinements) noexcept {
  const double *weight_g = weight_ + primal_size(), *h_g = h + primal_size();
  for (int j = 0; j < n_; ++j) dw[j] = -(r_d[j] + h[j]);
  for (int i = 0; i < p_; ++i) dy[i] = -r_p[i];
  for (int i = 0; i < m_; ++i) nu_g_[at(i)] = -h_g[i] / std::max(weight_g[i], weightless);
  solve_once(dw, dy, nu_g_.data());
  // Refined against the matrix without its dual shifts, equalities come out exact where they are consistent; but a
  // factor that has lost too many digits makes it worse.
  const auto correct = [&](double by) {
    for (int j = 0; j < n_; ++j) dw[j] += by * step_top_[at(j)];
    for (int i = 0; i < p_; ++i) dy[i] += by * step_middle_[at(i)];
    for (int i = 0; i < m_; ++i) nu_g_[at(i)] += by * step_bottom_[at(i)];
  };
  double left = refinements > 0 ? defect(r_d, r_p, h, dw, dy) : 0.0;
  const auto finite = [](const std::vector<double>& part) {
    return std::ranges::all_of(part, [](double value) { return std::isfinite(value); });
  };
  for (int step = 0; step < refinements && left > 0.0; ++step) {
    step_top_ = top_, step_middle_ = middle_, step_bottom_ = correction_;
    solve_once(step_top_.data(), step_middle_.data(), step_bottom_.data());
    if (!finite(step_top_) || !finite(step_middle_) || !finite(step_bottom_)) break;
    correct(1.0);
    const double before = std::exchange(left, defect(r_d, r_p, h, dw, dy));
    if (left < before) continue;
    correct(-1.0);
    break;
  }
  if (nu == nullptr) return;
  for (int j = 0; j < n_; ++j) nu[j] = weight_[j] * dw[j] + h[j];
  std::copy_n(nu_g_.begin(), m_, nu + primal_size());
}

void SparseKkt::pin(double* w, const double* target, const double* weight) const noexcept {
  for (int j = 0; j < n_; ++j) w[j] = weight[j] > 0.0 ? target[j] : w[j];
}

Ray SparseKkt::primal_ray(const double* y, const double* zeta, const Rows& rows) noexcept {
  double largest = 0.0, support = 0.0, cone = 0.0, error = 0.0;
  for (int i = 0; i < p_; ++i) {
    largest = std::max(largest, std::abs(y[i]) * equality_scale_[at(i)]);
    support += b_[at(i)] * y[i];
  }
  const auto row = [&](int i, double unit) {
    const bool upward = zeta[i] > 0.0;
    const double size = std::abs(zeta[i]) * unit;
    largest = std::max(largest, size);
    if (rows.fixed[i] > 0.0 || (upward ? rows.mask_u[i] : rows.mask_l[i]) > 0.0)
      support += zeta[i] * (upward ? rows.upper[i] : rows.lower[i]);
    else
      cone = std::max(cone, size);
  };
  for (int j = 0; j < n_; ++j) row(j, 1.0 / column_scale_[at(j)]);
  for (int i = 0; i < m_; ++i) row(primal_size() + i, row_scale_[at(i)]);
  std::copy_n(zeta, n_, top_.begin());
  equality_.multiply_transposed(y, top_.data());
  inequality_.multiply_transposed(zeta + primal_size(), top_.data());
  for (int j = 0; j < n_; ++j) error = std::max(error, std::abs(top_[at(j)]) / column_scale_[at(j)]);
  if (!(largest > 0.0)) return {1.0, 0.0};
  // The sign that speaks: the certificate's value is the negative of the support of y and zeta.
  return {std::max(error, cone) / largest, support / largest};
}

Ray SparseKkt::dual_ray(const double* w, const Rows& rows) noexcept {
  double slope = 0.0;
  struct {
    double largest = 0.0, error = 0.0;
  } own, scaled;  // in the problem's units and in the solver's, where a flat direction is no matter of small units
  std::fill(top_.begin(), top_.end(), 0.0);
  std::fill(middle_.begin(), middle_.end(), 0.0);
  std::fill(bottom_.begin(), bottom_.end(), 0.0);
  multiply_hessian(w, top_.data());
  equality_.multiply(w, middle_.data());
  inequality_.multiply(w, bottom_.data());
  const auto violates = [&](double by, double unit) {
    own.error = std::max(own.error, by * unit), scaled.error = std::max(scaled.error, by);
  };
  const auto row = [&](int i, double value, double unit) {
    if (rows.fixed[i] > 0.0) violates(std::abs(value), unit);
    if (rows.mask_l[i] > 0.0) violates(-value, unit);
    if (rows.mask_u[i] > 0.0) violates(value, unit);
  };
  for (int j = 0; j < n_; ++j) {
    own.largest = std::max(own.largest, std::abs(w[j]) * column_scale_[at(j)]);
    scaled.largest = std::max(scaled.largest, std::abs(w[j]));
    slope += c_[at(j)] * w[j];
    violates(std::abs(top_[at(j)]), 1.0 / column_scale_[at(j)]);
    row(j, w[j], column_scale_[at(j)]);
  }
  for (int i = 0; i < p_; ++i) violates(std::abs(middle_[at(i)]), 1.0 / equality_scale_[at(i)]);
  for (int i = 0; i < m_; ++i) row(primal_size() + i, bottom_[at(i)], 1.0 / row_scale_[at(i)]);
  if (!(own.largest > 0.0)) return {1.0, 0.0};
  return {std::max(own.error / own.largest, scaled.error / scaled.largest), slope / own.largest};
}

void SparseKkt::unpack(const double* w, const double* y, const double* zeta, SparseSolution& solution) const noexcept {
  for (int j = 0; j < n_; ++j) {
    solution.x[j] = w[j] * column_scale_[at(j)];
    solution.z_box[j] = zeta[j] / column_scale_[at(j)];
  }
  for (int i = 0; i < p_; ++i) solution.y[i] = y[i] * equality_scale_[at(i)];
  for (int i = 0; i < m_; ++i) solution.z_g[i] = zeta[primal_size() + i] * row_scale_[at(i)];
}

void SparseKkt::repack(const SparseSolution& solution, double* w, double* y, double* zeta) const noexcept {
  for (int j = 0; j < n_; ++j) {
    w[j] = solution.x[j] / column_scale_[at(j)];
    zeta[j] = solution.z_box[j] * column_scale_[at(j)];
  }
  for (int i = 0; i < p_; ++i) y[i] = solution.y[i] / equality_scale_[at(i)];
  for (int i = 0; i < m_; ++i) zeta[primal_size() + i] = solution.z_g[i] / row_scale_[at(i)];
}

}  // namespace solenoid::qp
