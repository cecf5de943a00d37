#include "experiments/campaign/trace.hpp"

#include "controllers/systems.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <zlib.h>

namespace solenoid {
namespace {

ScenarioConfig noisy_sine(double duration_s) {
  ScenarioConfig s;
  s.name = "sine";
  s.trajectory = thesis_sine(0.0197);
  s.noise = true;
  s.ideal_sensing = false;
  s.duration_s = duration_s;
  return s;
}

const RunResult& simulated() {
  static const RunResult run = simulate(shipped_variant("nine_pd"), noisy_sine(1.0), 1);
  return run;
}

Trace simulated_trace() { return make_trace(shipped_variant("nine_pd"), noisy_sine(1.0), simulated().ticks); }

/// Random walks of a layout's signals over ticks with gaps, as a rig that skips has them.
Trace random_trace(std::size_t samples, unsigned seed, const TraceLayout& layout) {
  std::mt19937 random(seed);
  std::normal_distribution<double> step;
  Trace trace;
  trace.modes = {"hold", "fill"};
  trace.derived = layout.derived;
  trace.panels = layout.panels;
  std::int64_t tick = 0;
  for (std::size_t i = 0; i < samples; ++i) trace.ticks.push_back(tick += 1 + (random() % 20 == 0 ? random() % 7 : 0));
  for (const TraceLayout::Kept& kept : layout.kept) {
    Trace::Signal signal{kept.name, kept.unit, kept.resolution, {}};
    double value = 0.0;
    for (std::size_t i = 0; i < samples; ++i) signal.values.push_back(value += 30 * kept.resolution * step(random));
    trace.signals.push_back(std::move(signal));
  }
  return trace;
}

/// The same of the actuator's signals, whose page's reader is tested too.
Trace random_trace(std::size_t samples, unsigned seed) {
  TraceLayout layout;
  for (const auto& [name, resolution] : {std::pair{"reference", 1e-7},
                                         {"position", 1e-7},
                                         {"pressure_a", 10.0},
                                         {"pressure_b", 10.0},
                                         {"mode", 1.0},
                                         {"motor", 1e-3}})
    layout.kept.push_back({name, "", resolution});
  layout.derived = {{"error", "m", 1e-7, 0.0, {{"reference", 1.0}, {"position", -1.0}}},
                    {"cylinder", "N", 1e-3, -10.0, {{"pressure_a", 4.5e-4}, {"pressure_b", -4.2e-4}}}};
  layout.panels = {
      {.label = "position",
       .unit = "mm",
       .scale = 1e3,
       .curves = {{"position", "actual"}, {"reference", "desired", true}}},
      {.label = "error", .unit = "mm", .scale = 1e3, .curves = {{"error", "error"}}, .zero = true},
      {.label = "mode", .curves = {{"mode", "mode"}}, .modes = true},
      {.label = "cylinder", .unit = "N", .curves = {{"cylinder", "cylinder"}}, .zero = true, .choice = "other"},
      {.label = "pressure",
       .unit = "kPa",
       .scale = 1e-3,
       .curves = {{"pressure_a", "A"}, {"pressure_b", "B"}},
       .choice = "other"},
      {.label = "motor", .unit = "N", .curves = {{"motor", "motor"}}, .zero = true, .limit = 15.0}};
  return random_trace(samples, seed, layout);
}

/// A made-up system: two axes in one unit, one in another, nothing continuous.
SystemDescription carriage() {
  SystemDescription s;
  s.name = "carriage";
  for (const auto& [name, unit] : {std::pair{"left", "m"}, {"right", "m"}, {"tilt", "rad"}}) {
    s.states.push_back({name, unit, std::string("true_") + name, name});
    s.channels.push_back({name, unit, name, name});
    Axis axis;
    axis.signal = s.channels.back();
    axis.shown_unit = s.axes.size() < 2 ? "mm" : "deg";
    axis.shown_scale = s.axes.size() < 2 ? 1e3 : 57.3;
    axis.state = axis.channel = s.axes.size();
    s.axes.push_back(axis);
  }
  s.switch_noun = "clutch";
  return s;
}

/// What a trace has of a signal, kept or derived, in sample i.
double value_in(const Trace& trace, const std::string& name, std::size_t i) {
  const auto derived = std::ranges::find(trace.derived, name, &TraceLayout::Derived::name);
  if (derived == trace.derived.end()) return trace.signal(name).values[i];
  double sum = derived->constant;
  for (const auto& [term, factor] : derived->terms) sum += factor * trace.signal(term).values[i];
  return sum;
}

void expect_same(const Trace& before, const Trace& after) {
  EXPECT_EQ(after.tick_s, before.tick_s);
  EXPECT_EQ(after.ticks, before.ticks);
  EXPECT_EQ(after.modes, before.modes);
  EXPECT_EQ(after.derived, before.derived);
  EXPECT_EQ(after.panels, before.panels);
  EXPECT_EQ(after.measured, before.measured);
  EXPECT_EQ(after.solves.counts, before.solves.counts);
  ASSERT_EQ(after.signals.size(), before.signals.size());
  for (const Trace::Signal& signal : before.signals) {
    EXPECT_EQ(after.signal(signal.name).unit, signal.unit);
    const std::vector<double>& values = after.signal(signal.name).values;
    ASSERT_EQ(values.size(), signal.values.size());
    for (std::size_t i = 0; i < values.size(); ++i)
      ASSERT_NEAR(values[i], signal.values[i], 0.5000001 * signal.resolution) << signal.name << " " << i;
  }
}

TEST(Trace, KeepsEveryTickToItsResolution) {
  const Trace before = simulated_trace();
  ASSERT_FALSE(before.measured);
  ASSERT_FALSE(before.panels.empty());
  expect_same(before, decode_trace(encode_trace(before)));
}

TEST(Trace, OfAnotherSystemIsKeptToo) {
  Trace before = random_trace(700, 8, described_layout(carriage()));
  before.tick_s = 25e-6;
  before.measured = true;
  before.solves.add(12.0);
  ASSERT_EQ(before.derived.size(), 3u);
  ASSERT_EQ(before.panels.size(), 5u);  // lengths, angle, both errors, modes
  EXPECT_EQ(before.panels[0].label, "left, right");
  EXPECT_EQ(before.panels[0].curves.size(), 4u);
  EXPECT_EQ(before.panels[1].unit, "deg");
  EXPECT_EQ(before.panels[4].label, "clutch mode");
  expect_same(before, decode_trace(encode_trace(before)));
  const Trace shown = with_derived(before), again = with_derived(shown);
  EXPECT_EQ(shown.signals.size(), before.signals.size() + 3);
  EXPECT_EQ(again.signals.size(), shown.signals.size());
  for (std::size_t i = 0; i < before.ticks.size(); ++i)
    ASSERT_EQ(shown.signal("error_tilt").values[i], value_in(before, "error_tilt", i));
}

TEST(Trace, HasItsSignalsFromWhereTheLayoutSays) {
  for (const System* system : systems()) {
    VariantConfig variant = system->defaults();
    variant.system = system;
    ScenarioConfig scenario;
    scenario.name = "made up";
    scenario.system = system;
    const SystemDescription& description = system->description();
    const VariantConfig as_it_runs = told(variant, scenario);
    std::vector<TickRecord> ticks(3);
    for (std::size_t i = 0; i < ticks.size(); ++i) {
      TickRecord& t = ticks[i];
      t.sensors.time_s = static_cast<double>(i) * as_it_runs.timing.tick_s;
      t.sensors.value.fill(0.5);
      for (std::size_t a = 0; a < description.axes.size(); ++a)
        t.decision.reference.axis[a].value = 0.25 + static_cast<double>(a);
      t.applied.switches = system->modes(as_it_runs).pattern(0);
      t.applied.continuous.fill(2.0);
    }
    const Trace measured = make_trace(variant, scenario, ticks);
    EXPECT_TRUE(measured.measured) << system->name();
    for (std::size_t i = 0; i < description.states.size(); ++i) ticks[1].sensors.truth[i] = 0.125;
    const Trace known = make_trace(variant, scenario, ticks);
    EXPECT_FALSE(known.measured) << "one tick that knows the truth is enough";
    EXPECT_EQ(known.ticks, (std::vector<std::int64_t>{0, 1, 2}));
    for (const TraceLayout::Kept& kept : simulation_of(*system).layout(as_it_runs, scenario).kept) {
      const double now = known.signal(kept.name).values[1], then = measured.signal(kept.name).values[1];
      using Source = TraceLayout::Source;
      const double expected = kept.source == Source::state       ? 0.125
                              : kept.source == Source::reference ? 0.25 + static_cast<double>(kept.index)
                              : kept.source == Source::mode      ? 0.0
                                                                 : 2.0;
      EXPECT_EQ(now, expected) << kept.name;
      EXPECT_EQ(then, kept.source == Source::state ? 0.5 : expected) << kept.name;
    }
    expect_same(known, decode_trace(encode_trace(known)));
  }
}

TEST(Trace, IsSmall) {
  const std::string bytes = encode_trace(simulated_trace());
  EXPECT_LT(bytes.size(), 4 * simulated().ticks.size() + 512);  // of 48 bytes a tick as doubles, and the header
}

TEST(Trace, DrawsTheSameErrorsAsTheRunHad) {
  const Trace trace = with_derived(decode_trace(encode_trace(simulated_trace())));
  const VariantConfig variant = shipped_variant("nine_pd");
  const ModeSet modes = system_of(variant).modes(variant);
  const std::vector<double>&errors = trace.signal("error").values, &mode = trace.signal("mode").values;
  double squares = 0.0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    squares += 1e6 * errors[i] * errors[i];
    ASSERT_EQ(modes.pattern(static_cast<int>(mode[i])), simulated().ticks[i].applied.switches);
  }
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(errors.size())), simulated().metrics["rmse_mm"], 1e-4);
}

