#pragma once

#include "controllers/compiled_solvers.hpp"
#include "solvers/nlp/relaxed_ipopt.hpp"
#include "solvers/sqp/sqp.hpp"

#include <stdexcept>

namespace solenoid {

/// In the files that compile a model's relaxed solvers: each takes its time.
#define SOLENOID_COMPILE_SQP(Model) template RelaxedPtr<Model> make_relaxed_sqp<Model>();
/// The other.
#define SOLENOID_COMPILE_IPOPT(Model) template RelaxedPtr<Model> make_relaxed_ipopt<Model>();

/// What the makers are made of.
namespace detail {

/// A relaxed solver of whatever size the problem turns out to need. make(size) makes one of a SqpSize.
template <HybridModel M, class Sizes, class Make>
class SizedRelaxed;
/// Of those in a list.
template <HybridModel M, class... Sizes, class Make>
class SizedRelaxed<M, std::tuple<Sizes...>, Make> final : public RelaxedSolver<M> {
 public:
  void prepare(const Problem<M>& problem, const RelaxedGrid& grid) override {
    const auto sizes = transcription_sizes(problem);
    const auto offer = [&]<int P, int A>(SqpSize<P, A> size) {
      if (sizes[0] == P && sizes[1] == A) made_ = Make()(size);
    };
    made_.reset();
    (offer(Sizes()), ...);
    if (!made_)
      throw std::invalid_argument("no relaxed solver is compiled for the size of mode set '" + problem.modes.name() +
                                  "'");
    made_->prepare(problem, grid);
  }
  SolveReport solve(const Problem<M>& problem, RelaxedPlan<M>& plan, Deadline deadline) noexcept override {
    return made_->solve(problem, plan, deadline);
  }
  bool anticipates() const override { return made_->anticipates(); }
  void anticipate(const Problem<M>& expected, const RelaxedPlan<M>& warm_start) noexcept override {
    made_->anticipate(expected, warm_start);
  }
  bool time_phases(PhaseTimes* into) noexcept override { return made_->time_phases(into); }

 private:
  RelaxedPtr<M> made_;
};

/// Null for a model without sizes.
template <HybridModel M, class Sizes, class Make>
RelaxedPtr<M> make_sized(Make) {
  if constexpr (std::tuple_size_v<Sizes> == 0)
    return nullptr;
  else
    return std::make_unique<SizedRelaxed<M, Sizes, Make>>();
}

}  // namespace detail

template <HybridModel M>
RelaxedPtr<M> make_relaxed_sqp() {
  return detail::make_sized<M, typename RelaxedSizes<M>::Sqp>([]<int P, int A>(SqpSize<P, A>) -> RelaxedPtr<M> {
    return std::make_unique<Sqp<M, P, A>>(SqpSettings{.max_iterations = 8});
  });
}

template <HybridModel M>
RelaxedPtr<M> make_relaxed_ipopt() {
  return detail::make_sized<M, typename RelaxedSizes<M>::Ipopt>(
      []<int P, int A>(SqpSize<P, A>) -> RelaxedPtr<M> { return std::make_unique<RelaxedIpopt<M, P, A>>(); });
}

}  // namespace solenoid
