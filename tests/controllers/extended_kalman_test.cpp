#include "controllers/estimators/extended_kalman.hpp"

#include "core/systems/actuator/dynamics.hpp"
#include "core/systems/actuator/signals.hpp"
#include "tests/support/double_integrator.hpp"
#include "tests/support/lotka_volterra.hpp"
#include "tests/support/uniform.hpp"

#include <random>

#include <Eigen/Dense>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using Integrator = DoubleIntegrator;
using Fishing = LotkaVolterraFishing;

constexpr double missing_value = std::numeric_limits<double>::quiet_NaN();
constexpr double without_gate = std::numeric_limits<double>::infinity();

double draw_normal(std::mt19937_64& random) { return std::normal_distribution<double>()(random); }

/// Three coupled states, linear: x+ = x + dt (A x + b s + c u).
struct CoupledStates {
  static constexpr std::size_t state_size = 3, switched_size = 1, continuous_size = 1, output_size = 1;
  static inline const Eigen::Matrix3d a{{-1.0, 2.0, 0.3}, {-2.0, -0.5, 1.0}, {0.4, -0.7, 0.2}};

  template <class S>
  Vector<S, 3> step(const Vector<S, 3>& x, const Vector<S, 1>& s, const Vector<S, 1>& u, double dt) const {
    Vector<S, 3> next = x;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        next[static_cast<std::size_t>(i)] =
            next[static_cast<std::size_t>(i)] + S(dt * a(i, j)) * x[static_cast<std::size_t>(j)];
    next[1] = next[1] + S(dt) * s[0];
    next[2] = next[2] + S(2 * dt) * u[0];
    return next;
  }
  template <class S>
  Vector<S, 1> output(const Vector<S, 3>& x) const {
    return {x[0]};
  }
};

/// Two channels that are late by 3 ticks and by 1 beside a prompt one; a disturbance that enters states and a channel.
KalmanSetup<CoupledStates> coupled_setup() {
  KalmanSetup<CoupledStates> setup;
  setup.channels = {KalmanChannel<CoupledStates>{.states = {1.0, 0.5, 0.0}, .offset = 0.7, .sigma = 0.1},
                    KalmanChannel<CoupledStates>{.states = {0, 0, 1}, .sigma = 0.05, .quantum = 0.2, .delay_ticks = 3},
                    KalmanChannel<CoupledStates>{.states = {0.0, 1.0, -1.0}, .sigma = 0.3, .delay_ticks = 1}};
  setup.disturbances = {{.states = {0.0, 1.0, 0.5}, .channels = {0.0, 0.8, 0.0}, .sigma = 0.6, .memory_s = 2.0}};
  setup.process_sigma = {0.1, 0.2, 0.05};
  setup.start = {0.5, -1.0, 0.2}, setup.start_sigma = {1.0, 0.5, 2.0};
  return setup;
}

