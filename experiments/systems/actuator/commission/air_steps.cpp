#include "core/rt/clock.hpp"
#include "core/systems/actuator/signals.hpp"
#include "core/systems/actuator/valves.hpp"
#include "experiments/systems/actuator/commission/steps.hpp"
#include "experiments/systems/actuator/twin/twin_plant.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double kilo = 1e3;
constexpr const char* chamber_name[] = {"A", "B"};

/// Gauge pressures that a chamber has to have before the coil that lets it out is tried, and that tell a leak.
constexpr double well_charged_pa = 8e3, kept_pa = 3.5e3;
/// It has to keep so much of its air for so long.
constexpr double kept_share = 0.6, kept_s = 0.25;

bool needs_wiring(const CommissionState& state, StepOutcome& out) {
  if (state.wiring_is_known) return false;
  out.verdict = StepVerdict::skipped;
  out.note = "step coils has not passed";
  return true;
}

/// Opens what lets chambers out, the slide held, until both read as little as `to_pa` above the atmosphere.
void vent(CommissionState& state, SwitchPattern coils, double longest_s = 1.0) {
  constexpr double enough_pa = 2e3;
  const double atmosphere = state.nominal.atmospheric_pressure_pa;
  double centre_m = 0.0;
  state.bench.play(
      longest_s, {.travel_m = 0.05, .pressure_pa = std::numeric_limits<double>::infinity()},
      [&](const BenchSample& s) {
        if (s.time_s == 0.0) centre_m = s.slow_position_m;
        return actuator_command(coils, hold_force_n(state, s, centre_m));
      },
      [&](const BenchSample& s) {
        return s.time_s > 0.1 && std::max(s.pressure_pa[0], s.pressure_pa[1]) < atmosphere + enough_pa;
      });
}

/// Of a chamber's air, from the means of two moments: what a pressure would be if the slide had stayed.
double share_left(const CommissionState& state, const BenchMean& first, const BenchMean& last, std::size_t k) {
  const ActuatorParameters& p = state.nominal;
  const auto air = [&](const BenchMean& m) {
    const double column = k == 0 ? p.dead_length_a_m + m.position_m : p.dead_length_b_m - m.position_m;
    return m.pressure_pa[k] * column;
  };
  const double column = k == 0 ? p.dead_length_a_m + first.position_m : p.dead_length_b_m - first.position_m;
  const double outside = p.atmospheric_pressure_pa * column;
  return (air(last) - outside) / (air(first) - outside);
}

/// What a coil did, and the most that a pressure changed.
struct Tried {
  Response response;
  double most_pa = 0.0;
  bool evened = false;  ///< what changed came nearer to the atmosphere
  BenchMean before;     ///< its last pulse
};

/// How much of a change counts, and how long a coil is on: ever longer, until it shows.
struct Trial {
  std::vector<double> lengths_s;
  double pressure_pa = 6e3;
  bool wait_for_motion = true;
};

/// What the samples of one pulse show against what was before: the first pressure that changes so far says which, and
/// whatever follows from the motion comes later.
void judge(const std::vector<BenchSample>& samples, const BenchMean& before, double threshold_pa, double atmosphere_pa,
           Tried& tried) {
  constexpr double seen_m = 0.4e-3, squeezes_m = 1e-3, shared = 0.5;
  bool squeezed = false;
  for (const BenchSample& s : samples) {
    std::array<double, 2> change{s.pressure_pa[0] - before.pressure_pa[0], s.pressure_pa[1] - before.pressure_pa[1]};
    const double most = std::max(std::abs(change[0]), std::abs(change[1]));
    tried.most_pa = std::max(tried.most_pa, most);
    const double moved = s.slow_position_m - before.position_m;
    squeezed = squeezed || std::abs(moved) >= squeezes_m;
    if (!tried.response.pressure[0] && !squeezed && most >= threshold_pa) {
      const std::size_t first = std::abs(change[0]) >= std::abs(change[1]) ? 0 : 1;
      tried.evened =
          std::abs(s.pressure_pa[first] - atmosphere_pa) < std::abs(before.pressure_pa[first] - atmosphere_pa);
      for (const std::size_t k : {0u, 1u})
        tried.response.pressure[k] = std::abs(change[k]) < shared * most ? 0 : change[k] > 0 ? 1 : -1;
    }
    if (!tried.response.position && std::abs(moved) >= seen_m) tried.response.position = moved > 0 ? 1 : -1;
  }
}

