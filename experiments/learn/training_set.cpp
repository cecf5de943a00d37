#include "experiments/learn/training_set.hpp"

#include "experiments/base/files.hpp"
#include "solvers/search/model_functions.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string_view>

namespace solenoid {
namespace {

/// Each state's usual change from one recorded problem to the next of its run: what nine in ten of them stay below.
std::vector<double> usual_changes(const VariantInstances& variant, std::size_t states) {
  std::vector<double> usual(states, 0.0);
  for (std::size_t k = 0; k < states; ++k) {
    std::vector<double> sizes;
    for (std::size_t i = 1; i < variant.records.size(); ++i)
      if (variant.records[i].motion == variant.records[i - 1].motion)
        sizes.push_back(std::abs(variant.records[i].initial[k] - variant.records[i - 1].initial[k]));
    if (sizes.empty()) continue;
    const auto high = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() * 9 / 10);  // most are at rest
    std::nth_element(sizes.begin(), high, sizes.end());
    usual[k] = *high;
  }
  return usual;
}

/// The variant over its last blocks alone.
VariantConfig over_rest(VariantConfig v, int searched) {
  std::vector<int>& blocks = v.horizon.blocks;
  blocks.erase(blocks.begin(), blocks.begin() + searched);
  v.horizon.steps = 0;
  for (const int periods : blocks) v.horizon.steps += periods * v.timing.ticks_per_period;
  return v;
}

/// Makes the samples of one set.
class SampleMaker {
 public:
  SampleMaker(const InstanceSet& set, const VariantInstances& variant, const SampleSettings& settings)
      : set_(set),
        variant_(variant),
        settings_(settings),
        draws_(settings.seed),
        usual_(usual_changes(variant, variant.records.empty() ? 0 : sizes(variant.config).states)) {}

  TrainingSet make(const std::function<bool()>& interrupted) {
    begin_motion(0);
    for (const InstanceRecord& record : variant_.records) {
      if (interrupted && interrupted()) break;
      if (record.plan_status != Status::optimal) continue;
      if (record.motion != motion_) begin_motion(record.motion);
      pose(set_, record, *problem_, *plan_);
      warm_ = plan_->modes;
      plan_->modes = record.plan_modes;
      add(record.plan_modes);
      for (double left = settings_.perturbed; draws_.uniform() < left; left -= 1.0) add_perturbed(record);
    }
    return finished();
  }

 private:
  static ModelSizes sizes(const VariantConfig& v) { return system_of(v).problem(v)->sizes(); }

  void begin_motion(std::uint32_t motion) {
    const VariantConfig told_variant =
        set_.motions.empty() ? variant_.config : told(variant_.config, set_.motions[motion]);
    const System& system = system_of(told_variant);
    motion_ = motion;
    problem_ = system.problem(told_variant);
    plan_ = problem_->new_plan();
    solver_ = make_solver(told_variant);
    solver_->prepare(*problem_);
    if (settings_.taught == Taught::cost) {
      const VariantConfig rest = over_rest(told_variant, settings_.searched_blocks);
      rest_ = system.problem(rest);
      rest_plan_ = rest_->new_plan();
      rest_solver_ = make_solver(rest);
      rest_solver_->prepare(*rest_);
    }
    tools_ = &system.tools(told_variant);
    features_ = tools_->features(settings_.taught == Taught::cost ? *rest_ : *problem_);
    row_.resize(features_->size());
  }

  /// The problem as it is, with its optimal modes.
  void add(const std::vector<int>& modes) {
    if (settings_.taught == Taught::cost) return add_costs(modes);
    features_->write(*problem_, row_);
    values_.insert(values_.end(), row_.begin(), row_.end());
    all_.modes.insert(all_.modes.end(), modes.begin(), modes.end());
    all_.weights.push_back(modes == warm_ ? 1.0f : static_cast<float>(settings_.emphasis));
  }

  void add_perturbed(const InstanceRecord& record) {
    const std::span<double> state = problem_->initial_values();
    const double scale = exponential(-6.907755278982137 * draws_.uniform());
    for (std::size_t k = 0; k < state.size(); ++k) state[k] = record.initial[k] + scale * usual_[k] * draws_.normal();
    plan_->modes = record.plan_modes;
    const SolveReport report = solver_->solve(*problem_, *plan_, Deadline::never());
    if (report.status == Status::optimal) add(plan_->modes);
  }

  /// The cost of the blocks left behind the optimum's first ones and behind others, whose later modes are more often
  /// drawn.
  void add_costs(const std::vector<int>& modes) {
    const auto searched = static_cast<std::size_t>(settings_.searched_blocks);
    const auto count = static_cast<std::size_t>(problem_->modes.size());
    for (int way = 0; way < settings_.ways; ++way) {
      plan_->modes = modes;
      const std::size_t first = way % 2 == 1 ? searched - 1 : 0;
      for (std::size_t b = first; way > 0 && b < searched; ++b) plan_->modes[b] = static_cast<int>(draws_.below(count));
      if (!std::isfinite(tools_->follow(*problem_, *plan_, *rest_))) continue;
      rest_plan_->modes.assign(modes.begin() + settings_.searched_blocks, modes.end());
      const SolveReport report = rest_solver_->solve(*rest_, *rest_plan_, Deadline::never());
      if (report.status != Status::optimal) continue;
      features_->write(*rest_, row_);
      values_.insert(values_.end(), row_.begin(), row_.end());
      all_.costs.push_back(report.cost);
      all_.weights.push_back(1.0f);
    }
  }

  TrainingSet finished() {
    all_.layout = settings_.taught == Taught::cost ? features_->cost_layout() : features_->layout();
    for (const Mode& mode : problem_->modes.modes()) all_.patterns.push_back(static_cast<int>(mode.pattern));
    all_.blocks = problem_->horizon.blocks.size();
    const auto columns = static_cast<Eigen::Index>(row_.size());
    all_.features = Eigen::Map<Samples<float>>(values_.data(), std::ssize(all_.weights), columns);
    Fingerprint hash;
    hash.add(bytes_of(values_));
    hash.add(bytes_of(all_.modes));
    hash.add(bytes_of(all_.costs));
    all_.hash = hash.text();
    return std::move(all_);
  }

  template <class T>
  static std::string_view bytes_of(const std::vector<T>& values) {
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
  }

  const InstanceSet& set_;
  const VariantInstances& variant_;
  SampleSettings settings_;
  Draws draws_;
  std::vector<double> usual_;
  std::uint32_t motion_ = 0;
  std::unique_ptr<AnyProblem> problem_, rest_;
  std::unique_ptr<AnyPlan> plan_, rest_plan_;
  AnySolverPtr solver_, rest_solver_;
  const ModelTools* tools_ = nullptr;
  std::unique_ptr<AnyFeatures> features_;
  std::vector<int> warm_;
  std::vector<float> row_, values_;
  TrainingSet all_;
};

}  // namespace

TrainingSet training_set(const InstanceSet& set, const VariantInstances& variant, const SampleSettings& settings,
                         const std::function<bool()>& interrupted) {
  return SampleMaker(set, variant, settings).make(interrupted);
}

}  // namespace solenoid
