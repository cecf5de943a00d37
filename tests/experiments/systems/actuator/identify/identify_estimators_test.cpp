#include "core/config/reader.hpp"
#include "core/signal/bessel.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/systems/actuator/identify/chambers.hpp"
#include "experiments/systems/actuator/identify/coverage_study.hpp"
#include "experiments/systems/actuator/identify/experiment.hpp"
#include "experiments/systems/actuator/identify/friction.hpp"
#include "experiments/systems/actuator/identify/identify.hpp"
#include "experiments/systems/actuator/identify/log_source.hpp"
#include "experiments/systems/actuator/identify/noise.hpp"
#include "experiments/systems/actuator/identify/run_experiment.hpp"
#include "experiments/systems/actuator/identify/signals.hpp"
#include "experiments/systems/actuator/identify/statistics.hpp"
#include "experiments/systems/actuator/twin/twin_sensing.hpp"

#include <cmath>
#include <random>

#include <gmock/gmock.h>

namespace solenoid {
namespace {

using testing::HasSubstr;

/// x_t = rho x_{t-1} + e_t, stationary, unit variance.
std::vector<double> autoregressive(double rho, std::size_t n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> x(n);
  double value = normal(random);
  for (double& v : x) v = value = rho * value + std::sqrt(1 - rho * rho) * normal(random);
  return x;
}

TEST(Statistics, StudentsQuantileIsTheTables) {
  EXPECT_NEAR(student_quantile(19), 2.0930, 1e-4);
  EXPECT_NEAR(student_quantile(1), 12.7062, 1e-4);
  EXPECT_NEAR(student_quantile(1e6), 1.95997, 1e-4);
}

TEST(Statistics, VarianceOfTheMeanCountsCorrelation) {
  // Of an AR(1) series: (1 + rho)/(1 - rho)/n; as if uncorrelated it would be nine times too small.
  const std::size_t n = 200000;
  const double rho = 0.8, expected = (1 + rho) / (1 - rho) / static_cast<double>(n);
  EXPECT_NEAR(variance_of_mean(autoregressive(rho, n, 1), 60) / expected, 1.0, 0.1);
}

TEST(Statistics, LinearIntervalsHoldTheTruthUnderCorrelatedNoise) {
  int covered = 0;
  constexpr int runs = 400, n = 1500;
  for (int run = 0; run < runs; ++run) {
    const std::vector<double> noise = autoregressive(0.85, n, 100 + static_cast<std::uint64_t>(run));
    Eigen::MatrixXd x(n, 2);
    Eigen::VectorXd y(n);
    for (int t = 0; t < n; ++t) {
      x.row(t) << 1.0, std::sin(0.02 * t);
      y[t] = 3.0 + 2.0 * x(t, 1) + noise[static_cast<std::size_t>(t)];
    }
    const LeastSquaresFit fit = solve_linear(x, y, {n}, 40);
    covered += make_estimate("b", "", fit.x[1], fit.sigma(1), fit.freedom, "").contains(2.0);
  }
  // Binomial: 95 % of 400 with a standard deviation of 4.4; Newey and West's variance is known to be a little small.
  EXPECT_GE(covered, 360);
  EXPECT_LE(covered, 395);
}

TEST(Statistics, NonlinearFitAgreesWithTheLinearOneOnALinearProblem) {
  constexpr int n = 300;
  const std::vector<double> noise = autoregressive(0.5, n, 7);
  Eigen::MatrixXd x(n, 2);
  Eigen::VectorXd y(n);
  for (int t = 0; t < n; ++t) {
    x.row(t) << 1.0, 0.01 * t;
    y[t] = 1.0 - 4.0 * x(t, 1) + 0.1 * noise[static_cast<std::size_t>(t)];
  }
  LeastSquares problem;
  problem.residuals = [&](const Eigen::VectorXd& b, Eigen::VectorXd& r) { r = y - x * b; };
  problem.series = {n};
  problem.start = Eigen::Vector2d(0.5, 1.0);
  problem.scale = Eigen::Vector2d(1.0, 3.0);
  problem.lags = 10;
  const LeastSquaresFit a = solve_least_squares(problem), b = solve_linear(x, y, {n}, 10);
  EXPECT_TRUE(a.converged);
  EXPECT_LT((a.x - b.x).norm(), 1e-6);
  EXPECT_LT((a.covariance - b.covariance).norm(), 1e-6 * b.covariance.norm());
}

TEST(Signals, GaussianKeepsParabolasAndTheirDerivatives) {
  std::vector<double> y;
  y.reserve(1000);
  for (int t = 0; t < 1000; ++t) y.push_back(0.3 + 2e-3 * t + 5e-6 * t * t);
  const std::vector<double> rate = gaussian(y, 1e-3, 0.02, 1), acceleration = gaussian(y, 1e-3, 0.02, 2);
  EXPECT_NEAR(gaussian(y, 1e-3, 0.02)[500], y[500] + 5e-6 * 400,
              1e-6);  // a parabola is raised by its curvature width^2 / 2
  EXPECT_NEAR(rate[500], 2.0 + 1e-2 * 500, 1e-9);
  EXPECT_NEAR(acceleration[500], 10.0, 1e-7);
}

TEST(Signals, BesselDelaysALineByItsGroupDelay) {
  std::vector<double> line;
  line.reserve(400);
  for (int t = 0; t < 400; ++t) line.push_back(t);
  EXPECT_NEAR(through_bessel(line, 1e-3, 0.0101, Between::straight)[300], 300 - 10.1, 0.02);
  EXPECT_NEAR(through_bessel(line, 1e-3, 0.0101, Between::held)[300], 300 - 10.1 - 0.5, 0.02);
}

TEST(Signals, AQuietPositionRestsAndStillAccelerates) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 2e-5);
  std::vector<double> truth, seen;
  for (int t = 0; t < 2000; ++t) {
    const double s = 1e-3 * std::max(0, t - 1000);
    truth.push_back(0.05 + 0.5 * 0.5 * s * s);
    seen.push_back(truth.back() + noise(random));
  }
  const std::vector<double> quiet = quiet_position(seen, 1e-3);
  double rest = 0, moving = 0;
  for (std::size_t t = 100; t < 900; ++t) rest = std::max(rest, std::abs(quiet[t] - truth[t]));
  for (std::size_t t = 1100; t < 1900; ++t) moving = std::max(moving, std::abs(quiet[t] - truth[t]));
  EXPECT_LT(rest, 3e-6);
  EXPECT_LT(moving, 2.5e-5);
}