/// A slide at an end leaves a chamber so little room that it is full at once: the supply's pressure is no fault, a
/// slide that runs away is.
BenchGuard coil_guard(const CommissionState& state) {
  return {.travel_m = 0.025, .pressure_pa = state.nominal.supply_pressure_pa + 30e3};
}

/// Tries a coil alone. Nothing holds the slide while it is watched; it is caught afterwards.
Tried try_coil(CommissionState& state, SwitchPattern coil, const Trial& trial) {
  constexpr double watched_s = 0.2;
  const BenchGuard guard = coil_guard(state);
  Tried tried;
  for (const double length_s : trial.lengths_s) {
    let_rest(state, 0, guard);
    const BenchMean before = mean_of(state.bench.play(0.05, guard, [](const BenchSample&) { return Command{}; }), 5);
    const auto samples = state.bench.play(
        length_s + watched_s, guard,
        [&](const BenchSample& s) {
          return actuator_command(s.time_s < length_s - 0.5 * state.bench.tick_s() ? coil : 0, 0.0);
        },
        [&](const BenchSample& s) { return std::abs(s.slow_position_m - before.position_m) > 2e-3; });
    Tried now;
    judge(samples, before, trial.pressure_pa, state.nominal.atmospheric_pressure_pa, now);
    now.before = before;
    const bool pressure = now.response.pressure[0].has_value();
    if (pressure || !tried.response.pressure[0]) tried = now;
    if (pressure && (now.response.position || !trial.wait_for_motion)) break;
  }
  let_rest(state, 0, guard);
  Response& r = tried.response;
  if (!r.pressure[0]) r.pressure = {0, 0};
  if (!r.position && trial.wait_for_motion) r.position = 0;
  return tried;
}

std::string shown(const Response& r) {
  const auto text = [](Answer a) { return !a ? "?" : *a > 0 ? "rises" : *a < 0 ? "falls" : "stays"; };
  return fmt::format("position {}, pressure A {}, pressure B {}", text(r.position), text(r.pressure[0]),
                     text(r.pressure[1]));
}

void add(StepOutcome& out, const std::string& coil, const Response& r) {
  const auto number = [](Answer a) { return a ? static_cast<double>(*a) : std::numeric_limits<double>::quiet_NaN(); };
  for (const auto& [what, answer] : {std::pair{"position", r.position}, std::pair{"pressure_a", r.pressure[0]},
                                     std::pair{"pressure_b", r.pressure[1]}})
    if (answer) out.measured.push_back({coil + "_" + what, number(answer), ""});
  out.note += fmt::format("{}{}: {}", out.note.empty() ? "" : "; ", coil, shown(r));
}

/// The two coils of a chamber: one fills it, the other lets out what the first one left.
void try_chamber(CommissionState& state, StepOutcome& out, std::size_t k) {
  const CoilPatterns coils(false);
  const BenchGuard guard = coil_guard(state);
  const Tried supply = try_coil(state, coils.fill(k), {{0.010, 0.014, 0.020}});
  const double atmosphere = state.nominal.atmospheric_pressure_pa;
  const bool answered = supply.response != Response{0, {0, 0}};
  const bool filled = supply.response.pressure != std::array<Answer, 2>{0, 0};
  // The pressure that rose, whichever it is called.
  const std::size_t rose = supply.response.pressure[0].value_or(0) != 0 ? 0 : 1;
  const auto now = [&] {
    return mean_of(state.bench.play(0.05, guard, [](const BenchSample&) { return Command{}; }), 5);
  };
  const auto gauge = [&](const BenchMean& mean) { return std::abs(mean.pressure_pa[rose] - atmosphere); };
  BenchMean charged = now();
  if (filled && gauge(charged) < well_charged_pa) {
    state.bench.play(0.1, guard, [&](const BenchSample& s) {
      return actuator_command(s.time_s < 0.0135 ? coils.fill(k) : 0, hold_force_n(state, s, s.slow_position_m));
    });
    let_rest(state, 0, guard);
    charged = now();
  }
  // What has been let in may leave by a leak before the other coil is tried: then that shows nothing of it.
  double left = 1.0;
  if (filled) {
    state.bench.play(kept_s, guard, [](const BenchSample&) { return Command{}; });
    left = gauge(charged) > kept_pa ? share_left(state, charged, now(), rose) : 0.0;
  }
  const bool kept = left > kept_share;
  Tried exhaust;
  if (kept) exhaust = try_coil(state, coils.exhaust(k), {{0.014, 0.030, 0.060, 0.080}, 2.5e3, !answered});
  // A slide that was moved while a chamber was shut left a little in it: to let that out is not to fill.
  if (!answered && exhaust.evened) exhaust.response = {0, {0, 0}};
  if (answered && !filled) exhaust.response = {};   // a sensor that shows nothing: what is seen is the slide's doing
  if (answered) exhaust.response.position.reset();  // friction may keep it where it is
  // A slower leak has emptied it while the coil was tried.
  const bool emptied =
      kept && filled && exhaust.response.pressure == std::array<Answer, 2>{0, 0} && gauge(exhaust.before) < kept_pa;
  if (emptied) exhaust.response = {};
  if (!kept || emptied)
    out.findings.push_back(fmt::format("chamber {} leaks: it does not keep {:.0f} kPa for a second", chamber_name[k],
                                       std::max(gauge(charged), supply.most_pa) / kilo));
  const std::string name = k == 0 ? "a" : "b";
  add(out, "supply_" + name, supply.response);
  add(out, "exhaust_" + name, exhaust.response);
  state.seen.coils.push_back(supply.response);
  state.seen.coils.push_back(exhaust.response);
  const bool turned_round = !answered && exhaust.response != Response{0, {0, 0}};
  vent(state, turned_round ? coils.fill(k) : kept ? coils.exhaust(k) : 0, 0.6);
}

