#include "experiments/profile/profile.hpp"

#include "experiments/base/files.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>

namespace solenoid {
namespace {

constexpr int least_passes = 7, most_passes = 40, settled_over = 3;
constexpr double settled_within = 0.01;
constexpr double least_s = 4.0;        // of measuring: a slow spell of the machine is often longer than a second
constexpr double cheap_pass_us = 5e4;  // such a variant is measured as long as the others are

/// A variant's measurement under way.
struct Course {
  const VariantInstances* variant;
  std::unique_ptr<Replay> replay;
  std::vector<ReplaySample> now;
  std::vector<double> last_us, off_us, on_us;
  std::vector<ReplaySample> best;  // of the passes with phase timing
  std::vector<std::array<double, 4>> history;
  int passes = 0;

  bool settled() const {
    if (passes >= most_passes) return true;
    if (passes < least_passes) return false;
    const auto& now_is = history.back();
    const auto& was = history[history.size() - 1 - settled_over];
    for (std::size_t i = 0; i < now_is.size(); ++i)
      if (was[i] > now_is[i] * (1 + settled_within)) return false;
    return true;
  }
  bool cheap() const { return std::accumulate(last_us.begin(), last_us.end(), 0.0) < cheap_pass_us; }
};

void off_pass(Course& c) {
  c.replay->pass(false, c.now);
  for (std::size_t i = 0; i < c.now.size(); ++i) {
    c.last_us[i] = c.now[i].time_us;
    c.off_us[i] = std::min(c.off_us[i], c.now[i].time_us);
  }
}

void on_pass(Course& c) {
  c.replay->pass(true, c.now);
  for (std::size_t i = 0; i < c.now.size(); ++i) {
    if (c.now[i].time_us >= c.on_us[i]) continue;
    c.on_us[i] = c.now[i].time_us;
    c.best[i] = c.now[i];
  }
}

Percentiles percentiles_of(std::vector<double> sample) { return percentiles(sample); }

/// Off and on in turns, each as often first as second.
void measure_once(Course& c) {
  if (c.passes % 2 == 0)
    off_pass(c), on_pass(c);
  else
    on_pass(c), off_pass(c);
  ++c.passes;
  const Percentiles p = percentiles_of(c.off_us);
  c.history.push_back({p.p50, p.p99, p.p999, percentiles_of(c.on_us).p50});
}

/// The means of the phases, and of what belongs to none.
void split_time(const std::vector<ReplaySample>& samples, VariantProfile& p) {
  const auto count = static_cast<double>(samples.size());
  for (const ReplaySample& s : samples) {
    p.other_us += s.time_us / count;
    for (std::size_t i = 0; i < phase_count; ++i) {
      p.phase_us[i] += s.phase_us[i] / count;
      p.other_us -= s.phase_us[i] / count;
    }
  }
}

std::vector<std::size_t> histogram_of(const std::vector<double>& times_us) {
  std::vector<std::size_t> bins;
  for (const double t : times_us) {
    const auto bin = static_cast<std::size_t>(std::max(0.0, std::floor(5 * std::log10(std::max(t, 1.0)) + 1e-12)));
    if (bin >= bins.size()) bins.resize(bin + 1);
    ++bins[bin];
  }
  return bins;
}

double overhead_percent(const Course& c, double p50_us) {
  std::vector<double> added;
  for (std::size_t i = 0; i < c.off_us.size(); ++i) added.push_back(c.on_us[i] - c.off_us[i]);
  return p50_us > 0 ? 100 * percentiles(added).p50 / p50_us : 0.0;
}

int count_above(const std::vector<double>& times_us, double limit_us) {
  return static_cast<int>(std::count_if(times_us.begin(), times_us.end(), [&](double t) { return t > limit_us; }));
}

VariantProfile conclude(const Course& c, const InstanceSet& set, double limit_ms) {
  VariantProfile p;
  p.name = c.variant->name;
  InstanceSet alone{set.motions, {*c.variant}};
  p.fingerprint = fingerprint(instance_bytes(alone));
  p.passes = c.passes;
  p.solve_us = c.off_us;
  p.misses = count_above(c.off_us, 1e6 * c.variant->config.timing.period_s());
  p.limit_misses = count_above(c.off_us, 1e3 * limit_ms);
  p.histogram = histogram_of(c.off_us);
  p.has_phases = c.replay->has_phases();
  const ControllerCost cost = controller_cost(set, *c.variant);
  p.estimate_us = cost.estimate_us;
  p.prepare_us = cost.prepare_us;
  if (c.best.empty()) return p;
  p.samples = c.best;
  p.solve_nodes.assign(c.replay->nodes().begin(), c.replay->nodes().end());
  split_time(c.best, p);
  p.time_us = percentiles_of(c.off_us);
  p.timed_us = percentiles_of(c.on_us);
  p.overhead_percent = overhead_percent(c, p.time_us.p50);
  p.one_pass_us = percentiles_of(c.last_us);
  p.nodes = percentiles_of({c.replay->nodes().begin(), c.replay->nodes().end()});
  p.plans_as_recorded = c.replay->plans_as_recorded();
  p.proven_fraction = static_cast<double>(c.replay->proven()) / static_cast<double>(c.best.size());
  return p;
}

std::vector<Course> start(const InstanceSet& set, const ProfileOptions& options) {
  const double us_per_tick = measured_us_per_phase_tick();
  std::vector<Course> courses;
  for (const VariantInstances& v : set.variants) {
    Course c{&v, make_replay(set, v, us_per_tick, options.decorate), {}, {}, {}, {}, {}, {}};
    const std::size_t n = v.records.size();
    c.now.resize(n);
    c.best.resize(n);
    c.last_us.resize(n);
    c.off_us.assign(n, 1e300);
    c.on_us.assign(n, 1e300);
    c.replay->pass(false, c.now);  // to warm up
    courses.push_back(std::move(c));
  }
  return courses;
}

/// Round after round over the variants until all have settled, or have had their passes; false if interrupted.
bool measure(std::vector<Course>& courses, const ProfileOptions& options) {
  const auto begin = std::chrono::steady_clock::now();
  const auto long_enough = [&] {
    return std::chrono::steady_clock::now() - begin >= std::chrono::duration<double>(least_s);
  };
  for (int round = 1;; ++round) {
    std::size_t settled = 0;
    for (Course& c : courses) {
      const bool done = options.passes > 0 ? c.passes >= options.passes : c.settled();
      settled += done;
      if (done && (options.passes > 0 || !c.cheap())) continue;
      measure_once(c);
      if (options.interrupted()) return false;
    }
    if (options.progress) options.progress(round, settled, courses.size());
    if (settled == courses.size() && (options.passes > 0 || long_enough())) return true;
  }
}

}  // namespace

double histogram_edge_us(std::size_t i) { return std::pow(10.0, static_cast<double>(i) / 5); }

Profile profile_instances(const InstanceSet& set, const ProfileOptions& options) {
  const PinnedCore pinned(options.core);
  std::vector<Course> courses = start(set, options);
  Profile profile;
  profile.core = pinned.core();
  profile.limit_ms = options.limit_ms;
  if (!set.variants.empty()) profile.period_ms = 1e3 * set.variants.front().config.timing.period_s();
  profile.interrupted = !measure(courses, options);
  HardwareCounters counters;
  profile.counters_missing = counters.reason();
  for (Course& c : courses) {
    if (c.passes == 0) continue;
    VariantProfile p = conclude(c, set, options.limit_ms);
    if (counters.available()) {
      counters.start();
      c.replay->pass(false, c.now);
      p.counters = counters.stop();
    }
    profile.variants.push_back(std::move(p));
  }
  return profile;
}

}  // namespace solenoid
