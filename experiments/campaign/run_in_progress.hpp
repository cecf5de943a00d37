#pragma once

#include "experiments/campaign/scenario.hpp"

#include <exception>

namespace solenoid {

/// The simulated run that a thread is about, from before its controller is made to its end. In real time there is none.
class RunInProgress {
 public:
  /// `scenario` must outlive it.
  explicit RunInProgress(const ScenarioConfig& scenario) noexcept;
  ~RunInProgress();
  RunInProgress(const RunInProgress&) = delete;
  RunInProgress& operator=(const RunInProgress&) = delete;

  /// That of this thread, or null.
  static RunInProgress* here() noexcept;

  const ScenarioConfig& scenario() const noexcept { return scenario_; }
  bool failed() const noexcept { return why_ != nullptr; }
  /// Throws why it failed, if it did.
  void require_sound() const;

 private:
  friend void fail_run(std::exception_ptr why) noexcept;

  const ScenarioConfig& scenario_;
  RunInProgress* around_;
  std::exception_ptr why_;
};

/// For what may not throw, a controller's step and a solver's solve: the run of this thread ends with the tick and has
/// failed, with this exception, the first one if there are several. Until then the caller gives what is safe. In real
/// time nobody hears it, and what is safe has to do.
///
///     catch (...) { fail_run(std::current_exception()); }
void fail_run(std::exception_ptr why) noexcept;

}  // namespace solenoid