/// Both chambers filled by the same pulses to about `to_pa` gauge, the slide held.
void charge(CommissionState& state, double to_pa, double& centre_m) {
  constexpr int most_pulses = 12;
  constexpr double pulse_s = 0.010, gap_s = 0.050;
  const CoilPatterns coils(state.three_way);
  const double atmosphere = state.nominal.atmospheric_pressure_pa;
  const BenchGuard guard{.travel_m = 0.025, .pressure_pa = atmosphere + 3 * to_pa};
  bool there = false;
  for (int i = 0; i < most_pulses && !there; ++i) {
    const auto samples = state.bench.play(pulse_s + gap_s, guard, [&](const BenchSample& s) {
      if (i == 0 && s.time_s == 0.0) centre_m = s.slow_position_m;
      return actuator_command(s.time_s < pulse_s - 0.5 * state.bench.tick_s() ? coils.fill_both() : 0,
                              hold_force_n(state, s, centre_m));
    });
    const BenchMean now = mean_of(samples, samples.size() - std::min<std::size_t>(samples.size(), 10));
    there = std::min(now.pressure_pa[0], now.pressure_pa[1]) > atmosphere + to_pa;
  }
}

/// When a pulse shows, how much it raises the pressure, of a short and of a longer one.
struct PulseSeen {
  double shown_s = 0.0, short_pa = 0.0, long_pa = 0.0;
  /// The length of a pulse that would raise nothing: opening later than closing takes it away.
  double dead_s(double short_s, double long_s) const {
    return short_s - short_pa * (long_s - short_s) / (long_pa - short_pa);
  }
};
constexpr double short_pulse_s = 0.010, long_pulse_s = 0.018;

PulseSeen see_pulses(CommissionState& state, std::size_t k) {
  constexpr int repeats = 3;
  constexpr double shown_pa = 3e3, watched_s = 0.06;
  const CoilPatterns coils(state.three_way);
  const BenchGuard guard{.travel_m = 0.03, .pressure_pa = 101325.0 + 140e3};
  PulseSeen seen;
  for (int i = 0; i < 2 * repeats; ++i) {
    const bool longer = i % 2 == 1;
    vent(state, coils.exhaust_both(), 0.6);
    let_rest(state, coils.exhaust_both(), guard);
    const auto still = state.bench.play(0.06, guard, [&](const BenchSample&) { return Command{}; });
    const BenchMean before = mean_of(still, 5);
    const double length_s = longer ? long_pulse_s : short_pulse_s;
    const auto samples = state.bench.play(length_s + watched_s, guard, [&](const BenchSample& s) {
      return actuator_command(s.time_s < length_s - 0.5 * state.bench.tick_s() ? coils.fill(k) : 0,
                              hold_force_n(state, s, before.position_m));
    });
    double most = 0.0, last = 0.0, shown_s = -1.0;
    for (const BenchSample& s : samples) {
      const double raised = s.pressure_pa[k] - before.pressure_pa[k];
      if (shown_s < 0.0 && raised >= shown_pa)
        shown_s = s.time_s - state.bench.tick_s() * (raised - shown_pa) / std::max(raised - last, 1.0);
      last = raised;
      most = std::max(most, raised);
    }
    (longer ? seen.long_pa : seen.short_pa) += most / repeats;
    seen.shown_s += shown_s / (2 * repeats);
  }
  vent(state, coils.exhaust_both(), 0.6);
  return seen;
}

