#pragma once

#include "core/rt/clock.hpp"
#include "core/rt/deferred_solver.hpp"
#include "core/rt/mailbox.hpp"
#include "core/rt/process_setup.hpp"

#include <algorithm>
#include <atomic>
#include <memory>
#include <optional>
#include <thread>

namespace solenoid {

/// These settings say how a solver's thread lives.
struct SolverThreadSettings {
  double period_s = 0.005;  ///< posts come so often: between them the thread naps, shortly before one it looks often
  double nap_s = 0.001;     ///< so long: a problem that is posed in between, because a switch failed, waits no longer
  double lead_s = 0.001;    ///< before a post comes the problem as it is expected, for solvers that anticipate
  double look_s = 50e-6;    ///< how often
  int priority = 0;         ///< SCHED_FIFO below the tick's; 0: as it is
  int core = -1;            ///< -1: any
  double patience_s = 1.0;  ///< at the end: so long for a solve under way before the thread is left behind
};

/// Runs a solver in a thread of its own, between two mailboxes. Posting and collecting make no system call: the thread
/// looks for work itself, so that the tick need not wake it. A solver that never returns costs its thread, not the
/// tick.
class BackgroundSolver final : public DeferredSolver {
 public:
  BackgroundSolver(std::unique_ptr<AnySolver> solver, const SolverThreadSettings& settings)
      : solver_(std::move(solver)), settings_(settings) {}
  BackgroundSolver(const BackgroundSolver&) = delete;
  BackgroundSolver& operator=(const BackgroundSolver&) = delete;

  /// Joins the thread, or after patience_s leaves it behind with everything it uses.
  ~BackgroundSolver() override {
    if (!thread_.joinable()) return;
    shared_->stop.store(true);
    MonotonicClock clock;
    while (!shared_->ended.load() && clock.now_s() < settings_.patience_s) clock.sleep_until(clock.now_s() + 1e-3);
    if (shared_->ended.load())
      thread_.join();
    else
      thread_.detach();
  }

  void post(std::int64_t ticket, const AnyProblem& problem, const AnyPlan& warm_start,
            double budget_s) noexcept override {
    put(ticket, problem, warm_start, budget_s);
  }
  bool anticipates() const override { return shared_->solver->anticipates(); }
  std::optional<MostWork> most_work(const AnyProblem& shape) const override {
    return (shared_ ? *shared_->solver : *solver_).most_work(shape);
  }
  const Finished* collect() noexcept override {
    return shared_->finished.take() ? &shared_->finished.front() : nullptr;
  }

 private:
  static constexpr std::int64_t expectation = -2;  // the ticket of a problem that is still to be measured
  struct Posted {
    std::int64_t ticket = -1;
    double budget_s = 0.0;
    Held<AnyProblem> problem;
    Held<AnyPlan> warm_start;
  };
  /// Both sides share this, and it outlives the solver object if the thread hangs.
  struct Shared {
    Shared(const AnyProblem& problem, std::unique_ptr<AnySolver> s, const SolverThreadSettings& t)
        : solver(std::move(s)),
          settings(t),
          posted(Posted{-1, 0.0, Held(problem), Held(problem.new_plan())}),
          finished(Finished{-1, Held(problem.new_plan()), {}}) {}

    void work() noexcept {
      prepare_thread("solver");
      if (settings.core >= 0) pin_to_core("solver", settings.core);
      if (settings.priority > 0) set_fifo_priority("solver", settings.priority);
      MonotonicClock clock;
      const double lead_s = solver->anticipates() ? settings.lead_s : 0.0, early_s = 6 * settings.look_s;
      double due = 0.0;   // when the next problem is to be posed
      double look = 0.0;  // and from when on something may come in time
      while (!stop.load(std::memory_order_relaxed)) {
        if (!posted.take()) {
          const double now = clock.now_s();
          clock.sleep_until(now + std::max(settings.look_s, std::min(look - now, settings.nap_s)));
          continue;
        }
        const double begun = clock.now_s();
        if (posted.front().ticket == expectation) {
          solver->anticipate(*posted.front().problem, *posted.front().warm_start);
          look = begun + lead_s - early_s;
          continue;
        }
        solve();
        if (begun >= due - early_s) due = begun + settings.period_s;  // else one out of turn
        look = due - lead_s - early_s;
      }
      ended.store(true);
    }
    void solve() noexcept {
      Posted& work = posted.front();
      Finished& done = finished.back();
      done.ticket = work.ticket;
      done.plan->assign(*work.warm_start);
      const Deadline deadline = work.budget_s > 0 ? Deadline::after_s(work.budget_s) : Deadline::never();
      done.report = solver->solve(*work.problem, *done.plan, deadline);
      finished.put();
    }

    std::unique_ptr<AnySolver> solver;
    SolverThreadSettings settings;
    Mailbox<Posted> posted;
    Mailbox<Finished> finished;
    std::atomic<bool> stop{false}, ended{false};
  };

  /// Prepares the solver (may throw) and starts the thread.
  void do_prepare(const AnyProblem& problem) override {
    solver_->prepare(problem);
    shared_ = std::make_shared<Shared>(problem, std::move(solver_), settings_);
    thread_ = std::thread([shared = shared_] { shared->work(); });
  }
  /// Posts the problem and waits for its plan: for callers outside of the tick.
  SolveReport do_solve(const AnyProblem& problem, AnyPlan& plan, Deadline) noexcept override {
    constexpr std::int64_t ticket = -3;
    post(ticket, problem, plan, 0.0);
    MonotonicClock clock;
    for (;;) {
      const Finished* done = collect();
      if (done && done->ticket == ticket) {
        plan.assign(*done->plan);
        return done->report;
      }
      clock.sleep_until(clock.now_s() + settings_.look_s);
    }
  }
  void do_anticipate(const AnyProblem& expected, const AnyPlan& warm_start) noexcept override {
    put(expectation, expected, warm_start, 0.0);
  }

  void put(std::int64_t ticket, const AnyProblem& problem, const AnyPlan& warm_start, double budget_s) noexcept {
    Posted& slot = shared_->posted.back();
    slot.ticket = ticket;
    slot.budget_s = budget_s;
    slot.problem->copy_conditions(problem);
    slot.warm_start->assign(warm_start);
    shared_->posted.put();
  }

  std::unique_ptr<AnySolver> solver_;  // until prepare
  SolverThreadSettings settings_;
  std::shared_ptr<Shared> shared_;
  std::thread thread_;
};

}  // namespace solenoid