/// The textbook's filter of the system augmented with whole past states: z[k] = (c[k], c[k-1], c[k-2], c[k-3]) with
/// c = (x, d), all channels of a tick at once.
class TextbookFilter {
 public:
  TextbookFilter(const KalmanSetup<CoupledStates>& setup, double dt) : setup_(setup), dt_(dt) {
    mean_.head<3>() << setup.start[0], setup.start[1], setup.start[2];
    for (int i = 0; i < 3; ++i) p_(i, i) = std::pow(setup.start_sigma[static_cast<std::size_t>(i)], 2);
    p_(3, 3) = std::pow(setup.disturbances[0].sigma, 2);
    a_.block<3, 3>(0, 0) = Eigen::Matrix3d::Identity() + dt * CoupledStates::a;
    for (int i = 0; i < 3; ++i) a_(i, 3) = dt * setup.disturbances[0].states[static_cast<std::size_t>(i)];
    const double kept = std::exp(-dt / setup.disturbances[0].memory_s);
    a_(3, 3) = kept;
    a_.block<12, 12>(4, 0).setIdentity();
    for (int i = 0; i < 3; ++i) q_(i, i) = dt * std::pow(setup.process_sigma[static_cast<std::size_t>(i)], 2);
    q_(3, 3) = std::pow(setup.disturbances[0].sigma, 2) * (1 - kept * kept);
  }
  void predict(double s, double u) {
    mean_ = (a_ * mean_).eval();
    mean_[1] += dt_ * s, mean_[2] += 2 * dt_ * u;
    p_ = a_ * p_ * a_.transpose() + q_;
    ++tick_;
  }
  /// Returns the normalised innovation squared.
  double correct(const std::array<double, 3>& measured) {
    std::vector<int> seen;
    for (int c = 0; c < 3; ++c)
      if (std::isfinite(measured[static_cast<std::size_t>(c)]) && tick_ >= channel(c).delay_ticks) seen.push_back(c);
    const int m = static_cast<int>(seen.size());
    Eigen::MatrixXd h = Eigen::MatrixXd::Zero(m, 16), r = Eigen::MatrixXd::Zero(m, m);
    Eigen::VectorXd innovation(m);
    for (int i = 0; i < m; ++i) {
      const int c = seen[static_cast<std::size_t>(i)], at = 4 * channel(c).delay_ticks;
      for (int j = 0; j < 3; ++j) h(i, at + j) = channel(c).states[static_cast<std::size_t>(j)];
      h(i, at + 3) = setup_.disturbances[0].channels[static_cast<std::size_t>(c)];
      r(i, i) = std::pow(channel(c).sigma, 2) + std::pow(channel(c).quantum, 2) / 12;
      innovation[i] = measured[static_cast<std::size_t>(c)] - channel(c).offset - h.row(i).dot(mean_);
    }
    const Eigen::MatrixXd s = h * p_ * h.transpose() + r, gain = p_ * h.transpose() * s.inverse();
    mean_ += gain * innovation;
    p_ = ((Eigen::MatrixXd::Identity(16, 16) - gain * h) * p_).eval();
    return m == 0 ? 0.0 : innovation.dot(s.inverse() * innovation);
  }
  Eigen::Vector4d mean() const { return mean_.head<4>(); }
  Eigen::Matrix4d covariance() const { return p_.topLeftCorner<4, 4>(); }

 private:
  const KalmanChannel<CoupledStates>& channel(int c) const { return setup_.channels[static_cast<std::size_t>(c)]; }

  KalmanSetup<CoupledStates> setup_;
  double dt_;
  int tick_ = 0;
  Eigen::VectorXd mean_ = Eigen::VectorXd::Zero(16);
  Eigen::MatrixXd a_ = Eigen::MatrixXd::Zero(16, 16), q_ = a_, p_ = a_;
};

TEST(ExtendedKalmanFilter, IsTheTextbooksForALinearModelWithDelayedAndMissingValues) {
  constexpr double dt = 0.02;
  KalmanSetup<CoupledStates> setup = coupled_setup();
  setup.gate_sigmas = without_gate;
  ExtendedKalman<CoupledStates> filter({}, setup, dt);
  TextbookFilter textbook(setup, dt);
  std::mt19937_64 random(11);
  for (int k = 0; k < 500; ++k) {
    std::array<double, 3> measured;
    for (double& value : measured) value = uniform(random, 0, 1) < 0.2 ? missing_value : draw_normal(random);
    if (k % 50 == 49) measured.fill(missing_value);
    const auto state = filter.update(measured);
    const double nis = textbook.correct(measured);
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(state[static_cast<std::size_t>(i)], textbook.mean()[i], 1e-10) << k;
    EXPECT_NEAR(filter.disturbance(0), textbook.mean()[3], 1e-10) << k;
    EXPECT_LT((filter.covariance() - textbook.covariance()).cwiseAbs().maxCoeff(), 1e-10) << k;
    EXPECT_NEAR(filter.innovation(), nis, 1e-9 * (1 + nis)) << k;
    const double s = k / 7 % 2, u = draw_normal(random);
    filter.applied({s}, {u});
    textbook.predict(s, u);
  }
  EXPECT_EQ(filter.starts(), 1);
}

/// Quantile of chi-square over its degrees of freedom (Wilson and Hilferty 1931); z the normal quantile.
double chi_square_share(double degrees, double z) {
  const double a = 2.0 / (9.0 * degrees);
  return std::pow(1.0 - a + z * std::sqrt(a), 3);
}
constexpr double z_of_999_in_1000 = 3.2905;  // two-sided

/// What a filter says of its errors over many worlds drawn from its own beliefs.
struct KalmanConsistency {
  double nees = 0.0, nis = 0.0;  ///< sums
  int states = 0, values = 0;    ///< their degrees of freedom

