#pragma once

#include "controllers/catalogue.hpp"
#include "controllers/compiled_solvers.hpp"
#include "controllers/networks.hpp"
#include "solvers/rounding/relax_and_pulse.hpp"

#include <memory>
#include <utility>
#include <vector>

namespace solenoid {

/// Refuses more blocks than a tree search has room for.
void check_tree(TableReader& table, const VariantConfig& variant);
/// Refuses that too, and a network that does not fit.
void check_taught_tree(TableReader& table, const VariantConfig& variant);
/// Refuses that too, and a variant without a network.
void check_taught(TableReader& table, const VariantConfig& variant);

/// How a variant has its problem relaxed.
inline ProjectedGradientSettings relaxation_of(const VariantConfig& v) {
  return {.most_iterations = v.rounding.iterations, .tolerance = 1e-4};
}

/// How a variant has its relaxed plan made steps of; by a name that the key allows.
Modulation modulation_of(const VariantConfig& v);

/// A relaxed solver's plans as pulses over each control period.
template <HybridModel M>
SolverPtr<M> make_pulses(const VariantConfig& v, RelaxedPtr<M> relaxed) {
  return std::make_unique<RelaxAndPulse<M>>(std::move(relaxed),
                                            RelaxAndPulseSettings{.interval = v.timing.ticks_per_period,
                                                                  .modulation = modulation_of(v),
                                                                  .informed = v.modulation.informed,
                                                                  .edge_price = v.modulation.edge_price});
}

/// How a variant has sequences of modes sampled.
inline ModeSamplingSettings sampling_of(const VariantConfig& v, SamplingUpdate update) {
  const SamplingSettings& s = v.sampling;
  return {.update = update,
          .samples = s.samples,
          .iterations = s.iterations,
          .elites = s.elites,
          .temperature = s.temperature,
          .smoothing = s.smoothing,
          .mutation = s.mutation,
          .seed = static_cast<std::uint64_t>(s.seed)};
}

/// Refuses more updates than samples.
void check_sampling(TableReader& table, const VariantConfig& variant);

/// The solvers that every system has, for its models: those must be compiled (compiled_solvers.hpp).
template <HybridModel... Models>
std::vector<SolverRow> common_solvers() {
  const auto rounding = [](RoundingMethod method) {
    return SolverMakers::of<Models...>([method]<HybridModel M>(const VariantConfig& v) {
      return make_rounding<M>(relaxation_of(v), {.method = method, .improve = v.rounding.improve});
    });
  };
  const auto sampling = [](SamplingUpdate update) {
    return SolverMakers::of<Models...>(
        [update]<HybridModel M>(const VariantConfig& v) { return make_sampling<M>(sampling_of(v, update)); });
  };
  std::vector<SolverRow> rows;
  rows.push_back({.name = "exhaustive",
                  .summary = "every sequence of modes over the blocks",
                  .groups = {"planning", "limits"},
                  .make = SolverMakers::of<Models...>(
                      []<HybridModel M>(const VariantConfig&) { return make_tree_search<M>(false); }),
                  .check = check_tree});
  rows.push_back({.name = "branch_and_bound",
                  .summary = "the same optimum, pruned by bounds: docs/results/search.md",
                  .groups = {"planning", "limits", "learned"},
                  .make = SolverMakers::of<Models...>([]<HybridModel M>(const VariantConfig& v) {
                    return make_tree_search<M>(true,
                                               v.learned.network.empty() ? nullptr : find_network(v.learned.network));
                  }),
                  .check = check_taught_tree});
  rows.push_back({.name = "policy",
                  .summary = "a network proposes sequences, their prediction chooses: docs/how-to/learning.md",
                  .groups = {"planning", "limits", "learned"},
                  .make = SolverMakers::of<Models...>([]<HybridModel M>(const VariantConfig& v) {
                    return make_policy<M>(find_network(v.learned.network));
                  }),
                  .check = check_taught});
  rows.push_back({.name = "learned_tail",
                  .summary = "the first blocks searched, a network says what the others cost: docs/how-to/learning.md",
                  .groups = {"planning", "limits", "learned", "learned_tail"},
                  .make = SolverMakers::of<Models...>([]<HybridModel M>(const VariantConfig& v) {
                    return make_tail_search<M>(find_network(v.learned.network), v.learned.searched_blocks);
                  }),
                  .check = check_taught});
  rows.push_back({.name = "sum_up_rounding",
                  .summary = "relaxed, rounded by summing up, improved by mode swaps: docs/results/rounding.md",
                  .chooses_continuous = true,
                  .groups = {"planning", "limits", "rounding", "relaxing"},
                  .make = rounding(RoundingMethod::sum_up)});
  rows.push_back({.name = "cia",
                  .summary = "the same with the rounding of least integral gap",
                  .chooses_continuous = true,
                  .groups = {"planning", "limits", "rounding", "relaxing"},
                  .make = rounding(RoundingMethod::integral_approximation)});
  rows.push_back(
      {.name = "cross_entropy",
       .summary = "sampled sequences, their distribution fitted to the best ones: docs/theory/theory-sampling.md",
       .groups = {"planning", "limits", "sampling", "elites"},
       .make = sampling(SamplingUpdate::elites),
       .check = check_sampling});
  rows.push_back({.name = "mppi",
                  .summary = "the same weighted by the exponential of their costs: model predictive path integral",
                  .groups = {"planning", "limits", "sampling", "weights"},
                  .make = sampling(SamplingUpdate::weights),
                  .check = check_sampling});
  rows.push_back({.name = "relaxed_pulses",
                  .summary = "relaxed by projected gradients, applied as single steps by a modulator",
                  .chooses_continuous = true,
                  .plans_whole_input = true,
                  .pulses = true,
                  .groups = {"planning", "relaxing", "modulation"},
                  .make = SolverMakers::of<Models...>([]<HybridModel M>(const VariantConfig& v) {
                    return make_pulses<M>(v, make_projected_gradient<M>(relaxation_of(v)));
                  }),
                  .check = check_pulses});
  rows.push_back({.name = "bonmin",
                  .summary = "the mixed-integer problem by Bonmin, where coinor-libbonmin-dev was there at build time",
                  .real_time = false,
                  .instead = "branch_and_bound, or cia for a joint plan",
                  .chooses_continuous = true,
                  .groups = {"planning", "minlp"},
                  .make = SolverMakers::of<Models...>(
                      []<HybridModel M>(const VariantConfig& v) { return make_bonmin<M>(v.minlp.algorithm); })});
  return rows;
}

}  // namespace solenoid
