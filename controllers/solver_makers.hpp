#pragma once

#include "controllers/any_solver.hpp"

#include <algorithm>
#include <typeindex>
#include <utility>
#include <vector>

namespace solenoid {

/// How one solver is made of a variant, for each of the models that it can be made for.
class SolverMakers {
 public:
  using Make = std::function<AnySolverPtr(const VariantConfig&)>;

  /// For none yet.
  SolverMakers() = default;
  /// For these models, from a generic lambda `[]<HybridModel M>(const VariantConfig&)`; one that is constrained to some
  /// of them makes nothing for the others.
  template <HybridModel... M, class GenericMake>
  static SolverMakers of(GenericMake make) {
    SolverMakers all;
    (all.add<M>(make), ...);
    return all;
  }
  /// For every model: of a solver that need not know it.
  static SolverMakers of_any(Make make) {
    SolverMakers all;
    all.any_ = std::move(make);
    return all;
  }

  /// Whether there is one for a model.
  bool makes(std::type_index model) const { return find(model) != nullptr || any_; }
  /// Null for a model that it cannot be made for.
  AnySolverPtr make(std::type_index model, const VariantConfig& variant) const {
    if (const Make* own = find(model)) return (*own)(variant);
    return any_ ? any_(variant) : nullptr;
  }

 private:
  template <HybridModel M, class GenericMake>
  void add(GenericMake make) {
    if constexpr (requires(const VariantConfig& v) { make.template operator()<M>(v); })
      each_.emplace_back(typeid(M),
                         [make](const VariantConfig& v) -> AnySolverPtr { return make.template operator()<M>(v); });
  }
  const Make* find(std::type_index model) const {
    const auto at = std::ranges::find(each_, model, &std::pair<std::type_index, Make>::first);
    return at == each_.end() ? nullptr : &at->second;
  }

  std::vector<std::pair<std::type_index, Make>> each_;
  Make any_;
};

}  // namespace solenoid
