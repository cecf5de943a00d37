#pragma once

#include "solvers/learned/best_sequences.hpp"
#include "solvers/learned/mlp.hpp"
#include "solvers/learned/problem_features.hpp"
#include "solvers/search/proposer.hpp"

#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace solenoid {

/// The kind of network that gives a score to each mode in each block.
inline constexpr const char* policy_kind = "policy";

/// Throws std::invalid_argument, saying what does not fit, for a network of another kind or of other features.
inline void require_fitting(const MlpData& network, const std::string& kind, const std::string& layout) {
  if (network.kind != kind) throw std::invalid_argument(fmt::format("is of kind '{}', not '{}'", network.kind, kind));
  if (network.layout != layout)
    throw std::invalid_argument(fmt::format("was taught on '{}', and here is '{}'", network.layout, layout));
}

/// A network proposes: its output for block b and label l is the score of the mode that commands pattern labels[l].
/// Modes that it does not know are never proposed, patterns that are no modes here are passed over; so it may serve
/// what is left of its mode set.
template <HybridModel M>
class NetworkProposer final : public Proposer<M> {
 public:
  explicit NetworkProposer(std::shared_ptr<const Mlp> network) : network_(std::move(network)) {}

  void prepare(const Problem<M>& problem) override {
    features_.prepare(problem);
    require_fitting(network_->data(), policy_kind, features_.layout());
    blocks_ = problem.horizon.blocks.size();
    const std::vector<int>& labels = network_->data().labels;
    if (network_->features() != features_.size() || network_->outputs() != blocks_ * labels.size())
      throw std::invalid_argument("has not a score for each block and label, or other features than it says");
    label_.clear();
    mode_.clear();
    for (std::size_t l = 0; l < labels.size(); ++l)
      if (const int mode = problem.modes.find(static_cast<SwitchPattern>(labels[l])); mode >= 0) {
        label_.push_back(l);
        mode_.push_back(static_cast<std::uint16_t>(mode));
      }
    if (mode_.empty()) throw std::invalid_argument(fmt::format("knows no mode of '{}'", problem.modes.name()));
    values_.resize(features_.size());
    outputs_.resize(network_->outputs());
    scores_.resize(blocks_ * mode_.size());
  }

  int propose(const Problem<M>& problem, std::span<ModeSequence> into) noexcept override {
    features_.write(problem, problem.initial, problem.lines, values_);
    network_->evaluate(values_, outputs_);
    const std::size_t labels = outputs_.size() / blocks_, modes = mode_.size();
    for (std::size_t b = 0; b < blocks_; ++b)
      for (std::size_t m = 0; m < modes; ++m) scores_[b * modes + m] = outputs_[b * labels + label_[m]];
    const int count = best_.find(scores_, blocks_, into);
    for (int i = 0; i < count; ++i)
      for (std::size_t b = 0; b < blocks_; ++b) {
        std::uint16_t& mode = into[static_cast<std::size_t>(i)][b];
        mode = mode_[mode];
      }
    return count;
  }

 private:
  std::shared_ptr<const Mlp> network_;
  ProblemFeatures<M> features_;
  BestSequences best_;
  std::size_t blocks_ = 0;
  std::vector<std::size_t> label_;   // of each mode that both know
  std::vector<std::uint16_t> mode_;  // the problem's number of it
  std::vector<float> values_, outputs_, scores_;
};

}  // namespace solenoid
