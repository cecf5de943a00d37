#pragma once

#include "core/rt/controller.hpp"

#include <memory>
#include <span>
#include <utility>

namespace solenoid {

/// The estimator of a variant, of whatever kind: measurements in each tick, the inputs in effect until the next one
/// afterwards. A kind has the three functions below; the catalogue has a row for each.
/// promise  update, applied, detail: no allocation, lock or exception
class Estimator {
 public:
  /// Of a kind; allocates.
  template <class Kind>
  explicit Estimator(Kind kind) : kind_(std::make_unique<Of<Kind>>(std::move(kind))) {}

  /// Takes a tick's measurement and returns the state estimate. NaN stands for a value that is missing.
  StateValues update(const Measurement& measured) noexcept { return kind_->update(measured); }
  /// Tells which switched inputs (a point of the mode set) and continuous inputs act until the next tick.
  void applied(std::span<const double> switched, const ContinuousValues& continuous) noexcept {
    kind_->applied(switched, continuous);
  }
  /// What is believed beyond the state, and how well.
  EstimateDetail detail() const noexcept { return kind_->detail(); }

 private:
  struct Any {
    virtual ~Any() = default;
    virtual StateValues update(const Measurement& measured) noexcept = 0;
    virtual void applied(std::span<const double> switched, const ContinuousValues& continuous) noexcept = 0;
    virtual EstimateDetail detail() const noexcept = 0;
  };
  template <class Kind>
  struct Of final : Any {
    explicit Of(Kind k) : kind(std::move(k)) {}
    StateValues update(const Measurement& measured) noexcept override { return kind.update(measured); }
    void applied(std::span<const double> switched, const ContinuousValues& continuous) noexcept override {
      kind.applied(switched, continuous);
    }
    EstimateDetail detail() const noexcept override { return kind.detail(); }
    Kind kind;
  };

  std::unique_ptr<Any> kind_;
};

}  // namespace solenoid