TEST(Trace, CylinderForceIsThePlantsOwn) {
  ScenarioConfig scenario = noisy_sine(1.0);
  actuator(scenario).mismatch.supply = 0.9;
  const VariantConfig variant = shipped_variant("nine_pd");
  const PneumaticActuator plant(actuator(scenario).mismatch.applied_to(actuator(variant).nominal));
  const Trace trace = make_trace(variant, scenario, simulated().ticks);
  for (std::size_t i = 0; i < trace.ticks.size(); i += 50)
    EXPECT_NEAR(value_in(trace, "cylinder", i),
                plant.cylinder_force(trace.signal("pressure_a").values[i], trace.signal("pressure_b").values[i]), 1e-6);
}

/// What the version before this one wrote: 20 ticks of nine_pd on a sine.
constexpr std::string_view written_before =
    "534c5431789ca553314ec330144d93362a0821d8189167b7729d84a415037000c48eaa28b4ae887062e424085455b0c0ce80"
    "040c1c8003c0002b3be21048dc82ef40d350baf5274abedff77bf67f4e0243d3862809a263ce12d4a104a334ec1df9909326"
    "212d8c22d157957d7428787f7d1bafe7ef1d840b601072fe0760a7874196a4399617cbac3150b0c6409935cecbc41256704b"
    "d884dec5a877c6c3b8cfa43f10b2c760f70dab4989e77996edb8b64b5bd4c1aa3f02438b5876bbed798ed3766ddcf881a9b3"
    "61d9d4a3b64d09a55657f9900ae9f3300a533f461daf0956452c4832c9faa8330878c2304a043f516e0da12b99a4300df622"
    "b238550e5a98e05677a4109e45b18286280e22d85f6e3af493c521901064928156968602d66aa9b584847e20c7e8e02cfd39"
    "ab112ef8920d986431f45a8844d32aac41dc593ab4a4732c92309f3ea70c3094337e3011da0ba695c8ecbe660a1dcc29a43e"
    "e3790cce8f7f22b03ba5f0fbb3fc6ad042c37247dd91a6ff8ff7cb354dd3d5adeb55ddac9a66bdbeb894a31015a356338c1a"
    "5c10dae34345fb1b401ca3d325152bea6114c38fe5ebb59b8557f3ca78a83dad6ebdacdc552ecc67fd563fbfac7ed6efcdcd"
    "37f3cbfc06c4431adc";

