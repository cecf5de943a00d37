#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/campaign/simulate.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

VariantConfig shipped(const std::string& name, const std::string& change = "") {
  TableReader file =
      TableReader::from_file(SOLENOID_SOURCE_DIR "/experiments/systems/actuator/data/scenarios/variants.toml");
  TableReader variants = file.table("variant");
  TableReader table = variants.table(name);
  VariantConfig v = read_variant(table, name);
  if (change.empty()) return v;
  TableReader changed = TableReader::from_text(change, "change");
  return read_variant(changed, name);
}

ScenarioConfig sine(double payload_kg, double friction = 1.0, double flow = 1.0) {
  ScenarioConfig s;
  s.trajectory = thesis_sine(ActuatorParameters().equilibrium_position_m());
  s.ideal_sensing = false;
  actuator(s).sensing_chain = true;
  actuator(s).payload_kg = payload_kg;
  actuator(s).mismatch.friction = friction;
  actuator(s).mismatch.flow = flow;
  return s;
}

/// The same task on the truth plant, which has a sensing chain of its own.
ScenarioConfig on_the_twin(ScenarioConfig task) {
  actuator(task).plant = "twin";
  actuator(task).sensing_chain = false;
  task.noise = true;
  return task;
}

struct Errors {
  double position_mm = 0, pressure_kpa = 0, read_pressure_kpa = 0, payload_kg = 0;
};

Errors errors(const RunResult& run, double payload_kg) {
  Errors e;
  const auto n = static_cast<double>(run.ticks.size());
  for (const TickRecord& t : run.ticks) {
    const ActuatorState x = actuator_state(t.decision.estimate);
    const ActuatorState truth = actuator_state(t.sensors.truth);
    e.position_mm += 1e6 * std::pow(x[position] - truth[position], 2) / n;
    const auto squares = [&](double a_pa, double b_pa) {
      return 0.5e-6 * (std::pow(a_pa - truth[pressure_a], 2) + std::pow(b_pa - truth[pressure_b], 2)) / n;
    };
    e.pressure_kpa += squares(x[pressure_a], x[pressure_b]);
    e.read_pressure_kpa += squares(t.sensors.value[pressure_a_channel], t.sensors.value[pressure_b_channel]);
    if (t.sensors.time_s >= 2.0)  // the motion begins at once: a second of it, and one to spare
      e.payload_kg = std::max(e.payload_kg, std::abs(t.decision.detail.belief[payload_belief] - payload_kg));
  }
  e.position_mm = std::sqrt(e.position_mm);
  e.pressure_kpa = std::sqrt(e.pressure_kpa);
  e.read_pressure_kpa = std::sqrt(e.read_pressure_kpa);
  return e;
}

/// plant, estimator, friction, flow, payload
class HiddenMismatch : public testing::TestWithParam<std::tuple<std::string, std::string, double, double, double>> {};

TEST_P(HiddenMismatch, PositionPayloadAndPressuresAreSeenThroughTheSensingChain) {
  const auto& [plant, estimator, friction, flow, payload_kg] = GetParam();
  VariantConfig v = shipped(plant == "twin" ? "thesis_pd_ekf" : "thesis_pd_payload");
  v.estimator = estimator;
  const ScenarioConfig task =
      plant == "twin" ? on_the_twin(sine(payload_kg, friction, flow)) : sine(payload_kg, friction, flow);
  const Errors e = errors(simulate(v, task, 1), payload_kg);
  std::printf("%s %s friction %.1f flow %.2f payload %.2f: %.4f mm, %.2f kPa (read: %.2f), payload within %.3f kg\n",
              plant.c_str(), estimator.c_str(), friction, flow, payload_kg, e.position_mm, e.pressure_kpa,
              e.read_pressure_kpa, e.payload_kg);
  EXPECT_LT(e.position_mm, 0.02);
  // The nominal chambers are isothermal, the twin's are not: there the filter must only undo most of the delay.
  EXPECT_LT(e.pressure_kpa, plant == "twin" ? 0.5 * e.read_pressure_kpa : 2.0);
  EXPECT_LT(e.payload_kg, std::max(0.02, 0.1 * payload_kg));
}

/// All of these, or the last alone under sanitizers, where each takes a minute and runs the same code.
auto values(std::vector<double> all) {
  if (SOLENOID_TEST_ONE_IN > 1) all.erase(all.begin(), all.end() - 1);
  return testing::ValuesIn(all);
}

