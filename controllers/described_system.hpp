#pragma once

#include "controllers/model_system.hpp"
#include "core/system/description.hpp"

#include <algorithm>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace solenoid {

/// A system that is nothing but a model and what is said of it here: for systems from outside, written by hand or
/// generated. The model M is a HybridModel that can be made of its parameters, M(std::span<const double>), in the order
/// below; states, inputs and outputs have the order of the model's.
struct ModelDescription {
  static constexpr double infinity = std::numeric_limits<double>::infinity();

  /// A number of the model, as the table `model` of a variant and `plant` of a scenario may set it.
  struct Parameter {
    std::string name;
    double usual = 0.0;
    Range range{};
    std::string unit{}, meaning{};
  };
  /// A state of the model.
  struct State {
    std::string name, unit{}, meaning{};
    double start = 0.0;                       ///< of a scenario that does not say
    double low = -infinity, high = infinity;  ///< where the plant can be
    double process_sigma = 1e-3;              ///< change that the model does not know [unit/s^0.5]
    double rest = infinity;                   ///< up to this it counts as at rest
    std::string shown_unit{};                 ///< in which people read it; none: its unit
    double shown_scale = 1.0;                 ///< of them in one of the unit
  };
  /// A state with white noise, each tick.
  struct Channel {
    std::string state;
    double sigma = 1e-3;  ///< what the filter believes, and the noise of a scenario with noise
  };
  /// What is tracked, in the order of the model's outputs: a state, or one that is the rate of another.
  struct Output {
    std::string state;
    double weight = 1.0, terminal = 0.0;  ///< default weights of the squared error
    double target = 0.0;                  ///< the desired value where a scenario has no motion for it
    std::string rate_of{};                ///< the state whose rate this is; it must be an output before it
  };
  /// A continuous input.
  struct Input {
    std::string name, unit{};
    double most = 1.0;  ///< magnitude
    double weight = 0.0;
  };
  /// See ModeSet.
  struct Modes {
    std::string name;
    std::vector<Switch> switches;
    std::vector<Mode> modes;
    std::vector<double> offset;
    std::vector<std::vector<double>> gain;
    std::vector<SwitchPattern> one_at_a_time{};
    std::optional<SwitchPattern> safe{};
  };

  std::string name, summary;
  std::vector<State> states;
  std::vector<Parameter> parameters{};
  std::vector<Channel> channels{};  ///< none: every state, exactly enough
  std::vector<Output> outputs;
  std::vector<Input> inputs{};
  std::vector<Modes> mode_sets;  ///< the first is what a variant has that says none
  Signal consumption{};          ///< of a model with one
  Timing timing;
  int steps = 50;  ///< default horizon [ticks], and its blocks [periods]; none: one block
  std::vector<int> blocks{};
  double switching = 0.0;  ///< default weight of a switch change
};

/// What a variant of such a system says of its own.
struct DescribedVariant {
  std::vector<double> parameters, channel_sigma;
  bool operator==(const DescribedVariant&) const = default;
};

/// What of such a system knows no model's type.
class DescribedParts {
 public:
  /// Throws std::logic_error, naming what points to nothing.
  explicit DescribedParts(ModelDescription said);

  const ModelDescription& said() const { return said_; }
  const SystemDescription& system() const { return system_; }
  std::size_t state_of(const std::string& name) const;
  /// Parameters of their usual values, or what a table has in their place.
  std::vector<double> read_parameters(TableReader& table, std::vector<double> values) const;
  DescribedVariant usual() const;
  VariantConfig defaults() const;
  ModeSet modes(const std::string& name) const;
  std::vector<std::string> mode_sets() const;
  /// estimation.CHANNEL_sigma of each channel.
  std::vector<VariantKey> keys() const;
  LadderSettings ladder() const;

 private:
  ModelDescription said_;
  SystemDescription system_;
};

/// The System of a description.
template <HybridModel M>
class DescribedSystem final : private DescribedParts, public ModelSystem<M> {
 public:
  explicit DescribedSystem(ModelDescription said)
      : DescribedParts(std::move(said)),
        ModelSystem<M>(DescribedParts::system(),
                       {.mode_sets = DescribedParts::mode_sets(),
                        .estimators = {{"kalman", "extended Kalman filter over the measured states"}}}) {
    this->add_keys(DescribedParts::keys());
  }

  const DescribedParts& parts() const { return *this; }

  VariantConfig defaults() const override { return DescribedParts::defaults(); }
  void read(TableReader& table, VariantConfig& v) const override {
    DescribedVariant& own = v.own.as<DescribedVariant>();
    own.parameters = read_model_table(table, own.parameters,
                                      [&](TableReader& model) { return read_parameters(model, own.parameters); });
  }
  std::vector<double> continuous_limits(const VariantConfig&) const override {
    std::vector<double> most;
    for (const ModelDescription::Input& input : said().inputs) most.push_back(input.most);
    return most;
  }
  /// As the description has them.
  std::vector<StateRange> state_ranges(const VariantConfig&) const override {
    std::vector<StateRange> ranges;
    for (const ModelDescription::State& state : said().states) ranges.push_back({state.low, state.high});
    return ranges;
  }
  LadderSettings ladder(const VariantConfig&) const override { return DescribedParts::ladder(); }
  M model(const VariantConfig& v) const override {
    return M(std::span<const double>(v.own.as<DescribedVariant>().parameters));
  }
  KalmanSetup<M> filter(const VariantConfig& v) const override {
    const DescribedVariant& own = v.own.as<DescribedVariant>();
    KalmanSetup<M> setup;
    for (std::size_t c = 0; c < said().channels.size(); ++c)
      setup.channels.push_back(KalmanChannel<M>::of(state_of(said().channels[c].state), own.channel_sigma[c]));
    for (std::size_t i = 0; i < M::state_size; ++i) {
      const ModelDescription::State& state = said().states[i];
      setup.process_sigma[i] = state.process_sigma;
      setup.start[i] = state.start;
      setup.start_sigma[i] = 0.1 * std::max(1.0, std::abs(state.start));
      setup.low[i] = state.low;
      setup.high[i] = state.high;
    }
    return setup;
  }
  StateOf<M> rest() const override {
    StateOf<M> rest;
    for (std::size_t i = 0; i < M::state_size; ++i) rest[i] = said().states[i].rest;
    return rest;
  }

 protected:
  ModeSet own_modes(const VariantConfig& v) const override { return DescribedParts::modes(v.modes); }
};

}  // namespace solenoid