std::string bytes_of_hex(std::string_view hex) {
  std::string bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2)
    bytes += static_cast<char>(std::stoi(std::string(hex.substr(i, 2)), nullptr, 16));
  return bytes;
}

TEST(Trace, ThoseOfTheVersionBeforeAreRead) {
  const Trace read = decode_trace(bytes_of_hex(written_before)), now = simulated_trace();
  EXPECT_EQ(read.ticks.size(), 20u);
  EXPECT_EQ(read.modes, now.modes);
  EXPECT_FALSE(read.measured);
  EXPECT_EQ(read.panels, now.panels);
  ASSERT_EQ(read.derived.size(), now.derived.size());
  for (std::size_t i = 0; i < now.derived.size(); ++i) EXPECT_EQ(read.derived[i].name, now.derived[i].name);
  const Trace shown = with_derived(read);
  for (std::size_t i = 0; i < 20; ++i)
    ASSERT_NEAR(shown.signal("error").values[i], read.signal("reference").values[i] - read.signal("position").values[i],
                1e-12);
  expect_same(read, decode_trace(encode_trace(read)));
}

TEST(Trace, ASignalThatIsDrawnMustBeThere) {
  Trace trace = random_trace(20, 9);
  trace.panels[0].curves[0].signal = "nothing";
  EXPECT_THROW(decode_trace(encode_trace(trace)), std::invalid_argument);
  trace = random_trace(20, 9);
  trace.derived[0].terms[0].first = "nothing";
  EXPECT_THROW(decode_trace(encode_trace(trace)), std::invalid_argument);
}