  void expect_chi_square() const {
    for (const auto& [sum, degrees] : {std::pair{nees, states}, std::pair{nis, values}}) {
      EXPECT_GT(sum / degrees, chi_square_share(degrees, -z_of_999_in_1000));
      EXPECT_LT(sum / degrees, chi_square_share(degrees, z_of_999_in_1000));
    }
    std::printf("NEES %.4f of 1 (%d degrees), NIS %.4f of 1 (%d degrees)\n", nees / states, states, nis / values,
                values);
  }
};

/// Runs of `ticks` ticks. Each run's last error counts, since errors of one run are not independent; innovations of a
/// run are, so that all count.
template <HybridModel M>
KalmanConsistency kalman_consistency(const KalmanSetup<M>& setup, double dt, int runs, int ticks) {
  constexpr int n = M::state_size;
  const int size = n + static_cast<int>(setup.disturbances.size());
  KalmanConsistency total;
  for (int run = 0; run < runs; ++run) {
    std::mt19937_64 random(static_cast<std::uint64_t>(run) + 1);
    StateOf<M> x = setup.start;
    for (std::size_t i = 0; i < M::state_size; ++i) x[i] += setup.start_sigma[i] * draw_normal(random);
    std::vector<double> d;
    for (const auto& belief : setup.disturbances) d.push_back(belief.sigma * draw_normal(random));
    ExtendedKalman<M> filter({}, setup, dt);
    std::vector<std::vector<double>> shown;  // at each tick, what a prompt channel without noise would show
    for (int k = 0; k < ticks; ++k) {
      std::vector<double> now, measured;
      for (std::size_t c = 0; c < setup.channels.size(); ++c) {
        now.push_back(setup.channels[c].offset);
        for (std::size_t i = 0; i < M::state_size; ++i) now[c] += setup.channels[c].states[i] * x[i];
        for (std::size_t i = 0; i < d.size(); ++i) now[c] += setup.disturbances[i].channels[c] * d[i];
      }
      shown.push_back(now);
      for (std::size_t c = 0; c < setup.channels.size(); ++c) {
        const int from = k - setup.channels[c].delay_ticks;
        const double noise = std::sqrt(setup.channels[c].variance()) * draw_normal(random);
        measured.push_back(from < 0 ? missing_value : shown[static_cast<std::size_t>(from)][c] + noise);
        total.values += from >= 0;
      }
      filter.update(measured);
      total.nis += filter.innovation();
      if (k + 1 == ticks) break;
      const SwitchedOf<M> s = {double(k / 10 % 2)};
      filter.applied(s, {});
      x = M().template step<double>(x, s, {}, dt);
      for (std::size_t j = 0; j < M::state_size; ++j) {
        for (std::size_t i = 0; i < d.size(); ++i) x[j] += dt * setup.disturbances[i].states[j] * d[i];
        x[j] += std::sqrt(dt) * setup.process_sigma[j] * draw_normal(random);
      }
      for (std::size_t i = 0; i < d.size(); ++i)
        d[i] =
            setup.disturbances[i].kept(dt) * d[i] + std::sqrt(setup.disturbances[i].renewed(dt)) * draw_normal(random);
    }
    Eigen::VectorXd error(size);
    const StateOf<M> believed = filter.state();
    for (int i = 0; i < n; ++i) error[i] = believed[static_cast<std::size_t>(i)] - x[static_cast<std::size_t>(i)];
    for (int i = n; i < size; ++i)
      error[i] = filter.disturbance(static_cast<std::size_t>(i - n)) - d[static_cast<std::size_t>(i - n)];
    total.nees += error.dot(filter.covariance().ldlt().solve(error));
    total.states += size;
    EXPECT_EQ(filter.starts(), 1);
  }
  return total;
}

TEST(ExtendedKalmanFilter, ErrorsAndInnovationsOfALinearModelAreChiSquareAt999InAThousand) {
  KalmanSetup<CoupledStates> setup = coupled_setup();
  setup.gate_sigmas = without_gate;
  kalman_consistency<CoupledStates>(setup, 0.02, 300, 120).expect_chi_square();
}

KalmanSetup<Fishing> fishing_setup() {
  KalmanSetup<Fishing> setup;
  setup.channels = {KalmanChannel<Fishing>::of(0, 0.01), KalmanChannel<Fishing>::of(1, 0.01, 0.0, 4)};
  setup.disturbances = {{.states = {0.0, 1.0}, .sigma = 0.02}, {.states = {1.0, 0.0}, .sigma = 0.02, .memory_s = 1.0}};
  setup.process_sigma = {0.01, 0.01};
  setup.start = {0.9, 0.8}, setup.start_sigma = {0.02, 0.02};
  return setup;
}

