#include "experiments/systems/actuator/twin/valve_travel.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace solenoid {
ValveActuation::ValveActuation(const ModeSet& modes, const ValveTravel& travel, std::uint64_t seed)
    : travel_(travel), random_(seed) {
  for (const Switch& s : modes.switches()) {
    Coil& coil = coil_[coils_++];
    coil.dead_rise_s = std::max(0.0, s.rise_delay_s - travel.rise_s / 2);
    coil.dead_fall_s = std::max(0.0, s.fall_delay_s - travel.fall_s / 2);
  }
}

double ValveActuation::jitter() noexcept {
  if (travel_.jitter_sigma_s == 0.0) return 0.0;
  return travel_.jitter_sigma_s * std::clamp(normal_(random_), -2.0, 2.0);
}

void ValveActuation::command(SwitchPattern pattern, double time_s) noexcept {
  settle(time_s);
  for (std::size_t c = 0; c < coils_; ++c) {
    if (((pattern ^ commanded_) >> c & 1u) == 0) continue;
    Coil& coil = coil_[c];
    const bool on = pattern >> c & 1u;
    const double late = coil.fault.kind == SwitchFaultKind::slow ? coil.fault.value : 0.0;
    const double start = time_s + late + std::max(0.0, (on ? coil.dead_rise_s : coil.dead_fall_s) + jitter());
    while (coil.count > 0 && coil.pending[coil.count - 1].start_s >= start) --coil.count;
    if (coil.count < coil.pending.size()) coil.pending[coil.count++] = {start, on};
  }
  commanded_ = pattern;
}

double ValveActuation::moved(double base, bool on, double elapsed_s) const noexcept {
  const double travel = on ? travel_.rise_s : travel_.fall_s;
  if (elapsed_s <= 0.0) return base;
  if (elapsed_s >= travel) return on ? 1.0 : 0.0;
  return std::clamp(base + (on ? elapsed_s : -elapsed_s) / travel, 0.0, 1.0);
}

double ValveActuation::settled_at(double base, bool on, double since_s) const noexcept {
  return since_s + (on ? (1.0 - base) * travel_.rise_s : base * travel_.fall_s);
}

void ValveActuation::settle(double time_s) noexcept {
  for (std::size_t c = 0; c < coils_; ++c) {
    Coil& coil = coil_[c];
    std::size_t started = 0;
    while (started < coil.count && coil.pending[started].start_s <= time_s) {
      const Edge edge = coil.pending[started++];
      coil.base = moved(coil.base, coil.on, edge.start_s - coil.since_s);
      coil.since_s = edge.start_s;
      coil.on = edge.on;
    }
    std::copy(coil.pending.begin() + static_cast<std::ptrdiff_t>(started),
              coil.pending.begin() + static_cast<std::ptrdiff_t>(coil.count), coil.pending.begin());
    coil.count -= started;
  }
}

void ValveActuation::fail(std::size_t c, const SwitchFault& fault, double time_s) noexcept {
  settle(time_s);
  if (c < coils_) coil_[c].fault = fault;
}

double ValveActuation::opening(std::size_t c, double time_s) const noexcept {
  return coil_[c].fault.opening(sound_opening(c, time_s));
}

double ValveActuation::mean_opening(std::size_t c, double from_s, double to_s) const noexcept {
  return coil_[c].fault.opening(sound_mean_opening(c, from_s, to_s));
}

double ValveActuation::sound_opening(std::size_t c, double time_s) const noexcept {
  const Coil& coil = coil_[c];
  double base = coil.base, since = coil.since_s;
  bool on = coil.on;
  for (std::size_t i = 0; i < coil.count && coil.pending[i].start_s <= time_s; ++i) {
    base = moved(base, on, coil.pending[i].start_s - since);
    since = coil.pending[i].start_s;
    on = coil.pending[i].on;
  }
  // At the very moment of an edge without travel the valve is already there.
  if ((on ? travel_.rise_s : travel_.fall_s) == 0.0) return on ? 1.0 : 0.0;
  return moved(base, on, time_s - since);
}

double ValveActuation::sound_mean_opening(std::size_t c, double from_s, double to_s) const noexcept {
  const Coil& coil = coil_[c];
  double base = coil.base, since = coil.since_s, sum = 0.0;
  bool on = coil.on;
  // Over each edge's reign [begin, end] the opening is a ramp, then constant: integrate both pieces exactly.
  for (std::size_t i = 0; i <= coil.count; ++i) {
    const double next = i < coil.count ? coil.pending[i].start_s : std::numeric_limits<double>::infinity();
    const double begin = std::max(from_s, since), end = std::min(to_s, next);
    if (end > begin) {
      const double flat = std::clamp(settled_at(base, on, since), begin, end);
      sum += (flat - begin) * 0.5 * (moved(base, on, begin - since) + moved(base, on, flat - since));
      sum += (end - flat) * (on ? 1.0 : 0.0);
    }
    if (next >= to_s) break;
    base = moved(base, on, next - since);
    since = next;
    on = coil.pending[i].on;
  }
  return sum / (to_s - from_s);
}

double ValveActuation::next_kink(double time_s) const noexcept {
  double next = std::numeric_limits<double>::infinity();
  const auto consider = [&](double moment) {
    if (moment > time_s) next = std::min(next, moment);
  };
  for (std::size_t c = 0; c < coils_; ++c) {
    const Coil& coil = coil_[c];
    consider(settled_at(coil.base, coil.on, coil.since_s));
    for (std::size_t i = 0; i < coil.count; ++i) consider(coil.pending[i].start_s);
  }
  return next;
}

}  // namespace solenoid