/// The same on the nominal twin, which stands where the slide does.
PulseSeen expected_pulses(const CommissionState& state, double position_m, std::size_t k) {
  const std::string valves = state.three_way ? "three_way" : "two_way";
  TwinPlant twin(twin_for(nominal_twin(), {state.settings.plane, 0.0, {}}), valves, position_m,
                 TwinPlant::Sensing{false, false, 1});
  BenchClockOf<FakeClock> clock;
  Bench bench(twin, clock, valve_modes(valves, state.nominal), state.nominal.motor_force_limit_n(),
              state.bench.tick_s(), [] { return false; });
  CommissionState as_it_should{bench, state.settings, state.nominal, state.three_way, {}, 1, true};
  return see_pulses(as_it_should, k);
}

}  // namespace

void coils_step(CommissionState& state, StepOutcome& out) {
  state.seen.coils.clear();
  state.wiring_is_known = false;
  if (!state.seen.motor && state.seen.at_rest[0].value_or(0) == 0 && state.seen.at_rest[1].value_or(0) == 0) {
    out.verdict = StepVerdict::skipped;
    out.note = "step motor has to be done first: it says which way the slide is caught";
    return;
  }
  if (!state.three_way && holds_pressure(state)) {
    out.verdict = StepVerdict::skipped;
    out.note = "a chamber reads pressure with every coil off: vent it, and find out where it comes from (step sensors)";
    return;
  }
  const CoilPatterns coils(state.three_way);
  for (const std::size_t k : {0u, 1u}) {
    if (!state.three_way) {
      try_chamber(state, out, k);
      continue;
    }
    const Tried tried = try_coil(state, coils.fill(k), {{0.010, 0.014, 0.020, 0.040}});
    add(out, k == 0 ? "coil_a" : "coil_b", tried.response);
    state.seen.coils.push_back(tried.response);
  }
  const std::vector<std::string> found = diagnosis(state.seen);
  out.findings.insert(out.findings.end(), found.begin(), found.end());
  state.wiring_is_known = out.findings.empty();
}

void leak_step(CommissionState& state, StepOutcome& out) {
  constexpr double charge_pa = 25e3, settle_s = 1.0, watched_s = 1.0, most_per_s = 3.0;
  if (needs_wiring(state, out)) return;
  const CoilPatterns coils(state.three_way);
  if (state.three_way) {
    out.verdict = StepVerdict::skipped;
    out.note = "three-way valves shut no chamber: with both coils on, pinch the supply's tube and watch the gauge";
    return;
  }
  double centre_m = 0.0;
  charge(state, charge_pa, centre_m);
  const double atmosphere = state.nominal.atmospheric_pressure_pa;
  const BenchGuard guard{.travel_m = 0.03, .pressure_pa = std::numeric_limits<double>::infinity()};
  const auto law = [&](const BenchSample& s) { return actuator_command(0, hold_force_n(state, s, centre_m)); };
  const BenchMean charged = mean_of(state.bench.play(0.05, guard, law));
  state.bench.play(settle_s, guard, law);
  const BenchMean first = mean_of(state.bench.play(0.05, guard, law));
  state.bench.play(watched_s - 0.05, guard, law);
  const BenchMean last = mean_of(state.bench.play(0.05, guard, law));
  for (const std::size_t k : {0u, 1u}) {
    const double gauge_pa = first.pressure_pa[k] - atmosphere, at_first_pa = charged.pressure_pa[k] - atmosphere;
    double lost = 100.0 * (1.0 - share_left(state, first, last, k)) / watched_s;
    // What is nearly empty by now lost its air while it settled.
    if (gauge_pa < 0.4 * at_first_pa || gauge_pa < 0.3 * charge_pa)
      lost = at_first_pa > 2e3 ? 100.0 * std::max(0.0, 1.0 - gauge_pa / at_first_pa) / settle_s : 100.0;
    const std::string name = k == 0 ? "a" : "b";
    out.measured.push_back({"gauge_" + name, gauge_pa / kilo, "kPa"});
    out.measured.push_back({"loss_" + name, lost, "%/s", {}, most_per_s});
    if (lost > most_per_s)
      out.findings.push_back(fmt::format("chamber {} leaks: {:.0f} % a second (its seals, fittings or exhaust valve)",
                                         chamber_name[k], lost));
  }
  vent(state, coils.exhaust_both());
}