TEST(ExtendedKalmanFilter, ErrorsAndInnovationsOfLotkaVolterraAreChiSquareAt999InAThousand) {
  KalmanSetup<Fishing> setup = fishing_setup();
  setup.gate_sigmas = without_gate;
  kalman_consistency<Fishing>(setup, 0.05, 300, 200).expect_chi_square();
}

/// Expects that the filter's Jacobian is that of central differences of `step`.
template <HybridModel M, class Step>
void expect_kalman_jacobian(const M& model, const KalmanSetup<M>& setup, const StateOf<M>& x, const SwitchedOf<M>& s,
                            const ContinuousOf<M>& u, double dt, const StateOf<M>& nudge, const Step& step) {
  CoreMatrix<M> f;
  linearise_core(model, setup, x, s, u, dt, f);
  for (std::size_t j = 0; j < M::state_size; ++j) {
    StateOf<M> up = x, down = x;
    up[j] += nudge[j], down[j] -= nudge[j];
    const StateOf<M> a = step(up), b = step(down);
    for (std::size_t i = 0; i < M::state_size; ++i) {
      const double exact = f(static_cast<int>(i), static_cast<int>(j));
      EXPECT_NEAR(exact, (a[i] - b[i]) / (2 * nudge[j]),
                  1e-5 * std::abs(exact) + 1e-9 * std::abs(x[i]) / nudge[j] + 1e-9)
          << i << "," << j;
    }
  }
  for (int i = 0; i < f.rows(); ++i)
    for (int j = int{M::state_size}; j < f.cols(); ++j) {
      const KalmanDisturbance<M>& d = setup.disturbances[static_cast<std::size_t>(j) - M::state_size];
      const bool state = i < int{M::state_size};
      EXPECT_EQ(f(i, j), state ? dt * d.states[static_cast<std::size_t>(i)] : i == j ? d.kept(dt) : 0.0);
    }
}

KalmanSetup<PneumaticActuator> actuator_setup() {
  KalmanSetup<PneumaticActuator> setup;
  setup.channels = {KalmanChannel<PneumaticActuator>::of(position, 0.03e-3, 0.02e-3),
                    KalmanChannel<PneumaticActuator>::of(pressure_a, 100.0, 0.0, 10),
                    KalmanChannel<PneumaticActuator>::of(pressure_b, 100.0, 0.0, 10)};
  setup.disturbances = {{.states = {0.0, 1.0}, .sigma = 2.0, .memory_s = 1.0}};
  setup.process_sigma = {0.0, 0.01, 5e3, 5e3};
  setup.start = {0.05, 0.0, 1.5e5, 1.5e5}, setup.start_sigma = {1e-3, 0.1, 1e4, 1e4};
  return setup;
}

TEST(ExtendedKalmanFilter, JacobiansAgreeWithFiniteDifferences) {
  std::mt19937_64 random(5);
  const PneumaticActuator actuator;
  for (int trial = 0; trial < 100; ++trial) {
    const double fleet = trial % 2, speed = uniform(random, 0.005, 0.4) * (trial % 3 ? 1 : -1);
    const StateOf<Fishing> stocks = {uniform(random, 0.3, 2), uniform(random, 0.3, 2)};
    expect_kalman_jacobian<Fishing>({}, fishing_setup(), stocks, {fleet}, {}, 0.1, {1e-5, 1e-5},
                                    [&](const auto& x) { return Fishing().step<double>(x, {fleet}, {}, 0.1); });
    const ActuatorState x = {uniform(random, 0.01, 0.1), speed, uniform(random, 1.4e5, 1.85e5),
                             uniform(random, 1.4e5, 1.85e5)};
    const Vector<double, 4> opening = trial % 2 ? Vector<double, 4>{1, 0, 0, 1} : Vector<double, 4>{0, 1, 1, 0};
    expect_kalman_jacobian<PneumaticActuator>(
        actuator, actuator_setup(), x, opening, {2.0}, actuator_timing.tick_s, {1e-6, 1e-6, 1.0, 1.0},
        [&](const auto& at) { return actuator.smooth_step<double>(at, opening, {2.0}, actuator_timing.tick_s); });
  }
}

