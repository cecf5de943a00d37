#pragma once

#include "solvers/qp/ocp_solver.hpp"

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <hpipm_d_ocp_qp_ipm.h>
#include <hpipm_d_part_cond.h>

namespace solenoid::peers {

using Problem = qp::OcpQp<4, 3>;
using Inputs = qp::OcpSolution<4, 3>::List<qp::OcpStage<4, 3>::U>;

/// A solver with its settings, from a cold start, for problems of one horizon.
class Contender {
 public:
  explicit Contender(std::string name) : name_(std::move(name)) {}
  Contender(const Contender&) = delete;
  Contender& operator=(const Contender&) = delete;
  virtual ~Contender() = default;
  const std::string& name() const { return name_; }

  /// The problem of the solves that follow, which outlives them; takes no part in their time.
  virtual void pose(const Problem& problem) = 0;
  /// What is timed.
  virtual void solve() = 0;
  virtual bool solved() const = 0;     ///< by its own criterion
  virtual int iterations() const = 0;  ///< factorisations of the KKT system
  virtual Inputs inputs() = 0;         ///< N of them

 private:
  std::string name_;
};

/// Solenoid's solver; bringing the problem into its own layout and the solution out of it is part of a solve.
class Solenoid final : public Contender {
 public:
  Solenoid(std::string name, const Problem& like, const qp::Settings& settings)
      : Contender(std::move(name)), solution_(like.horizon()) {
    solver_.setup(like, settings);
  }
  void pose(const Problem& problem) override { problem_ = &problem; }
  void solve() override { info_ = solver_.solve(*problem_, solution_); }
  bool solved() const override { return info_.status == qp::Status::optimal; }
  int iterations() const override { return info_.iterations; }
  Inputs inputs() override { return solution_.u; }

 private:
  qp::OcpSolver<4, 3> solver_;
  qp::OcpSolution<4, 3> solution_;
  qp::Info info_;
  const Problem* problem_ = nullptr;
};

struct HpipmSettings {
  hpipm_mode mode = SPEED;
  double mu0 = 1.0;  ///< complementarity product of the start
  double tolerance = 1e-8;
  int blocks = 0;  ///< stages left by partial condensing; 0: none is condensed
};

/// HPIPM's solver with x_0 eliminated; a solve condenses and expands, and gives what the mode gives: SPEED_ABS no
/// multipliers of the dynamics.
class Hpipm final : public Contender {
 public:
  Hpipm(std::string name, int horizon, const HpipmSettings& settings)
      : Contender(std::move(name)), horizon_(horizon), condensed_(settings.blocks > 0) {
    create(whole_, horizon);
    std::vector<int> nx(stages(), 4), nu(stages(), 3), none(stages(), 0);
    nx.front() = 0;
    nu.back() = 0;
    d_ocp_qp_dim_set_all(nx.data(), nu.data(), none.data(), nu.data(), none.data(), none.data(), &whole_.dim);
    create_data(whole_);
    if (condensed_) condense_to(settings.blocks);
    create_method(settings);
  }

  /// throws  std::runtime_error where an input is unbounded or states are bounded: the recorded problems have no such
  void pose(const Problem& problem) override {
    if (problem.horizon() != horizon_ || problem.state_bounds)
      throw std::runtime_error("HPIPM is set up for another shape of problem");
    int diagonal = 1, box[] = {0, 1, 2};
    for (int k = 0; k <= horizon_; ++k) {
      auto stage = problem.stages[static_cast<std::size_t>(k)];  // HPIPM asks for what it may write
      if (k == 0) stage.c += stage.a * problem.x0, stage.r += stage.s_matrix * problem.x0;
      if (k > 0) d_ocp_qp_set_Q(k, stage.q_matrix.data(), &whole_.qp), d_ocp_qp_set_q(k, stage.q.data(), &whole_.qp);
      diagonal = stage.q_matrix.isDiagonal(0.0) && stage.r_matrix.isDiagonal(0.0) && stage.s_matrix.isZero(0.0);
      d_ocp_qp_set_diag_H_flag(k, &diagonal, &whole_.qp);
      if (k == horizon_) break;
      if (!stage.u_lower.allFinite() || !stage.u_upper.allFinite())
        throw std::runtime_error("an unbounded input: HPIPM would want a mask");
      if (k > 0) d_ocp_qp_set_A(k, stage.a.data(), &whole_.qp), d_ocp_qp_set_S(k, stage.s_matrix.data(), &whole_.qp);
      d_ocp_qp_set_B(k, stage.b.data(), &whole_.qp);
      d_ocp_qp_set_b(k, stage.c.data(), &whole_.qp);
      d_ocp_qp_set_R(k, stage.r_matrix.data(), &whole_.qp);
      d_ocp_qp_set_r(k, stage.r.data(), &whole_.qp);
      d_ocp_qp_set_idxbu(k, box, &whole_.qp);
      d_ocp_qp_set_lbu(k, stage.u_lower.data(), &whole_.qp);
      d_ocp_qp_set_ubu(k, stage.u_upper.data(), &whole_.qp);
    }
  }

