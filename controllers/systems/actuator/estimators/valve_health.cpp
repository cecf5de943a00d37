#include "controllers/systems/actuator/estimators/valve_health.hpp"

#include <algorithm>
#include <cmath>

namespace solenoid {
namespace {

constexpr double position_share = 0.5;  // of a new position: the potentiometer's noise is not the slide's motion
constexpr double fit_share = 1.0 / 15;  // of a new innovation in the mean
constexpr double hopeless_fit = 50.0;
constexpr int forgotten_after = 60;   // ticks of equal openings: the pressure filter has forgotten the difference
constexpr double flows_equal = 0.05;  // factors of flow so near each other are one belief
constexpr double rail_pa = 100.0;     // so near its end a sensor says no more
constexpr std::int64_t most_missed = 2 * max_delay_steps;  // by then every command in flight has arrived

/// Delays of coils that are all slow.
SwitchTiming slowed(SwitchTiming timing, int ticks) {
  for (std::size_t c = 0; c < max_switches; ++c) {
    timing.rise[c] = std::min(timing.rise[c] + ticks, max_delay_steps);
    timing.fall[c] = std::min(timing.fall[c] + ticks, max_delay_steps);
  }
  return timing;
}

std::array<SwitchFault, 4> faults_of(const HealthTuning& tuning) {
  return {SwitchFault{SwitchFaultKind::stuck_on}, SwitchFault{SwitchFaultKind::stuck_off},
          SwitchFault{SwitchFaultKind::leaking, tuning.leaking_share},
          SwitchFault{SwitchFaultKind::slow, tuning.late_s}};
}

/// Whether two filters believe the same of how much flows.
bool same_flows(const ChamberFilter& a, const ChamberFilter& b) {
  const auto apart = [&](int i) { return std::abs(a.mean()[i] - b.mean()[i]); };
  return std::max(apart(ChamberFilter::fill_factor), apart(ChamberFilter::exhaust_factor)) < flows_equal;
}

bool on(SwitchPattern pattern, std::size_t c) { return ((pattern >> c) & 1u) != 0; }

}  // namespace

ValveHealth::ValveHealth(const PneumaticActuator& model, const ModeSet& modes, const HealthTuning& tuning)
    : tuning_(tuning),
      coils_(modes.switches().size()),
      timing_(modes, tuning.tick_s),
      slow_timing_(slowed(timing_, static_cast<int>(std::lround(tuning.late_s / tuning.tick_s)))),
      lines_(modes.safe_pattern()),
      slow_lines_(lines_),
      in_effect_(modes.safe_pattern()),
      slow_in_effect_(in_effect_),
      before_(in_effect_),
      slow_before_(in_effect_),
      command_(in_effect_) {
  std::ranges::copy(modes.offset(), offset_.begin());
  for (const bool b : {false, true}) chambers_.push_back({ChamberFilter::Chamber(model, tuning, b), {}, {}});
  for (std::size_t c = 0; c < coils_; ++c) {
    std::ranges::copy(modes.gain(c), gain_[c].begin());
    const std::size_t chamber = gain_[c][fill_b] != 0.0 || gain_[c][exhaust_b] != 0.0 ? 1 : 0;
    for (const SwitchFault& fault : faults_of(tuning))
      for (int copy = 0; copy < tuning.copies; ++copy)
        chambers_[chamber].hypotheses.push_back({.c = c, .fault = fault});
  }
}

std::vector<FailedSwitch> ValveHealth::findable(const ModeSet& modes, const HealthTuning& tuning) {
  std::vector<FailedSwitch> all;
  for (std::size_t c = 0; c < modes.switches().size(); ++c)
    for (const SwitchFault& fault : faults_of(tuning)) all.push_back({c, fault});
  return all;
}

std::optional<FailedSwitch> ValveHealth::update(const Measurement& measured) noexcept {
  const double pressure[] = {measured.value[pressure_a_channel], measured.value[pressure_b_channel]};
  double to = measured.value[position_channel];
  const std::int64_t ticks = started_ ? std::llround((measured.time_s - last_time_s_) / tuning_.tick_s) : 1;
  last_time_s_ = measured.time_s;
  started_ = true;
  const bool whole = std::isfinite(to) && std::isfinite(pressure[0]) && std::isfinite(pressure[1]);
  for (std::int64_t k = 0; k < std::clamp<std::int64_t>(ticks, 1, most_missed); ++k) pass_tick();
  if (!whole || ticks != 1 || measured.node_was_safe) blind_ = true;
  if (blind_) {
    if (whole) begin_anew(pressure, to);
    return {};
  }
  quiet_ticks_ = std::max(0, quiet_ticks_ - 1);
  to = position_m_ + position_share * (to - position_m_);
  for (std::size_t i = 0; i < 2; ++i) predict(i, position_m_, to);
  position_m_ = to;
  for (std::size_t i = 0; i < 2; ++i)
    if (pressure[i] > tuning_.pressure_low_pa + rail_pa && pressure[i] < tuning_.pressure_high_pa - rail_pa)
      correct(chambers_[i], pressure[i]);
  return decide();
}

/// What acted on the plant in the ticks behind is not known: every chamber from what is measured now, and no hypothesis until commands
/// from before and the pressure filter have died away.
void ValveHealth::begin_anew(std::span<const double, 2> pressure_pa, double position_m) noexcept {
  for (std::size_t i = 0; i < 2; ++i) {
    chambers_[i].sound.start(chambers_[i].constants, pressure_pa[i]);
    chambers_[i].accused = 0.0;
    for (Hypothesis& h : chambers_[i].hypotheses) h.alive = false;
  }
  position_m_ = position_m;
  quiet_ticks_ = static_cast<int>(std::lround(tuning_.quiet_s / tuning_.tick_s));
  blind_ = false;
}

/// The command of the last tick, and what of it and of those before is in effect until this one.
void ValveHealth::pass_tick() noexcept {
  before_ = in_effect_;
  slow_before_ = slow_in_effect_;
  lines_.command(command_, timing_);
  slow_lines_.command(command_, slow_timing_);
  in_effect_ = lines_.effective();
  slow_in_effect_ = slow_lines_.effective();
  lines_.advance(1);
  slow_lines_.advance(1);
}

/// The state of coil c over the tick under a fault, and its edge times the delay by which it came.
double ValveHealth::state_of(std::size_t c, const SwitchFault& fault, double& edge) const noexcept {
  const bool slow = fault.kind == SwitchFaultKind::slow;
  const SwitchTiming& timing = slow ? slow_timing_ : timing_;
  const bool is = on(slow ? slow_in_effect_ : in_effect_, c), was = on(slow ? slow_before_ : before_, c);
  const double open = fault.opening(is ? 1.0 : 0.0);
  edge = (open - fault.opening(was ? 1.0 : 0.0)) * (is ? timing.rise[c] : timing.fall[c]);
  return open;
}

PathOpenings ValveHealth::openings(std::size_t chamber, const Hypothesis* hypothesis) const noexcept {
  const std::size_t fill = 2 * chamber, exhaust = fill + 1;
  PathOpenings sum{offset_[fill], offset_[exhaust], 0.0, 0.0};
  for (std::size_t c = 0; c < coils_; ++c) {
    if (gain_[c][fill] == 0.0 && gain_[c][exhaust] == 0.0) continue;
    double edge = 0.0;
    const double open = state_of(c, hypothesis && hypothesis->c == c ? hypothesis->fault : failed_[c], edge);
    sum.fill += gain_[c][fill] * open;
    sum.exhaust += gain_[c][exhaust] * open;
    sum.fill_edges += gain_[c][fill] * edge;
    sum.exhaust_edges += gain_[c][exhaust] * edge;
  }
  return sum;
}

void ValveHealth::predict(std::size_t i, double from_m, double to_m) noexcept {
  Chamber& chamber = chambers_[i];
  const ChamberFilter::Chamber& constants = chamber.constants;
  const double from = constants.length(from_m), to = constants.length(to_m);
  const PathOpenings sound = openings(i, nullptr);
  for (Hypothesis& h : chamber.hypotheses) {
    if (failed_[h.c].kind != SwitchFaultKind::none) continue;
    h.open = openings(i, &h);
    const bool equal = h.open == sound;
    ++h.age;
    if (!h.alive && !equal && quiet_ticks_ == 0) begin(chamber, h, sound, from);
    h.equal = equal ? h.equal + 1 : 0;
  }
  for (Hypothesis& h : chamber.hypotheses)
    if (h.alive) h.filter.predict(constants, h.open, from, to);
  chamber.sound.predict(constants, sound, from, to);
}

/// Begins a hypothesis from what is believed so far: that every valve is sound, or, with its evidence, another fault of the
/// chamber. Copies of one hypothesis begin some ticks apart, because nobody knows when the fault did.
void ValveHealth::begin(Chamber& chamber, Hypothesis& h, const PathOpenings& sound, double length_m) noexcept {
  int youngest = tuning_.apart_ticks;
  const Hypothesis* parent = nullptr;
  for (const Hypothesis& other : chamber.hypotheses) {
    if (!other.alive) continue;
    if (other.c == h.c && other.fault == h.fault)
      youngest = std::min(youngest, other.age);
    else if (other.fit < tuning_.worst_fit && other.score > tuning_.change && (!parent || other.score > parent->score))
      parent = &other;
  }
  if (youngest < tuning_.apart_ticks) return;
  h.filter = parent ? parent->filter : chamber.sound;
  h.score = parent ? parent->score - tuning_.change : 0.0;
  h.fit = 1.0;
  h.age = h.above = 0;
  h.onsets = 1 + h.equal;
  h.alive = true;
  // It may have begun a little earlier or later; a uniform deviate over the gap has this variance.
  const double parted = std::max(std::abs(h.open.fill - sound.fill), std::abs(h.open.exhaust - sound.exhaust));
  const double per_tick = tuning_.tick_s * chamber.constants.heating * chamber.constants.choked / length_m * parted;
  const double gap = tuning_.apart_ticks * per_tick;
  h.filter.doubt_pressure(gap * gap / 12.0);
}

void ValveHealth::correct(Chamber& chamber, double measured_pa) noexcept {
  const double fade = std::exp(-tuning_.tick_s / tuning_.memory_s);
  const auto sound = chamber.sound.correct(chamber.constants, measured_pa);
  for (Hypothesis& h : chamber.hypotheses) {
    if (!h.alive) continue;
    const auto own = h.filter.correct(chamber.constants, measured_pa);
    // A hypothesis gains by being nearer to the data, not by being surer of itself: the sound filter allows for more than happens
    // while nothing flows.
    const double nearer = std::min(sound.squared, tuning_.clip) - std::min(own.squared, tuning_.clip);
    h.score += 0.5 * (nearer - std::max(0.0, std::log(own.variance / sound.variance))) - tuning_.drift;
    h.fit += fit_share * (own.squared - h.fit);
    if (h.equal > 0) h.score *= fade;
    h.above = above_threshold(h) > 0.0 ? h.above + 1 : 0;
    // While a valve that does not open passed for weak flow, its hypothesis alone kept the flow that the others have.
    const bool merged = h.equal > forgotten_after && h.score < 1.0 && same_flows(h.filter, chamber.sound);
    if (h.score < tuning_.floor || merged || h.fit > hopeless_fit) h.alive = false;
  }
  // What another fault explains far better begins anew, from that one.
  for (Hypothesis& h : chamber.hypotheses)
    for (const Hypothesis& other : chamber.hypotheses)
      if (h.alive && other.alive && other.fit < tuning_.worst_fit && other.score > h.score + tuning_.beaten)
        h.alive = false;
  chamber.accused *= std::exp(-tuning_.tick_s / tuning_.accused_memory_s);
  for (const Hypothesis& h : chamber.hypotheses)
    if (h.alive) chamber.accused = std::max(chamber.accused, h.score);
}

double ValveHealth::above_threshold(const Hypothesis& h) const noexcept {
  const bool stuck = h.fault.kind == SwitchFaultKind::stuck_on || h.fault.kind == SwitchFaultKind::stuck_off;
  return h.score - (stuck ? tuning_.stuck_threshold : tuning_.other_threshold);
}

bool ValveHealth::doubts() const noexcept {
  if (blind_) return false;
  for (const Chamber& chamber : chambers_)
    for (const Hypothesis& h : chamber.hypotheses)
      if (h.alive && h.fit <= tuning_.worst_fit && h.score > tuning_.doubt) return true;
  return false;
}

/// How far a hypothesis is above its threshold, and with the onsets that would have looked the same.
double ValveHealth::standing(const Hypothesis& h) const noexcept {
  return above_threshold(h) + std::log(static_cast<double>(h.onsets));
}

std::optional<FailedSwitch> ValveHealth::decide() noexcept {
  Hypothesis* best = nullptr;
  const auto explains = [&](const Hypothesis& h) { return h.alive && h.fit <= tuning_.worst_fit; };
  for (Chamber& chamber : chambers_)
    for (Hypothesis& h : chamber.hypotheses)
      if (explains(h) && above_threshold(h) > 0.0 && (!best || standing(h) > standing(*best))) best = &h;
  // A coil touches one chamber: what disturbs both, a wrong position or a command that did not arrive, is none.
  if (!best || std::min(chambers_[0].accused, chambers_[1].accused) > tuning_.doubt) return {};
  bool clear = true;
  for (const Chamber& chamber : chambers_)
    for (const Hypothesis& h : chamber.hypotheses)
      if (explains(h) && (h.c != best->c || h.fault != best->fault))
        clear = clear && standing(*best) - standing(h) > tuning_.margin;
  if (!clear && best->above * tuning_.tick_s < tuning_.patience_s) return {};
  failed_[best->c] = best->fault;
  for (Chamber& chamber : chambers_) {
    const bool own = best >= chamber.hypotheses.data() && best < chamber.hypotheses.data() + chamber.hypotheses.size();
    if (own) chamber.sound = best->filter;
    for (Hypothesis& h : chamber.hypotheses) h.alive = h.alive && !own;
  }
  return FailedSwitch{best->c, best->fault};
}

}  // namespace solenoid