TEST(Trace, WhatIsNoNumberStaysNone) {
  Trace trace = random_trace(50, 1);
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  auto& values = trace.signals[1].values;
  values[7] = nan;
  values[20] = infinity;
  values[21] = -1e300;
  std::fill(values.begin() + 40, values.end(), nan);
  const Trace after = decode_trace(encode_trace(trace));
  const auto& read = after.signals[1].values;
  EXPECT_TRUE(std::isnan(read[7]));
  EXPECT_GT(read[20], 1e6);
  EXPECT_LT(read[21], -1e6);
  EXPECT_NEAR(read[8], values[8], 0.51e-7);
  EXPECT_NEAR(read[22], values[22], 0.51e-7);
  for (std::size_t i = 40; i < 50; ++i) EXPECT_TRUE(std::isnan(read[i]));
}

TEST(Trace, DamagedBytesAreRefused) {
  const std::string bytes = encode_trace(random_trace(300, 2));
  for (std::size_t size = 0; size < bytes.size(); size += 7)
    EXPECT_THROW(decode_trace(std::string_view(bytes).substr(0, size)), std::invalid_argument) << size;
  EXPECT_THROW(decode_trace("variant,scenario\n"), std::invalid_argument);
}

/// Bytes as they may come from anywhere: a header of our own, and so much of what follows it.
std::string forged_trace(const std::string& header, std::size_t body) {
  std::string text;
  for (int byte = 0; byte < 4; ++byte) text += static_cast<char>(header.size() >> (8 * byte) & 0xff);
  text += header + std::string(body, '\0');
  uLongf size = compressBound(text.size());
  std::string bytes(size, '\0');
  compress(reinterpret_cast<Bytef*>(bytes.data()), &size, reinterpret_cast<const Bytef*>(text.data()), text.size());
  return "SLT2" + bytes.substr(0, size);
}

std::string refusal_of_trace(const std::string& bytes) {
  try {
    decode_trace(bytes);
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), testing::Not(testing::HasSubstr("json.exception")));
    return error.what();
  }
  return "nothing";
}

