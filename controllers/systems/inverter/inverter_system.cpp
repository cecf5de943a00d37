#include "controllers/model_system.hpp"
#include "controllers/systems/inverter/inverter_variant.hpp"
#include "core/config/reader.hpp"
#include "core/systems/inverter/modes.hpp"
#include "core/systems/inverter/signals.hpp"

#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double unbounded = std::numeric_limits<double>::infinity();
constexpr double overcurrent = 1.5;  // of the rated current
constexpr double slew_margin = 1.5;  // for an inductance that is less than believed

std::vector<VariantKey> inverter_keys() {
  std::vector<VariantKey> keys;
  KeyGroup{keys, "estimation"}.add(
      "estimation.current_sigma_a",
      VariantKey::At<double>([](VariantConfig& v) -> double& { return inverter(v).current_sigma_a; }),
      Range::positive(), "A", "white noise of the current sensors");
  return keys;
}

class InverterSystem final : public ModelSystem<InverterLoad> {
 public:
  InverterSystem()
      : ModelSystem(inverter_description(),
                    {.mode_sets = inverter_configurations(),
                     .estimators = {{"kalman", "extended Kalman filter: currents measured, back-EMF found"}}}) {
    add_keys(inverter_keys());
  }

  /// What the field uses: one step ahead, every mode tried.
  VariantConfig defaults() const override {
    VariantConfig v;
    v.modes = "three_level";
    v.estimator = "kalman";
    v.horizon = {1, {}};
    v.cost.tracking = {1.0, 1.0};
    v.cost.switching = 600.0;
    return v;
  }
  void read(TableReader& table, VariantConfig& v) const override {
    inverter(v).nominal = read_model_table(table, inverter(v).nominal, read_inverter);
  }
  /// The task's frequency of the electromotive force [Hz].
  void tell(VariantConfig& v, const std::string& setting) const override {
    if (setting.empty()) return;
    double& frequency_hz = inverter(v).nominal.emf_frequency_hz;
    const auto [end, error] = std::from_chars(setting.data(), setting.data() + setting.size(), frequency_hz);
    if (error != std::errc() || end != setting.data() + setting.size() || !std::isfinite(frequency_hz))
      throw ConfigError(fmt::format("setting '{}' of a task of the inverter (allowed: a frequency in Hz)", setting));
  }
  /// The model's coefficients are of one tick.
  void resample(VariantConfig& v) const override { inverter(v).nominal.sampling_s = v.timing.tick_s; }
  ModeSet own_modes(const VariantConfig& v) const override { return inverter_modes(v.modes, inverter(v).nominal); }
  InverterLoad model(const VariantConfig& v) const override { return InverterLoad(inverter(v).nominal); }
  /// Currents up to what is an overcurrent, and the electromotive force at its amplitude, whatever its angle.
  std::vector<StateRange> state_ranges(const VariantConfig& v) const override {
    const double most = overcurrent * inverter(v).nominal.rated_current_a, emf = inverter(v).nominal.emf_amplitude_v;
    return {{-most, most}, {-most, most}, {-emf, emf}, {-emf, emf}};
  }
  KalmanSetup<InverterLoad> filter(const VariantConfig& v) const override {
    const InverterParameters& p = inverter(v).nominal;
    KalmanSetup<InverterLoad> setup;
    for (std::size_t k = 0; k < 2; ++k)
      setup.channels.push_back(KalmanChannel<InverterLoad>::of(k, inverter(v).current_sigma_a));
    setup.process_sigma = {50.0, 50.0, 500.0, 500.0};
    setup.start_sigma = {p.rated_current_a, p.rated_current_a, p.emf_amplitude_v, p.emf_amplitude_v};
    return setup;
  }
  Vector<double, 4> rest() const override { return {100.0, 100.0, unbounded, unbounded}; }
  /// Half as much again as the rated current is an overcurrent. No current moves faster than the whole link and the
  /// electromotive force together drive it through the inductance; a sensor's noise comes on top.
  LadderSettings ladder(const VariantConfig& v) const override {
    LadderSettings settings;
    const InverterParameters& p = inverter(v).nominal;
    const double rated = p.rated_current_a, sigma = inverter(v).current_sigma_a;
    const double most = (2.0 / 3.0 * p.dc_link_v + p.emf_amplitude_v) / p.inductance_h * v.timing.tick_s;
    const double slew = slew_margin * most + 10.0 * sigma;
    const double shorted =
        p.emf_amplitude_v / std::hypot(p.resistance_ohm, 2 * std::numbers::pi * p.emf_frequency_hz * p.inductance_h);
    const double range = 2.0 * rated + 2.0 * shorted;  // with what remains of a direct current in a short circuit
    const SensorBounds current{-range, range, -1.5 * range, 1.5 * range, 1.0, slew, sigma};
    settings.plausibility.channels = {current, current};
    settings.limits = {{.low = -overcurrent * rated, .high = overcurrent * rated},
                       {.low = -overcurrent * rated, .high = overcurrent * rated}};
    settings.needed_to_stop = {0, 1};
    return settings;
  }
};

}  // namespace

System& inverter_system();
System& inverter_system() {
  static InverterSystem system;
  return system;
}

}  // namespace solenoid