TEST(StaticFriction, Table41IsTheThesissMean) {
  const Estimate e = static_friction_of_table_4_1();
  EXPECT_NEAR(e.value, 1.4495, 1e-9);  // printed as 1.4 N
  EXPECT_NEAR(e.high - e.low, 2 * 2.0930 * e.sigma, 1e-4);
  EXPECT_TRUE(e.contains(1.4));
}

TEST(Friction, RunsOnALineGiveTheLine) {
  std::vector<SpeedRun> runs;
  for (int i = 1; i <= 8; ++i) runs.push_back({0.01 * i, 0.97 + 4.5 * 0.01 * i + (i % 2 ? 0.01 : -0.01)});
  const Findings found = friction_from_runs(runs, "");
  EXPECT_TRUE(found.find("viscous_friction")->contains(4.5));
  EXPECT_TRUE(found.find("coulomb_friction_n")->contains(0.97));
  EXPECT_NEAR(found.find("viscous_friction")->freedom, 6, 0);
}

TEST(Friction, Table42DoesNotDetermineTheViscousCoefficient) {
  const Table42Verdict verdict = judge_table_4_2();
  EXPECT_FALSE(verdict.determines);
  ASSERT_EQ(verdict.readings.size(), 2u);
  // model.md, E6: the set means 0.263 m/s, 1.56 N and 0.2535 m/s, 2.11 N give -58 N s/m.
  EXPECT_NEAR(verdict.readings[1].between_sets, -58, 3);
  for (const Table42Reading& r : verdict.readings) EXPECT_FALSE(r.viscous.contains(4.5)) << r.viscous.low;
  EXPECT_THAT(verdict.text, HasSubstr("does not determine"));
}

TEST(Noise, FilteredSigmaIsWhatTheChainMakes) {
  const SensingEffects effects = nominal_twin().sensing;
  const ActuatorState rest = {0.05, 0, 101325, 101325};
  SensingChain chain(effects, 101325, true, rest, 5);
  double sum = 0;
  constexpr int n = 60000;
  for (int k = 0; k < n; ++k) {
    for (int i = 0; i < 10; ++i) chain.sample(101325, 101325);
    const double error = chain.read(1e-3 * k, rest).value[pressure_a_channel] - 101325;
    sum += error * error;
  }
  const double step = 2 * effects.pressure_span_pa / 8191;
  EXPECT_NEAR(std::sqrt(sum / n - step * step / 12), filtered_pressure_sigma_pa(effects), 8);
}