  void solve() override {
    if (condensed_) d_part_cond_qp_cond(&whole_.qp, &small_.qp, &condensing_, &condensing_memory_);
    d_ocp_qp_ipm_solve(&solved_->qp, &solved_->solution, &settings_, &memory_);
    if (condensed_)
      d_part_cond_qp_expand_sol(&whole_.qp, &small_.solution, &whole_.solution, &condensing_, &condensing_memory_);
  }

  bool solved() const override { return memory_.status == SUCCESS; }
  int iterations() const override { return memory_.iter; }
  Inputs inputs() override {
    Inputs u(stages() - 1);
    for (int k = 0; k < horizon_; ++k) d_ocp_qp_sol_get_u(k, &whole_.solution, u[static_cast<std::size_t>(k)].data());
    return u;
  }

 private:
  struct Layout {
    d_ocp_qp_dim dim;
    d_ocp_qp qp;
    d_ocp_qp_sol solution;
  };

  std::size_t stages() const { return static_cast<std::size_t>(horizon_) + 1; }
  void* take(hpipm_size_t bytes) { return taken_.emplace_back(std::make_unique<std::byte[]>(bytes)).get(); }

  void create(Layout& layout, int horizon) {
    d_ocp_qp_dim_create(horizon, &layout.dim, take(d_ocp_qp_dim_memsize(horizon)));
  }
  void create_data(Layout& layout) {
    d_ocp_qp_create(&layout.dim, &layout.qp, take(d_ocp_qp_memsize(&layout.dim)));
    d_ocp_qp_set_all_zero(&layout.qp);
    d_ocp_qp_sol_create(&layout.dim, &layout.solution, take(d_ocp_qp_sol_memsize(&layout.dim)));
  }

  void condense_to(int blocks) {
    solved_ = &small_;
    create(small_, blocks);
    block_size_.resize(static_cast<std::size_t>(blocks) + 1);
    d_part_cond_qp_compute_block_size(horizon_, blocks, block_size_.data());
    d_part_cond_qp_compute_dim(&whole_.dim, block_size_.data(), &small_.dim);
    create_data(small_);
    d_part_cond_qp_arg_create(blocks, &condensing_, take(d_part_cond_qp_arg_memsize(blocks)));
    d_part_cond_qp_arg_set_default(&condensing_);
  }

  void create_method(const HpipmSettings& settings) {
    double tolerance = settings.tolerance, mu0 = settings.mu0;
    int most = 100;
    d_ocp_qp_ipm_arg_create(&solved_->dim, &settings_, take(d_ocp_qp_ipm_arg_memsize(&solved_->dim)));
    d_ocp_qp_ipm_arg_set_default(settings.mode, &settings_);
    d_ocp_qp_ipm_arg_set_mu0(&mu0, &settings_);
    d_ocp_qp_ipm_arg_set_iter_max(&most, &settings_);
    for (const auto set : {d_ocp_qp_ipm_arg_set_tol_stat, d_ocp_qp_ipm_arg_set_tol_eq, d_ocp_qp_ipm_arg_set_tol_ineq,
                           d_ocp_qp_ipm_arg_set_tol_comp})
      set(&tolerance, &settings_);
    const auto bytes = d_ocp_qp_ipm_ws_memsize(&solved_->dim, &settings_);
    d_ocp_qp_ipm_ws_create(&solved_->dim, &settings_, &memory_, take(bytes));
    if (!condensed_) return;
    d_part_cond_qp_arg_set_comp_dual_sol_eq(settings_.comp_dual_sol_eq, &condensing_);
    d_part_cond_qp_ws_create(
        &whole_.dim, block_size_.data(), &small_.dim, &condensing_, &condensing_memory_,
        take(d_part_cond_qp_ws_memsize(&whole_.dim, block_size_.data(), &small_.dim, &condensing_)));
  }

  int horizon_;
  bool condensed_;
  std::vector<std::unique_ptr<std::byte[]>> taken_;
  Layout whole_{}, small_{};
  Layout* solved_ = &whole_;
  std::vector<int> block_size_;
  d_part_cond_qp_arg condensing_{};
  d_part_cond_qp_ws condensing_memory_{};
  d_ocp_qp_ipm_arg settings_{};
  d_ocp_qp_ipm_ws memory_{};
};

}  // namespace solenoid::peers