void supply_step(CommissionState& state, StepOutcome& out) {
  constexpr double careful_pa = 25e3, filled_s = 2.5, band_pa = 10e3, apart_pa = 7e3, apart_upright_pa = 12e3;
  if (needs_wiring(state, out)) return;
  const CoilPatterns coils(state.three_way);
  double centre_m = 0.0;
  charge(state, careful_pa, centre_m);
  const double atmosphere = state.nominal.atmospheric_pressure_pa;
  const double expected_pa = state.nominal.supply_pressure_pa - atmosphere;
  // The supply is what its regulator makes it, and what is looked for here.
  const BenchGuard guard{.travel_m = 0.03, .pressure_pa = std::numeric_limits<double>::infinity()};
  const auto samples = state.bench.play(filled_s, guard, [&](const BenchSample& s) {
    return actuator_command(coils.fill_both(), hold_force_n(state, s, centre_m, 7.0));
  });
  const BenchMean full = mean_of(samples, samples.size() - std::min<std::size_t>(samples.size(), 300));
  std::array<double, 2> gauge{full.pressure_pa[0] - atmosphere, full.pressure_pa[1] - atmosphere};
  for (const std::size_t k : {0u, 1u})
    out.measured.push_back({k == 0 ? "gauge_a" : "gauge_b", gauge[k] / kilo, "kPa", (expected_pa - band_pa) / kilo,
                            (expected_pa + band_pa) / kilo});
  const double least = std::min(gauge[0], gauge[1]);
  // Upright the slide's weight may squeeze a chamber above the supply, past a valve that lets nothing back.
  if (std::abs(gauge[0] - gauge[1]) > (state.settings.plane == Plane::horizontal ? apart_pa : apart_upright_pa))
    out.findings.push_back(
        fmt::format("chambers A and B settle at {:.0f} and {:.0f} kPa gauge: a sensor's gain is wrong, or one leaks",
                    gauge[0] / kilo, gauge[1] / kilo));
  else if (std::abs(least - expected_pa) > band_pa)
    out.findings.push_back(fmt::format("the supply is at {:.0f} kPa gauge, not at {:.0f}: set the regulator",
                                       least / kilo, expected_pa / kilo));
  vent(state, coils.exhaust_both());
}

void delays_step(CommissionState& state, StepOutcome& out) {
  constexpr double band_ms = 2.5;
  if (needs_wiring(state, out)) return;
  const double opens_ms = 1e3 * state.nominal.energise_delay_s, closes_ms = 1e3 * state.nominal.deenergise_delay_s;
  for (const std::size_t k : {0u, 1u}) {
    const double at_m = mean_of(state.bench.play(0.05, {}, [](const BenchSample&) { return Command{}; }), 5).position_m;
    const PulseSeen seen = see_pulses(state, k), expected = expected_pulses(state, at_m, k);
    const double later_ms = 1e3 * (seen.shown_s - expected.shown_s);
    const double longer_ms =
        1e3 * (seen.dead_s(short_pulse_s, long_pulse_s) - expected.dead_s(short_pulse_s, long_pulse_s));
    const std::string name = k == 0 ? "a" : "b";
    out.measured.push_back({"opens_" + name, opens_ms + later_ms, "ms", opens_ms - band_ms, opens_ms + band_ms});
    out.measured.push_back(
        {"closes_" + name, closes_ms + later_ms - longer_ms, "ms", closes_ms - band_ms, closes_ms + band_ms});
    if (std::abs(later_ms) > band_ms)
      out.findings.push_back(
          fmt::format("the valve that fills chamber {} opens {:.1f} ms after its coil is told, not {:.1f}",
                      chamber_name[k], opens_ms + later_ms, opens_ms));
    if (std::abs(later_ms - longer_ms) > band_ms)
      out.findings.push_back(fmt::format(
          "the valve that fills chamber {} closes {:.1f} ms after its coil is told, not {:.1f}: a diode alone "
          "across the coil does that",
          chamber_name[k], closes_ms + later_ms - longer_ms, closes_ms));
  }
}

}  // namespace solenoid
