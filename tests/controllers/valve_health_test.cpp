#include "controllers/systems/actuator/estimators/valve_health.hpp"

#include "core/systems/actuator/valves.hpp"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

constexpr double tick_s = 0.001;

/// The actuator's own equations behind the pressure filter, under modes that change at random: a coil may fail.
class Bench {
 public:
  Bench(const char* valves, const ActuatorParameters& plant, std::uint64_t seed)
      : model_(plant), modes_(valve_modes(valves, {})), timing_(modes_, tick_s), random_(seed) {
    for (auto& lag : lag_)
      for (std::size_t i = 0; i < lag.size(); i += 2) lag[i] = 101325.0;
  }

  const ModeSet& modes() const { return modes_; }
  void fail(std::size_t c, const SwitchFault& fault) {
    failed_ = {c, fault};
    if (fault.kind == SwitchFaultKind::slow) timing_ = SwitchTiming(*with_fault(modes_, c, fault, tick_s), tick_s);
  }

  /// A tick under its command; what is measured at its end.
  Measurement tick() {
    if (--left_ <= 0) {
      command_ = modes_.pattern(std::uniform_int_distribution<int>(0, modes_.size() - 1)(random_));
      left_ = std::uniform_int_distribution<int>(12, 40)(random_);
    }
    lines_.command(off_ ? SwitchPattern{0} : command_, timing_);
    const SwitchPattern pattern = lines_.effective();
    lines_.advance(1);
    SwitchedOf<PneumaticActuator> opening{};
    std::ranges::copy(modes_.point(pattern), opening.begin());
    const auto off = modes_.point(0), on = modes_.point(SwitchPattern{1} << failed_.c);
    const double sound = (pattern >> failed_.c) & 1u ? 1.0 : 0.0;
    for (std::size_t i = 0; i < opening.size(); ++i)
      opening[i] += (failed_.fault.opening(sound) - sound) * (on[i] - off[i]);
    const ActuatorState before = x_;
    // The slide is led slowly up and down; only the air is tried here.
    x_ = model_.step<double>(x_, opening, {0.0}, tick_s);
    const double t = tick_s * static_cast<double>(++k_);
    x_[position] = 0.05 + 0.02 * std::sin(2.0 * t);
    x_[velocity] = 0.04 * std::cos(2.0 * t);
    Measurement m;
    m.time_s = t;
    m.value[position_channel] = x_[position] + 2e-5 * normal_(random_);
    for (std::size_t i = 0; i < 2; ++i) {
      const double noise = 700.0 * normal_(random_);
      const double p0 = before[pressure_a + i] + noise, p1 = x_[pressure_a + i] + noise;
      filter_.advance<1>(lag_[i].data(), &p0, &p1);
      double sum = 0.0;
      for (std::size_t j = 0; j < weights_.size(); ++j) sum += weights_[j] * lag_[i][j];
      m.value[pressure_a_channel + i] = sum + 20.0 * normal_(random_);
    }
    return m;
  }
  SwitchPattern command() const { return command_; }
  /// Whether the I/O keeps every valve closed, whatever is commanded.
  void keep_off(bool off) { off_ = off; }
  /// From now on one command, for so many ticks.
  void hold(SwitchPattern command, int ticks) {
    command_ = command;
    left_ = ticks + 1;
  }

 private:
  PneumaticActuator model_;
  ModeSet modes_;
  SwitchTiming timing_;
  PressureLag filter_{50.0, tick_s};
  std::array<double, PressureLag::size> weights_ = filter_.output();
  std::array<std::array<double, PressureLag::size>, 2> lag_{};
  DelayLines lines_{0};
  FailedSwitch failed_{};
  ActuatorState x_{0.05, 0.0, 101325.0, 101325.0};
  SwitchPattern command_ = 0;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  int left_ = 0, k_ = 0;
  bool off_ = false;
};

ActuatorParameters mismatched(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const double flow = between(0.85, 1.1);
  return Mismatch{.flow = flow, .supply = between(0.93, 1.07)}.applied_to({});
}

/// The bench's air has no temperature of its own.
HealthTuning as_the_model() {
  HealthTuning tuning;
  tuning.heat_transfer = 0.0;
  return tuning;
}

std::optional<FailedSwitch> step(Bench& bench, ValveHealth& health) {
  const auto found = health.update(bench.tick());
  health.commanded(bench.command());
  return found;
}

