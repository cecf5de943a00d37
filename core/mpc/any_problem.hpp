#pragma once

#include "core/mpc/mode_set.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <numeric>
#include <span>
#include <typeindex>
#include <utility>
#include <vector>

namespace solenoid {

/// Problems and plans of whatever model. Solvers that predict know the model's type (problem.hpp, plan.hpp); whoever
/// stands around them, a thread, a recorder, a file, knows a problem and a plan as these.

/// The prediction grid: `blocks` holds the length, in model steps of dt_s, of each block in which the mode is held.
struct Horizon {
  double dt_s = 0.001;
  std::vector<int> blocks;

  /// The model steps of all blocks, N.
  int steps() const { return std::accumulate(blocks.begin(), blocks.end(), 0); }
};

/// What a rounded plan keeps of the relaxed one that it comes from: there the next solve starts.
/// shapes   weights: blocks x modes, block-major, convex combinations    owed: blocks
struct Relaxation {
  bool known = false;  ///< whether the rest says anything; solvers that relax nothing leave it false
  std::vector<double> weights;
  /// By how many steps each switch has been on for less than the relaxation wanted, as the block begins.
  std::vector<SwitchStates<double>> owed;
  /// The sum of that over the steps before the block: the second state of a modulator of second order.
  std::vector<SwitchStates<double>> owed_sum;
};

/// A plan of some model.
class AnyPlan {
 public:
  std::vector<int> modes;  ///< one a block
  Relaxation relaxation;

  virtual ~AnyPlan() = default;
  /// A copy.
  virtual std::unique_ptr<AnyPlan> clone() const = 0;
  /// Becomes a copy of a plan of the same model; allocates nothing if the shapes are equal, too.
  virtual void assign(const AnyPlan& other) noexcept = 0;
  /// Makes room for so many blocks.
  virtual void resize(std::size_t blocks) = 0;
  /// The continuous inputs, blocks x inputs, block-major.
  virtual std::span<double> inputs() noexcept = 0;
  /// The same, to be read.
  virtual std::span<const double> inputs() const noexcept = 0;

 protected:
  AnyPlan() = default;
  AnyPlan(const AnyPlan&) = default;
  AnyPlan(AnyPlan&&) noexcept = default;
  AnyPlan& operator=(const AnyPlan&) = default;
  AnyPlan& operator=(AnyPlan&&) noexcept = default;
};

/// The sizes of a model's vectors.
struct ModelSizes {
  std::size_t states = 0, switched = 0, inputs = 0, outputs = 0;
  std::size_t load = 0;  ///< 0: the model takes over nothing beyond its state
  bool operator==(const ModelSizes&) const = default;
};

/// A problem over some model. Its vectors are seen in a row, step-major.
class AnyProblem {
 public:
  ModeSet modes;
  Horizon horizon;
  DelayLines lines;
  /// The tick in which it begins: what was anticipated of a problem is of use for one that begins with it.
  std::int64_t begins = 0;
  /// Which of its mode sets this is, for a solver that was prepared for several (solver_bank.hpp); 0 else.
  int mode_set = 0;

  virtual ~AnyProblem() = default;
  /// A copy.
  virtual std::unique_ptr<AnyProblem> clone() const = 0;
  /// A plan sized for it: mode 0 and no continuous input in every block.
  virtual std::unique_ptr<AnyPlan> new_plan() const = 0;
  /// Copies what a controller changes from period to period: all but mode set and horizon. The other is of the same model
  /// and shape. No allocation.
  virtual void copy_conditions(const AnyProblem& from) noexcept = 0;

  /// Which model it is over.
  virtual std::type_index model_type() const noexcept = 0;
  /// Of its vectors.
  virtual ModelSizes sizes() const noexcept = 0;
  /// The state that the prediction begins at: states.
  virtual std::span<double> initial_values() noexcept = 0;
  /// The same, to be read.
  virtual std::span<const double> initial_values() const noexcept = 0;
  /// Desired outputs, steps x outputs.
  virtual std::span<double> reference_values() noexcept = 0;
  /// The same, to be read.
  virtual std::span<const double> reference_values() const noexcept = 0;
  /// What a law inside the prediction tracks, steps x outputs; empty without one.
  virtual std::span<double> setpoint_values() noexcept = 0;
  /// The same, to be read.
  virtual std::span<const double> setpoint_values() const noexcept = 0;
  /// Bounds of the continuous inputs: inputs.
  virtual std::span<const double> input_lower() const noexcept = 0;
  /// The upper ones.
  virtual std::span<const double> input_upper() const noexcept = 0;
  /// What the model takes over beyond its state, into sizes().load numbers.
  virtual void get_load(std::span<double> into) const noexcept = 0;
  /// Makes the model believe it.
  virtual void set_load(std::span<const double> load) noexcept = 0;

 protected:
  /// Throws std::invalid_argument, naming the part.
  AnyProblem(ModeSet mode_set, Horizon grid, std::size_t switched_size);
  AnyProblem(const AnyProblem&) = default;
  AnyProblem(AnyProblem&&) noexcept = default;
  AnyProblem& operator=(const AnyProblem&) = default;
  AnyProblem& operator=(AnyProblem&&) noexcept = default;
};

/// A plan or problem held by value: a copy of this is a copy of it.
template <class Any>
class Held {
 public:
  /// Holds nothing.
  Held() = default;
  /// Holds a copy.
  explicit Held(const Any& value) : value_(value.clone()) {}
  /// Takes it over.
  explicit Held(std::unique_ptr<Any> value) : value_(std::move(value)) {}
  Held(const Held& other) : value_(other.value_ ? other.value_->clone() : nullptr) {}
  Held(Held&&) noexcept = default;
  Held& operator=(const Held& other) {
    if (this != &other) value_ = other.value_ ? other.value_->clone() : nullptr;
    return *this;
  }
  Held& operator=(Held&&) noexcept = default;
  ~Held() = default;

  explicit operator bool() const noexcept { return value_ != nullptr; }
  Any& operator*() noexcept { return *value_; }
  const Any& operator*() const noexcept { return *value_; }
  Any* operator->() noexcept { return value_.get(); }
  const Any* operator->() const noexcept { return value_.get(); }

 private:
  std::unique_ptr<Any> value_;
};

/// Several numbers' rows in a row.
template <class Row>
std::span<double> in_a_row(std::vector<Row>& rows) noexcept {
  if constexpr (std::tuple_size_v<Row> == 0)
    return {};
  else
    return rows.empty() ? std::span<double>()
                        : std::span<double>(rows.front().data(), rows.size() * std::tuple_size_v<Row>);
}
/// The same, to be read.
template <class Row>
std::span<const double> in_a_row(const std::vector<Row>& rows) noexcept {
  return in_a_row(const_cast<std::vector<Row>&>(rows));
}

}  // namespace solenoid
