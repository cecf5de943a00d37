#include "experiments/campaign/run_in_progress.hpp"

#include <utility>

namespace solenoid {
namespace {

thread_local RunInProgress* innermost_run = nullptr;

}  // namespace

RunInProgress::RunInProgress(const ScenarioConfig& scenario) noexcept : scenario_(scenario), around_(innermost_run) {
  innermost_run = this;
}

RunInProgress::~RunInProgress() { innermost_run = around_; }

RunInProgress* RunInProgress::here() noexcept { return innermost_run; }

void RunInProgress::require_sound() const {
  if (why_) std::rethrow_exception(why_);
}

void fail_run(std::exception_ptr why) noexcept {
  if (innermost_run && !innermost_run->why_) innermost_run->why_ = std::move(why);
}

}  // namespace solenoid