// Every single fault of every coil, from the pressures alone: the coil, and within half a second of modes that change at
// random, which need not use it at once.
TEST(ValveHealth, FindsEverySingleFaultOfEveryCoil) {
  for (const char* valves : {"two_way", "pcm_2"}) {
    int runs = 0, right = 0, wrong = 0;
    const std::size_t coils = valve_modes(valves, {}).switches().size();
    for (std::size_t c = 0; c < coils; ++c)
      for (const SwitchFault& fault : {SwitchFault{SwitchFaultKind::stuck_on}, SwitchFault{SwitchFaultKind::stuck_off}})
        for (std::uint64_t seed = 1; seed <= 5; ++seed) {
          Bench bench(valves, mismatched(seed), seed);
          ValveHealth health(PneumaticActuator(), bench.modes(), as_the_model());
          for (int k = 0; k < 800; ++k) ASSERT_FALSE(step(bench, health)) << valves << " sound, " << k << " ticks";
          bench.fail(c, fault);
          std::optional<FailedSwitch> found;
          for (int k = 0; k < 500 && !found; ++k) found = step(bench, health);
          ++runs;
          right += found && found->c == c && found->fault.kind == fault.kind;
          wrong += found && found->c != c;
        }
    EXPECT_GE(right, 95 * runs / 100) << valves << ": " << right << " of " << runs;
    EXPECT_LE(wrong, 5 * runs / 100) << valves;
  }
}

// A small valve that stays closed beside a large one looks like weak flow until the large one is opened alone, long after:
// then it is the small one that is closed, and not one that is open.
TEST(ValveHealth, AClosedValveThatPassedForWeakFlowIsNotTakenForAnOpenOne) {
  constexpr std::size_t small = 4, large = 5;  // supply B 1 and 2 of pulse code
  constexpr SwitchPattern both = 1u << small | 1u << large, alone = 1u << large, empty = 3u << 6;
  int found_right = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Bench bench("pcm_2", mismatched(seed), seed);
    ASSERT_EQ(bench.modes().switches()[small].name, "supply B 1");
    ValveHealth health(PneumaticActuator(), bench.modes(), as_the_model());
    bench.fail(small, {SwitchFaultKind::stuck_off});
    std::optional<FailedSwitch> found;
    const auto play = [&](SwitchPattern command, int ticks) {
      bench.hold(command, ticks);
      for (int k = 0; k < ticks && !found; ++k) found = step(bench, health);
    };
    play(0, 200);
    for (int round = 0; round < 3; ++round) {
      play(both, 10);
      play(0, 25);
      play(empty, 60);
      play(0, 80);
      play(alone, 15);
      play(0, 30);
      play(empty, 60);
      play(0, 80);
    }
    EXPECT_FALSE(found && found->fault.kind == SwitchFaultKind::stuck_on) << seed;
    found_right += found && found->c == small && found->fault.kind == SwitchFaultKind::stuck_off;
  }
  EXPECT_GE(found_right, 19);
}

TEST(ValveHealth, FindsValvesThatLeakOrAreSlow) {
  int runs = 0, right = 0;
  for (std::size_t c = 0; c < 4; ++c)
    for (const SwitchFault& fault :
         {SwitchFault{SwitchFaultKind::leaking, 0.3}, SwitchFault{SwitchFaultKind::slow, 0.01}}) {
      Bench bench("two_way", {}, c + 1);
      ValveHealth health(PneumaticActuator(), bench.modes(), as_the_model());
      for (int k = 0; k < 800; ++k) ASSERT_FALSE(step(bench, health));
      bench.fail(c, fault);
      std::optional<FailedSwitch> found;
      for (int k = 0; k < 1000 && !found; ++k) found = step(bench, health);
      ++runs;
      right += found && found->c == c && found->fault.kind == fault.kind;
    }
  EXPECT_GE(right, runs - 1);
}

// Two simulated minutes of every kind of command to sound valves.
TEST(ValveHealth, CallsNoSoundCoilFailed) {
  for (const char* valves : {"two_way", "pcm_2", "dual_orifice", "three_way"})
    for (std::uint64_t seed = 11; seed < 16; ++seed) {
      Bench bench(valves, mismatched(seed), seed);
      ValveHealth health(PneumaticActuator(), bench.modes(), as_the_model());
      for (int k = 0; k < 6000; ++k) ASSERT_FALSE(step(bench, health)) << valves << " " << seed << " " << k;
    }
}