TEST(Trace, InflatesToWhatItsHeaderTellsAndNoMore) {
  const auto header = [](const std::string& columns, const std::string& solves = R"("first":0,"counts":[])",
                         const std::string& samples = "1") {
    return R"({"samples":)" + samples +
           R"(,"tick_s":0.001,"modes":[],"measured":false,"derived":[],"panels":[],"solves":{)" + solves +
           R"(},"columns":[)" + columns + "]}";
  };
  const auto column = [](const std::string& bytes) {
    return R"({"name":"tick","unit":"","resolution":1.0,"order":1,"bytes":)" + bytes + "}";
  };
  EXPECT_EQ(refusal_of_trace(forged_trace(header(column("1")), 1)), "nothing");
  EXPECT_THAT(refusal_of_trace(forged_trace(header(column("1")), 100'000'000)), testing::HasSubstr("more bytes"));
  EXPECT_THAT(refusal_of_trace(forged_trace(header(column("200000000")), 1)), testing::HasSubstr("too large"));
  EXPECT_THAT(refusal_of_trace(forged_trace(header(column("100000000")), 1)), testing::HasSubstr("damaged"));
  EXPECT_NE(refusal_of_trace(forged_trace(header(column("-1")), 1)), "nothing");
  EXPECT_THAT(refusal_of_trace(forged_trace(header(column("1"), R"("first":-2000000000,"counts":[1])"), 1)),
              testing::HasSubstr("bins"));
  EXPECT_NE(refusal_of_trace(forged_trace(header("", R"("first":0,"counts":[])", "1000000000000"), 1)), "nothing");
  EXPECT_THAT(refusal_of_trace(forged_trace(std::string(100'000, '['), 1)), testing::HasSubstr("nested"));
  EXPECT_THAT(refusal_of_trace(forged_trace(std::string(2'000'000, ' '), 1)), testing::HasSubstr("too large"));
  EXPECT_THAT(refusal_of_trace(forged_trace("{}", 1)), testing::HasSubstr("not found"));
}

std::string refusal_of_changed(const std::function<void(Trace&)>& change) {
  Trace trace = random_trace(20, 10);
  trace.solves.add(12.0);
  change(trace);
  return refusal_of_trace(encode_trace(trace));
}

TEST(Trace, WhatCannotBeDrawnIsRefused) {
  constexpr double huge = 1e308;
  const std::pair<const char*, std::function<void(Trace&)>> cases[] = {
      {"no curve", [](Trace& t) { t.panels[2].curves.clear(); }},
      {"no modes", [](Trace& t) { t.modes.clear(); }},
      {"too many panels", [](Trace& t) { t.panels.resize(101, t.panels[0]); }},
      {"tick_s", [](Trace& t) { t.tick_s = huge; }},
      {"tick_s", [](Trace& t) { t.tick_s = 0.0; }},
      {"ticks", [](Trace& t) { t.ticks[0] = -1; }},
      {"resolution", [](Trace& t) { t.signals[1].resolution = huge; }},
      {"resolution", [](Trace& t) { t.signals[1].resolution = -1e-3; }},
      {"resolution", [](Trace& t) { t.derived[0].resolution = 0.0; }},
      {"constant", [](Trace& t) { t.derived[0].constant = -huge; }},
      {"factor", [](Trace& t) { t.derived[0].terms[1].second = huge; }},
      {"scale", [](Trace& t) { t.panels[0].scale = huge; }},
      {"limit", [](Trace& t) { t.panels[5].limit = huge; }},
      {"limit", [](Trace& t) { t.panels[5].limit = -1.0; }},
      {"solves", [](Trace& t) { t.solves.counts[0] = std::numeric_limits<std::int64_t>::max(); }},
      {"solves", [](Trace& t) { t.solves.counts[0] = -1; }}};
  for (const auto& [said, change] : cases) EXPECT_THAT(refusal_of_changed(change), testing::HasSubstr(said));
  EXPECT_EQ(refusal_of_changed([](Trace&) {}), "nothing");
  EXPECT_EQ(refusal_of_changed([](Trace& t) { t.panels.resize(100, t.panels[0]); }), "nothing");
  EXPECT_EQ(refusal_of_changed([](Trace& t) { t.panels.clear(), t.modes.clear(); }), "nothing");
}

TEST(Trace, TheReportsPageReadsTheSameNumbers) {
  if (std::system("command -v node >/dev/null 2>&1") != 0) GTEST_SKIP() << "needs: apt-get install nodejs";
  Trace trace = random_trace(3000, 6);
  auto& positions = trace.signals[1].values;
  positions[1234] = 0.5;  // peaks of one sample
  positions[2345] = -0.5;
  std::fill(positions.begin() + 2900, positions.end(), std::numeric_limits<double>::quiet_NaN());
  const test::Folder folder;
  folder.write("run.trace", encode_trace(trace));
  nlohmann::json numbers = {{"tick", trace.ticks}};
  for (const Trace::Signal& signal : trace.signals) numbers[signal.name] = signal.values;  // NaN becomes null
  folder.write("numbers.json", numbers.dump());
  const std::string command = "cd '" + folder.path() +
                              "' && node '" SOLENOID_SOURCE_DIR
                              "/tests/experiments/campaign/trace_reader.mjs' '" SOLENOID_SOURCE_DIR
                              "/experiments/report/assets/trace.js' run.trace numbers.json >out 2>&1";
  EXPECT_EQ(std::system(command.c_str()), 0);
  EXPECT_EQ(test::text_of(folder / "out"), "same\n");
}

TEST(TraceOverview, LosesNoPeak) {
  constexpr int spans = 37;
  for (const std::size_t samples : {75u, 1000u, 4321u}) {
    const bool other = samples == 1000u;
    const Trace trace = other ? random_trace(samples, 3, described_layout(carriage())) : random_trace(samples, 3);
    const Trace reduced = overview(trace, spans);
    ASSERT_EQ(reduced.signals.size(), trace.signals.size() + trace.derived.size());
    ASSERT_EQ(reduced.ticks.size(), 2u * spans);
    const std::int64_t from = trace.ticks.front(), length = trace.ticks.back() + 1 - from;
    const auto value = [&](const std::string& name, std::size_t i) { return value_in(trace, name, i); };
    for (const Trace::Signal& signal : reduced.signals) {
      for (std::size_t s = 0; s < spans; ++s) {
        double low = std::numeric_limits<double>::infinity(), high = -low;
        for (std::size_t i = 0; i < samples; ++i) {
          if ((trace.ticks[i] - from) < length * static_cast<std::int64_t>(s) / spans) continue;
          if ((trace.ticks[i] - from) >= length * static_cast<std::int64_t>(s + 1) / spans) break;
          low = std::min(low, value(signal.name, i));
          high = std::max(high, value(signal.name, i));
        }
        const double a = signal.values[2 * s], b = signal.values[2 * s + 1];
        if (low > high) {
          EXPECT_TRUE(std::isnan(a) && std::isnan(b));  // a gap longer than the span
          continue;
        }
        EXPECT_EQ(std::min(a, b), low) << signal.name << " span " << s;
        EXPECT_EQ(std::max(a, b), high) << signal.name << " span " << s;
      }
    }
  }
}

TEST(TraceOverview, TimesIncreaseInsideTheRun) {
  const Trace trace = random_trace(5000, 4), reduced = overview(trace, 100);
  EXPECT_TRUE(std::ranges::is_sorted(reduced.ticks));
  EXPECT_GE(reduced.ticks.front(), trace.ticks.front());
  EXPECT_LE(reduced.ticks.back(), trace.ticks.back());
}

TEST(TraceOverview, AShortRunKeepsEachTick) {
  const Trace trace = random_trace(60, 5), reduced = overview(trace, 40);
  EXPECT_EQ(reduced.ticks, trace.ticks);
  EXPECT_EQ(reduced.signal("position").values, trace.signal("position").values);
}

TEST(SolveHistogram, CountsInTenthsOfADecade) {
  SolveHistogram histogram;
  for (const double us : {1.0, 1.2, 1.3, 9.9, 10.0, 5000.0, 4999.0}) histogram.add(us);
  EXPECT_EQ(histogram.first, 0);
  const auto count = [&](int bin) { return histogram.counts[static_cast<std::size_t>(bin - histogram.first)]; };
  EXPECT_EQ(count(0), 2);   // 1.00 to 1.26
  EXPECT_EQ(count(1), 1);   // 1.26 to 1.58
  EXPECT_EQ(count(9), 1);   // 7.94 to 10
  EXPECT_EQ(count(10), 1);  // 10 to 12.6
  EXPECT_EQ(count(36), 2);  // 3981 to 5012
  EXPECT_EQ(histogram.total(), 7);
}

TEST(SolveHistogram, TakesAnyOrderAndAnyTime) {
  SolveHistogram histogram, other;
  for (const double us : {300.0, 2.0, 0.0, 1e12}) histogram.add(us);
  EXPECT_EQ(histogram.first, SolveHistogram::least);
  EXPECT_EQ(histogram.first + static_cast<int>(histogram.counts.size()) - 1, SolveHistogram::most);
  other.add(300.0);
  other.add(histogram);
  EXPECT_EQ(other.total(), 5);
  EXPECT_EQ(other.counts[static_cast<std::size_t>(24 - other.first)], 2);
}

}  // namespace
}  // namespace solenoid
