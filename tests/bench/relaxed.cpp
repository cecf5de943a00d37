// The relaxed and the rounded variants in closed loop on the scenarios of the default campaign, in this process, on a
// fake clock: how long a cycle that plans takes, and how well the loop does. A time is the processor's for the whole
// controller step, once: on a busy machine what the thread was kept waiting does not count.
//
//     bench_relaxed [--seconds S] [--no-deadline] [VARIANT ...]
#include "controllers/factory.hpp"
#include "core/config/reader.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "core/systems/actuator/metrics.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/campaign/scenario.hpp"
#include "experiments/campaign/simulated_system.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <time.h>

namespace {

using namespace solenoid;

struct Options {
  double seconds = 2.0;  ///< of each scenario
  bool deadline = true;
  std::vector<std::string> variants;
};

Options read_options(int count, char** words) {
  Options options;
  for (int i = 1; i < count; ++i) {
    const std::string word = words[i];
    if (word == "--seconds" && i + 1 < count)
      options.seconds = std::atof(words[++i]);
    else if (word == "--no-deadline")
      options.deadline = false;
    else
      options.variants.push_back(word);
  }
  if (options.variants.empty()) options.variants = {"relaxed_pwm", "joint_relaxed", "sum_up_rounding", "cia", "joint"};
  return options;
}

TableReader shipped(const std::string& file) {
  return TableReader::from_file(SOLENOID_SOURCE_DIR "/experiments/systems/actuator/data/scenarios/" + file);
}

std::vector<ScenarioConfig> scenarios(double seconds) {
  TableReader campaign = shipped("default.toml");
  std::vector<ScenarioConfig> all;
  for (TableReader& table : campaign.tables("scenario")) {
    all.push_back(read_scenario(table));
    all.back().duration_s = std::min(all.back().duration_s, seconds);
  }
  return all;
}

double quantile(const std::vector<double>& sorted, double q) {
  return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
}

double thread_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

/// Writes the processor time of a step into the report of each that planned.
class TimedController final : public Controller {
 public:
  explicit TimedController(std::unique_ptr<Controller> inner) : inner_(std::move(inner)) {}
  Decision step(const Measurement& sensors) noexcept override {
    const double begin = thread_us();
    Decision d = inner_->step(sensors);
    d.report.time_us = thread_us() - begin;
    return d;
  }
  void applied(const Command& command) noexcept override { inner_->applied(command); }
  void restart(double time_s, const AxisValues& from) noexcept override { inner_->restart(time_s, from); }

 private:
  std::unique_ptr<Controller> inner_;
};

struct Run {
  std::vector<TickRecord> ticks;
  double rmse_mm = 0.0;
};

Run run(const VariantConfig& variant, const ScenarioConfig& scenario) {
  const auto plant = make_plant(variant, scenario, 1);
  TimedController controller(make_controller(variant, scenario.trajectory));
  CommandLimits limits = make_limits(variant);
  const auto ticks = static_cast<std::int64_t>(std::llround(scenario.duration_s / actuator_timing.tick_s));
  MemoryRecorder recorder(static_cast<std::size_t>(ticks));
  FakeClock clock;
  ControlLoop loop(*plant, clock, controller, limits, recorder);
  loop.run(ticks, actuator_timing.tick_s);
  const Metrics metrics = evaluate_actuator_run(recorder.records(), scenario.trajectory, actuator_timing.tick_s, {},
                                                1e6 * actuator_timing.period_s());
  return {recorder.records(), metrics["rmse_mm"]};
}

/// Solves of one variant.
struct Solves {
  std::vector<double> us, nodes;
  std::vector<double> rmse_mm;  ///< of each scenario
  int stopped = 0;              ///< by the deadline

  void add(const Run& run) {
    for (const TickRecord& tick : run.ticks) {
      if (!tick.decision.solved) continue;
      us.push_back(tick.decision.report.time_us);
      nodes.push_back(static_cast<double>(tick.decision.report.nodes));
      stopped += tick.decision.report.status == Status::deadline_reached;
    }
    rmse_mm.push_back(run.rmse_mm);
  }

  void print(const std::string& name) {
    std::sort(us.begin(), us.end());
    std::sort(nodes.begin(), nodes.end());
    std::printf("%-16s %6zu %8.0f %8.0f %8.0f %8.0f %7d %7.0f %7.0f  ", name.c_str(), us.size(), quantile(us, 0.5),
                quantile(us, 0.99), quantile(us, 0.999), us.back(), stopped, quantile(nodes, 0.5),
                quantile(nodes, 0.99));
    for (const double mm : rmse_mm) std::printf(" %6.4f", mm);
    std::printf("\n");
    std::fflush(stdout);
  }
};

}  // namespace

int main(int count, char** words) {
  const Options options = read_options(count, words);
  TableReader all = shipped("variants.toml").table("variant");
  std::printf("%-16s %6s %8s %8s %8s %8s %7s %7s %7s   rmse of each scenario [mm]\n", "variant", "solves", "p50 us",
              "p99", "p99.9", "max", "stopped", "nodes50", "nodes99");
  for (const std::string& name : options.variants) {
    TableReader table = all.table(name);
    VariantConfig variant = read_variant(table, name);
    if (!options.deadline) variant.deadline_ms.reset();
    Solves solves;
    for (const ScenarioConfig& scenario : scenarios(options.seconds)) solves.add(run(variant, scenario));
    solves.print(name);
  }
}
