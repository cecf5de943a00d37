#include <cmath>
#include <memory>

#include <solenoid/controllers/any_solver.hpp>
#include <solenoid/experiments/plugin/plugin.hpp>

namespace plugin_name {

/// Descent by single changes: each block in turn gets the mode that costs least with the others as they are, until no
/// change helps or time is over. It asks the model nothing but what a plan costs, and so serves every system.
class Descent final : public solenoid::AnySolver {
 public:
  explicit Descent(const solenoid::VariantConfig& variant)
      : tools_(solenoid::system_of(variant).tools(variant)),
        most_rounds_(static_cast<int>(variant.added.at("plugin_name.rounds"))) {}

 private:
  void do_prepare(const solenoid::AnyProblem& problem) override { trial_ = solenoid::Held(problem.new_plan()); }

  solenoid::SolveReport do_solve(const solenoid::AnyProblem& problem, solenoid::AnyPlan& plan,
                                 solenoid::Deadline deadline) noexcept override {
    const auto begin = solenoid::Deadline::Clock::now();
    solenoid::SolveReport best = tools_.evaluate(problem, plan);
    const auto ended = [&](solenoid::Status status) {
      best.status = std::isfinite(best.cost) ? status : solenoid::Status::infeasible;
      best.time_us = solenoid::us_since(begin);
      return best;
    };
    bool better = true;
    for (int round = 0; round < most_rounds_ && better; ++round) {
      better = false;
      for (std::size_t b = 0; b < plan.modes.size(); ++b)
        for (int mode = 0; mode < problem.modes.size(); ++mode) {
          if (deadline.passed()) return ended(solenoid::Status::deadline_reached);
          trial_->assign(plan);
          trial_->modes[b] = mode;
          const solenoid::SolveReport tried = tools_.evaluate(problem, *trial_);
          ++best.nodes;
          if (!(tried.cost < best.cost)) continue;
          best.cost = tried.cost;
          best.switches = tried.switches;
          plan.assign(*trial_);
          better = true;
        }
    }
    return ended(solenoid::Status::feasible);
  }

  const solenoid::ModelTools& tools_;
  int most_rounds_;
  solenoid::Held<solenoid::AnyPlan> trial_;
};

}  // namespace plugin_name

SOLENOID_PLUGIN("plugin_name", registry) {
  for (const char* system : {"actuator", "thrusters", "inverter"})
    registry.system(system).add(
        solenoid::SolverRow{.name = "plugin_name",
                            .summary = "descent by single changes of a mode",
                            .groups = {"planning"},
                            .make = solenoid::SolverMakers::of_any([](const solenoid::VariantConfig& variant) {
                              return std::make_unique<plugin_name::Descent>(variant);
                            })},
        {{"plugin_name.rounds", 10.0, {1.0, 1000.0}, "", "over all blocks"}});
}