/// Experiments without noise, on the model's own equations: what is left is the estimators' own error.
TEST(Estimators, FindTheTruthOfANoiselessTwin) {
  TwinParameters twin = coverage_twin();
  twin.sensing.scale_noise(0.0);
  twin.sensing.converter_bits = 0;
  twin.valves.jitter_sigma_s = 0;
  twin.actuator.viscous_friction = 7.0;  // not where the search starts
  twin.actuator.energise_delay_s = 0.0053;
  twin.actuator.deenergise_delay_s = 0.0017;
  twin.actuator.supply_pressure_pa = 240000;
  twin.actuator.fill_coefficient *= 0.8;
  twin.actuator.discharge_coefficient *= 1.1;  // no longer continuous
  std::vector<Record> records;
  ExperimentSettings settings;
  for (Experiment e : shipped_experiments()) {
    if (e.name == "rest") continue;
    e.cycles = std::max(1, e.cycles / 5);
    records.push_back(simulate_experiment(e, twin, settings));
  }
  const Findings found = identify(records, ActuatorParameters{});
  for (const auto& [name, truth] : true_values(twin, settings.loaded_payload_kg)) {
    const Estimate* e = found.find(name);
    if (name.find("noise") != std::string::npos) continue;
    ASSERT_TRUE(e) << name;
    if (name.ends_with("delay_s"))
      EXPECT_NEAR(e->value, truth, 0.03e-3) << name;
    else
      EXPECT_NEAR(e->value / truth, 1.0, name == "viscous_friction" ? 0.02 : 0.01) << name;
  }
  EXPECT_THAT(found.remarks, testing::Contains(HasSubstr("is refused")));
}

TEST(Estimators, ThreeWayValvesToo) {
  TwinParameters twin = coverage_twin();
  std::vector<Record> records;
  ExperimentSettings settings;
  settings.valves = "three_way";
  for (const Experiment& e : shipped_experiments())
    if (e.name == "charge" || e.name == "edges" || e.name == "shuttle")
      records.push_back(simulate_experiment(e, twin, settings));
  const Findings found = identify(records, ActuatorParameters{});
  EXPECT_NEAR(found.find("energise_delay_s")->value, 0.004, 0.3e-3);
  EXPECT_NEAR(found.find("deenergise_delay_s")->value, 0.001, 0.3e-3);
  EXPECT_NEAR(found.find("fill_coefficient")->value / twin.actuator.fill_coefficient, 1.0, 0.01);
}

TEST(Estimators, ARampThatNeverMovesIsSaidAndNothingEstimated) {
  TwinParameters twin = coverage_twin();
  twin.actuator.static_friction_n = 20.0;
  Experiment e;
  for (const Experiment& one : shipped_experiments())
    if (one.name == "breakaway") e = one;
  e.cycles = 1;
  const Findings found = identify({simulate_experiment(e, twin, {})}, ActuatorParameters{});
  EXPECT_EQ(found.find("static_friction_n"), nullptr);
  EXPECT_THAT(found.remarks, testing::Contains(HasSubstr("did not move")));
}

TEST(ParameterFile, IsReadBackAndLeavesOutWhatTheModelRefuses) {
  Findings found;
  found.estimates = {make_estimate("coulomb_friction_n", "N", 1.25, 0.01, 50, ""),
                     make_estimate("viscous_friction", "N s/m", -3.0, 1.0, 50, ""),
                     make_estimate("inferred_equivalent_mass_kg", "kg", 14.25, 0.1, 50, ""),
                     make_estimate("position_noise_m", "m", 2e-5, 1e-7, 50, "")};
  for (std::size_t i = 0; i < 3; ++i) found.estimates[i].parameter = true;
  const std::string text = parameter_file(found, "printed", "a test");
  EXPECT_THAT(text, HasSubstr("left out"));
  TableReader table = TableReader::from_text(text, "identified.toml");
  const ActuatorParameters p = read_parameters(table);
  EXPECT_DOUBLE_EQ(p.coulomb_friction_n, 1.25);
  EXPECT_DOUBLE_EQ(p.viscous_friction, 4.5);
  EXPECT_DOUBLE_EQ(p.equivalent_mass_kg(), 14.25);
  EXPECT_DOUBLE_EQ(p.choked_flow, 0.0061);
  EXPECT_DOUBLE_EQ(identified_parameters(found, named_parameters("printed")).coulomb_friction_n, 1.25);
}

TEST(LogSource, ARecordComesBackFromItsCsv) {
  Experiment e;
  for (const Experiment& one : shipped_experiments())
    if (one.name == "breakaway") e = one;
  e.cycles = 1;
  const Record r = simulate_experiment(e, coverage_twin(), {});
  const Record back = records_from_csv(record_csv(r), "r.csv", {}).records.at(0);
  EXPECT_EQ(back.name, r.name);
  EXPECT_EQ(back.plane, r.plane);
  EXPECT_EQ(back.position_m, r.position_m);
  EXPECT_EQ(back.coils, r.coils);
  ASSERT_EQ(back.spans.size(), r.spans.size());
  for (std::size_t i = 0; i < r.spans.size(); ++i) {
    EXPECT_EQ(back.spans[i].label, r.spans[i].label);
    EXPECT_EQ(back.spans[i].first, r.spans[i].first);
    EXPECT_EQ(back.spans[i].last, r.spans[i].last);
  }
}