TEST(ExtendedKalmanFilter, StartsAnewFromANonFiniteBelief) {
  ExtendedKalman<Fishing> filter({}, fishing_setup(), 0.05);
  const std::array<double, 2> measured = {0.9, 0.8};
  filter.update(measured);
  filter.applied({missing_value}, {});
  const auto restarted = filter.update(measured);
  EXPECT_EQ(filter.starts(), 2);
  EXPECT_NEAR(restarted[0], 0.9, 1e-9);
  filter.applied({0.0}, {});
  EXPECT_TRUE(std::isfinite(filter.update(measured)[1]));
  EXPECT_EQ(filter.starts(), 2);
  const std::array<double, 2> huge = {1e300, -1e300};  // finite; its square is not
  filter.update(huge);
  EXPECT_TRUE(std::isfinite(filter.state()[0]) && std::isfinite(filter.sigma()[0]));
}

TEST(ExtendedKalmanFilter, StartsAnewWhereAChannelContradictsItForLong) {
  KalmanSetup<Integrator> setup;
  setup.channels = {KalmanChannel<Integrator>::of(0, 0.01)};
  setup.start_sigma = {0.01, 0.01}, setup.restart_sigma = {10.0, 1.0};
  ExtendedKalman<Integrator> filter({}, setup, 0.01);
  const auto see = [&](double value) { return filter.update(std::span(&value, 1))[0]; };
  for (int k = 0; k < 20; ++k) EXPECT_NEAR(see(0.0), 0.0, 1e-12);
  const double before = filter.sigma()[0];
  EXPECT_LT(see(5.0), 6 * before);  // one value far off has the weight of five standard deviations
  for (int k = 0; k < 12; ++k) see(5.0);
  EXPECT_EQ(filter.starts(), 2);
  EXPECT_NEAR(see(5.0), 5.0, 0.05);
}

TEST(ExtendedKalmanFilter, AValueAtTheEndOfItsRangeSaysNoMoreThanThat) {
  KalmanSetup<Integrator> setup;
  setup.channels = {KalmanChannel<Integrator>::of(0, 0.1)};
  setup.channels[0].high = 1.0;
  setup.start = {2.0, 0.0}, setup.start_sigma = {0.5, 0.0};
  ExtendedKalman<Integrator> beyond({}, setup, 0.01);
  const double end = 1.0;
  EXPECT_EQ(beyond.update(std::span(&end, 1))[0], 2.0);
  EXPECT_EQ(beyond.innovation(), 0.0);
  setup.start[0] = 0.8;
  ExtendedKalman<Integrator> inside({}, setup, 0.01);
  EXPECT_GT(inside.update(std::span(&end, 1))[0], 0.9);
  setup.high[0] = 0.85;  // of the state
  EXPECT_EQ(ExtendedKalman<Integrator>({}, setup, 0.01).update(std::span(&end, 1))[0], 0.85);
}

TEST(ExtendedKalmanFilter, RefusesASetupByTheFieldsName) {
  const auto refusal = [](auto change) {
    KalmanSetup<Fishing> setup = fishing_setup();
    change(setup);
    try {
      ExtendedKalman<Fishing>({}, setup, 0.05);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const auto names = [&](auto change, const char* field) {
    EXPECT_NE(refusal(change).find(field), std::string::npos) << field << ": " << refusal(change);
  };
  EXPECT_EQ(refusal([](auto&) {}), "");
  names([](auto& s) { s.channels.clear(); }, "channels");
  names([](auto& s) { s.channels.resize(9, s.channels[0]); }, "channels");
  names([](auto& s) { s.channels[1].sigma = 0; }, "channel 1: sigma");
  names([](auto& s) { s.channels[1].delay_ticks = -1; }, "channel 1: delay_ticks");
  names([](auto& s) { s.channels[0].delay_ticks = 61; }, "delay_ticks");
  names([](auto& s) { s.channels[0].low = s.channels[0].high; }, "channel 0");
  names([](auto& s) { s.disturbances.resize(5); }, "disturbances");
  names([](auto& s) { s.disturbances[1].memory_s = 0; }, "disturbance 1: memory_s");
  names([](auto& s) { s.process_sigma[1] = missing_value; }, "state 1");
  names([](auto& s) { s.start[0] = missing_value; }, "state 0");
  names([](auto& s) { s.gate_sigmas = 0; }, "gate_sigmas");
  EXPECT_THROW(ExtendedKalman<Fishing>({}, fishing_setup(), 0.0), std::invalid_argument);
}

}  // namespace
}  // namespace solenoid