INSTANTIATE_TEST_SUITE_P(SineOnTheModel, HiddenMismatch,
                         testing::Combine(testing::Values("model"), testing::Values("payload_ekf", "mhe"),
                                          values({0.7, 1.0, 2.0}), values({0.8, 1.15}), values({0.0, 0.15, 0.3})));
INSTANTIATE_TEST_SUITE_P(SineOnTheTwin, HiddenMismatch,
                         testing::Combine(testing::Values("twin"), testing::Values("payload_ekf"),
                                          values({0.7, 1.0, 2.0}), values({0.8, 1.15}), values({0.0, 0.15, 0.3})));
INSTANTIATE_TEST_SUITE_P(CornersOnTheTwin, HiddenMismatch,
                         testing::Combine(testing::Values("twin"), testing::Values("mhe"), values({0.7, 2.0}),
                                          values({0.8, 1.15}), values({0.0, 0.3})));

TEST(EkfWithoutPayload, SeesPositionThroughAHiddenPayloadAsAForce) {
  const VariantConfig v = shipped("thesis_pd", "motor = 'pd'\nintegral = { gain = 0.005 }\nestimator = 'ekf'");
  for (const double payload_kg : {0.0, 0.15})
    EXPECT_LT(errors(simulate(v, sine(payload_kg, 2.0, 0.8), 1), 0.0).position_mm, 0.02);
}

double mean_rmse_on_the_twin_mm(const std::string& variant, double payload_kg) {
  const ScenarioConfig task = on_the_twin(sine(payload_kg));
  double sum = 0.0;
  for (const std::uint64_t seed : {1, 2, 3}) sum += simulate(shipped(variant), task, seed).metrics["rmse_mm"];
  return sum / 3;
}

TEST(ThesisWithTheBestEstimator, HalvesTheErrorOfTheThesisAndAShortHorizonHalvesItAgain) {
  for (const double payload_kg : {0.0, 0.15}) {
    const double thesis = mean_rmse_on_the_twin_mm("thesis_pd", payload_kg);
    const double best = mean_rmse_on_the_twin_mm("thesis_pd_ekf", payload_kg);
    const double brief = mean_rmse_on_the_twin_mm("thesis_pd_ekf_short", payload_kg);
    std::printf("payload %.2f kg: thesis_pd %.3f, thesis_pd_ekf %.3f, thesis_pd_ekf_short %.3f mm\n", payload_kg,
                thesis, best, brief);
    EXPECT_LT(best, 0.5 * thesis);
    EXPECT_LT(brief, 0.5 * best);
  }
}

TEST(IdealSensing, BypassesEveryEstimator) {
  ScenarioConfig s = sine(0.0);
  s.ideal_sensing = true;
  actuator(s).sensing_chain = false;
  s.duration_s = 1.0;
  const RunResult a = simulate(shipped("thesis_cylinder"), s, 1), b = simulate(shipped("thesis_cylinder_ekf"), s, 1);
  for (std::size_t k = 0; k < a.ticks.size(); ++k) ASSERT_EQ(a.ticks[k].sensors.truth, b.ticks[k].sensors.truth) << k;
}

TEST(Latency, ForecastMakesUpForAPlanThatTakesAPeriod) {
  const std::string base = "motor = 'pd'\nintegral = { gain = 0.005 }\nestimator = 'payload_ekf'\nlatency_ticks = ";
  const double at_once = simulate(shipped("thesis_pd", base + "0"), sine(0.0), 1).metrics["rmse_mm"];
  const double late = simulate(shipped("thesis_pd", base + "5"), sine(0.0), 1).metrics["rmse_mm"];
  EXPECT_NE(at_once, late);
  EXPECT_LT(late, 2.0 * at_once);
}

TEST(EstimatorConfiguration, IsRefusedWithTheKeyAndWhatIsAllowed) {
  const auto message = [](const std::string& text) {
    try {
      shipped("thesis_pd", text);
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(message("estimator = 'luenberger'").find("payload_ekf"), std::string::npos);
  EXPECT_NE(message("use_estimate = 'payload'").find("use_estimate"), std::string::npos);
  EXPECT_NE(message("estimator = 'mhe'\nestimation = { window_ticks = 500 }").find("window_ticks"), std::string::npos);
  EXPECT_NE(message("estimator = 'ekf'\nestimation = { position_sigma_m = 0.0 }").find("position_sigma_m"),
            std::string::npos);
  EXPECT_NE(message("latency_ticks = 9").find("latency_ticks"), std::string::npos);
}

}  // namespace
}  // namespace solenoid