TEST(LogSource, ColumnsAreNamedScaledAndBroughtToEvenTimes) {
  std::string text = "t,y_mm,a,b,u,valves\n";
  for (int k = 0; k < 400; ++k)
    if (k != 100) text += std::to_string(0.001 * k) + "," + std::to_string(50 + 0.01 * k) + ",101,102,1.5,3\n";
  LogSettings settings;
  settings.columns = {"time_s=t",  "position_m=y_mm*1e-3", "pressure_a_pa=a*1000", "pressure_b_pa=b*1000",
                      "motor_n=u", "coils=valves"};
  const Record r = records_from_csv(text, "x.csv", settings).records.at(0);
  ASSERT_EQ(r.size(), 400u);
  EXPECT_EQ(r.filled, 1u);
  EXPECT_NEAR(r.position_m[100], 0.051, 1e-9);
  EXPECT_DOUBLE_EQ(r.pressure_b_pa[0], 102000);
  EXPECT_EQ(r.coils[5], 3u);
}

TEST(LogSource, WhatIsWrongIsNamed) {
  const auto complaint = [](const std::string& text, const std::vector<std::string>& columns = {}) -> std::string {
    LogSettings settings;
    settings.columns = columns;
    try {
      records_from_csv(text, "x.csv", settings);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "accepted";
  };
  const std::string heading = "time_s,position_m,pressure_a_pa,pressure_b_pa,motor_n,coils\n";
  EXPECT_THAT(complaint("a,b\n"), HasSubstr("no column 'time_s'"));
  EXPECT_THAT(complaint(heading, {"speed=x"}), HasSubstr("speed=x"));
  EXPECT_THAT(complaint(heading, {"time_s=t*fast"}), HasSubstr("'fast' is no number"));
  EXPECT_THAT(complaint(heading + "0,1,2,x,4,5\n"), HasSubstr("x.csv:2: column 'pressure_b_pa': 'x'"));
  EXPECT_THAT(complaint(heading + "0,1,2,3,4\n"), HasSubstr("5 cells"));
  EXPECT_THAT(complaint(heading + "0,1,2,3,4,0\n0,1,2,3,5,0\n"), HasSubstr("times that increase"));
  EXPECT_THAT(complaint(heading + "0,1,2,3,4,0.5\n"), HasSubstr("coils"));
  EXPECT_THAT(complaint(heading + "0,1,2,3,4,0\n"), HasSubstr("at least 200"));
}

TEST(Experiments, WhatCannotBeIsRefusedByKey) {
  const auto complaint = [](const std::string& text) -> std::string {
    try {
      TableReader table = TableReader::from_text(text, "e.toml");
      read_experiments(table);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(complaint(""), HasSubstr("experiment"));
  EXPECT_THAT(complaint("[[experiment]]\nname = 'x'\n"), HasSubstr("step"));
  EXPECT_THAT(complaint("[[experiment]]\nname = 'x'\nstep = [{ a = 'open', seconds = 1 }]\n"), HasSubstr("blocked"));
  EXPECT_THAT(complaint("[[experiment]]\nname = 'x'\nstep = [{ motor_n = 9.0, seconds = 1 }]\n"), HasSubstr("motor_n"));
  EXPECT_THAT(complaint("[[experiment]]\nname = 'x'\nstep = [{ hold_m = 0.05, to_m = 0.06, speed_m_s = 0.1 }]\n"),
              HasSubstr("one of them"));
  EXPECT_THAT(complaint("[[experiment]]\nname = 'x'\ncycles = 5000\nstep = [{ seconds = 2 }]\n"), HasSubstr("hour"));
  Experiment blocked;
  blocked.name = "x";
  blocked.steps.resize(1);
  blocked.steps[0].a = ChamberAction::blocked;
  blocked.steps[0].seconds = 0.1;
  ExperimentSettings three_way;
  three_way.valves = "three_way";
  EXPECT_THROW(simulate_experiment(blocked, coverage_twin(), three_way), ConfigError);
}

TEST(CoverageStudy, IntervalsHoldTheTruthAndValuesAreNear) {
  CoverageSettings settings;
  settings.seeds = 6;
  settings.first_seed = 1001;
  settings.jobs = 2;
  const CoverageStudy study = study_coverage(
      settings, [](int) {}, [] { return false; });
  EXPECT_EQ(study.failed, 0);
  ASSERT_EQ(study.rows.size(), 17u);
  int covered = 0, all = 0;
  for (const CoverageRow& row : study.rows) {
    EXPECT_EQ(row.runs, 6) << row.name;
    EXPECT_GE(row.near, 5) << row.name;
    EXPECT_GE(row.covered, 4) << row.name;  // below: 0.2 % by chance at 95 %
    covered += row.covered;
    all += row.runs;
  }
  EXPECT_GE(covered, 0.88 * all);
}

}  // namespace
}  // namespace solenoid
