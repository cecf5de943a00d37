#pragma once

#include "core/mpc/hybrid_model.hpp"

#include <tuple>
#include <variant>

namespace solenoid {

/// Models, as a type.
template <HybridModel... M>
struct ModelList {
  /// A value of T<M> for one of the models.
  template <template <class> class T>
  using AnyOf = std::variant<T<M>...>;
};

/// What the names above and below are made with.
namespace detail {
/// Joins lists, the first two at a time.
template <class... Lists>
struct Joined;
/// One list is itself.
template <HybridModel... M>
struct Joined<ModelList<M...>> {
  using Type = ModelList<M...>;
};
/// The first two become one.
template <HybridModel... A, HybridModel... B, class... Rest>
struct Joined<ModelList<A...>, ModelList<B...>, Rest...> : Joined<ModelList<A..., B...>, Rest...> {};
}  // namespace detail

/// The models of several lists in one.
template <class... Lists>
using JoinedModels = typename detail::Joined<Lists...>::Type;

/// Makes a Made<M> of an argument for each model of a list, from a generic lambda `[]<HybridModel M>(Argument)`. A lambda
/// that is constrained to some of the models makes nothing for the others.
template <class Models, template <class> class Made, class Argument>
class MakerFor;
/// The same of the models that a list holds.
template <HybridModel... M, template <class> class Made, class Argument>
class MakerFor<ModelList<M...>, Made, Argument> {
 public:
  template <class Make>
  MakerFor(Make) : makers_{maker<M, Make>()...} {}  // NOLINT: stands for one

  /// Whether there is one for the model.
  template <HybridModel One>
  bool makes() const {
    return std::get<Maker<One>>(makers_).make != nullptr;
  }
  /// Only where makes().
  template <HybridModel One>
  Made<One> of(Argument argument) const {
    return std::get<Maker<One>>(makers_).make(argument);
  }

 private:
  template <HybridModel One>
  struct Maker {
    Made<One> (*make)(Argument) = nullptr;
  };
  template <HybridModel One, class Make>
  static Maker<One> maker() {
    if constexpr (requires(Argument a) { Make().template operator()<One>(a); })
      return {+[](Argument argument) -> Made<One> { return Make().template operator()<One>(argument); }};
    else
      return {};
  }

  std::tuple<Maker<M>...> makers_;
};

}  // namespace solenoid