/// What can go wrong with a tick beside the coils.
enum class Trouble { stands_still, node_safe, no_pressure, stuck_position };

/// So many ticks of it, and the first whole one after.
std::optional<FailedSwitch> undergo(Trouble trouble, int ticks, Bench& bench, ValveHealth& health) {
  std::optional<FailedSwitch> found;
  const auto tell = [&](const Measurement& m) {
    const auto now = health.update(m);
    if (now && !found) found = now;
    health.commanded(bench.command());
  };
  bench.keep_off(trouble == Trouble::node_safe);
  double position_m = std::numeric_limits<double>::quiet_NaN();
  for (int k = 0; k < ticks; ++k) {
    Measurement m = bench.tick();
    if (k == 0) position_m = m.value[position_channel];
    if (trouble == Trouble::stuck_position) m.value[position_channel] = position_m;
    if (trouble == Trouble::no_pressure) m.value[pressure_b_channel] = std::numeric_limits<double>::quiet_NaN();
    if (trouble == Trouble::stuck_position || trouble == Trouble::no_pressure) tell(m);
  }
  bench.keep_off(false);
  Measurement m = bench.tick();
  m.node_was_safe = trouble == Trouble::node_safe;
  tell(m);
  return found;
}

// A loop that stood still, a node that was in its safe state, a channel that was not believed, a position that stuck: no coil is called
// for it, and one that fails afterwards is found all the same.
TEST(ValveHealth, HoldsNoOtherTroubleAgainstACoil) {
  for (const char* valves : {"two_way", "pcm_2"})
    for (std::uint64_t seed = 21; seed < 25; ++seed) {
      Bench bench(valves, mismatched(seed), seed);
      ValveHealth health(PneumaticActuator(), bench.modes(), as_the_model());
      for (const Trouble trouble :
           {Trouble::stands_still, Trouble::node_safe, Trouble::no_pressure, Trouble::stuck_position})
        for (const int ticks : {1, 12, 30, 60, 150}) {
          // A position that sticks for longer is the plausibility checks' to find.
          if (trouble == Trouble::stuck_position && ticks > 30) continue;
          for (int k = 0; k < 250; ++k)
            ASSERT_FALSE(step(bench, health)) << valves << " " << seed << " before " << static_cast<int>(trouble);
          ASSERT_FALSE(undergo(trouble, ticks, bench, health))
              << valves << " " << static_cast<int>(trouble) << " " << ticks;
        }
      bench.fail(1, {SwitchFaultKind::stuck_on});
      std::optional<FailedSwitch> found;
      for (int k = 0; k < 700 && !found; ++k) found = step(bench, health);
      ASSERT_TRUE(found) << valves << " " << seed;
      EXPECT_EQ(found->c, 1u);
    }
}

// A fault that changes no flow says nothing: no evidence against any coil of a bank at rest at atmospheric pressure.
TEST(ValveHealth, ABankThatIsLeftAloneShowsNothing) {
  const ModeSet modes = valve_modes("two_way", {});
  ValveHealth health(PneumaticActuator(), modes);
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 5000; ++k) {
    Measurement m;
    m.time_s = tick_s * k;
    m.value = {0.02 + 2e-5 * normal(random), 101325.0 + 230.0 * normal(random), 101325.0 + 230.0 * normal(random)};
    ASSERT_FALSE(health.update(m));
    health.commanded(0);
  }
}

// The filter knows its own uncertainty: with the model's own plant the flow factors stay within four of their deviations.
TEST(ChamberFilter, LearnsFlowFactors) {
  const double flow = 0.9;
  Bench bench("two_way", Mismatch{.flow = flow}.applied_to({}), 3);
  ValveHealth health(PneumaticActuator(), bench.modes(), as_the_model());
  for (int k = 0; k < 4000; ++k) ASSERT_FALSE(step(bench, health));
  for (std::size_t chamber = 0; chamber < 2; ++chamber) {
    const ChamberFilter& sound = health.sound(chamber);
    EXPECT_NEAR(sound.mean()[ChamberFilter::fill_factor], flow, 0.06);
    EXPECT_NEAR(sound.mean()[ChamberFilter::exhaust_factor], flow, 0.06);
    EXPECT_LT(sound.sigma(ChamberFilter::fill_factor), 0.06);
  }
}

}  // namespace
}  // namespace solenoid
