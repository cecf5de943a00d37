#include "controllers/catalogue.hpp"

#include "controllers/compiled_solvers.hpp"
#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "solvers/minlp/bonmin.hpp"
#include "solvers/rounding/pulse_width.hpp"
#include "solvers/rounding/relax_and_pulse.hpp"
#include "solvers/search/branch_and_bound.hpp"
#include "solvers/search/rollout_kernels.hpp"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

template <HybridModel M>
SolverPtr<M> tree_search(bool prune) {
  return std::make_unique<BranchAndBound<M>>(TreeSearchSettings{.prune = prune});
}

ProjectedGradientSettings relaxation_of(const VariantConfig& v) {
  return {.most_iterations = v.rounding.iterations, .tolerance = 1e-4};
}

void check_tree(TableReader& table, const VariantConfig& v) {
  if (v.horizon.blocks.size() > max_tree_blocks)
    table.table("horizon").fail("blocks", fmt::format("{} of them are too many for '{}' (allowed: at most {})",
                                                      v.horizon.blocks.size(), v.solver, max_tree_blocks));
}

template <HybridModel M>
SolverPtr<M> rounding(const VariantConfig& v, RoundingMethod method) {
  return make_rounding<M>(relaxation_of(v), {.method = method, .improve = v.rounding.improve});
}

}  // namespace

std::vector<SolverRow> common_solvers() {
  std::vector<SolverRow> rows;
  rows.push_back({.name = "exhaustive",
                  .summary = "every sequence of modes over the blocks",
                  .groups = {"planning"},
                  .make = []<HybridModel M>(const VariantConfig&) { return tree_search<M>(false); },
                  .check = check_tree});
  rows.push_back({.name = "branch_and_bound",
                  .summary = "the same optimum, pruned by bounds: docs/results/search.md",
                  .groups = {"planning"},
                  .make = []<HybridModel M>(const VariantConfig&) { return tree_search<M>(true); },
                  .check = check_tree});
  rows.push_back(
      {.name = "sum_up_rounding",
       .summary = "relaxed, rounded by summing up, improved by mode swaps: docs/results/rounding.md",
       .chooses_continuous = true,
       .groups = {"planning", "rounding", "relaxing"},
       .make = []<HybridModel M>(const VariantConfig& v) { return rounding<M>(v, RoundingMethod::sum_up); }});
  rows.push_back({.name = "cia",
                  .summary = "the same with the rounding of least integral gap",
                  .chooses_continuous = true,
                  .groups = {"planning", "rounding", "relaxing"},
                  .make = []<HybridModel M>(const VariantConfig& v) {
                    return rounding<M>(v, RoundingMethod::integral_approximation);
                  }});
  rows.push_back({.name = "relaxed_pulses",
                  .summary = "relaxed by projected gradients, applied as pulses over each control period",
                  .chooses_continuous = true,
                  .plans_whole_input = true,
                  .pulses = true,
                  .groups = {"planning", "relaxing"},
                  .make = []<HybridModel M>(const VariantConfig& v) -> SolverPtr<M> {
                    return std::make_unique<RelaxAndPulse<M>>(
                        make_projected_gradient<M>(relaxation_of(v)),
                        RelaxAndPulseSettings{.interval = v.timing.ticks_per_period});
                  },
                  .check = check_pulses});
  rows.push_back({.name = "bonmin",
                  .summary = "the mixed-integer problem by Bonmin, where coinor-libbonmin-dev was there at build time",
                  .real_time = false,
                  .instead = "branch_and_bound, or cia for a joint plan",
                  .chooses_continuous = true,
                  .groups = {"planning"},
                  .make = []<HybridModel M>(const VariantConfig&) -> SolverPtr<M> {
                    return std::make_unique<BonminSolver<M>>();
                  }});
  return rows;
}

void check_pulses(TableReader& table, const VariantConfig& v) {
  double longest_s = 0.0;
  const ModeSet modes = system_of(v).modes(v);
  // Pulses are cut switch by switch: those of one group would have to lie within each other.
  if (!modes.one_at_a_time().empty())
    table.fail("solver", fmt::format("'{}' cuts the pulses of each switch by itself, and in mode set '{}' there are "
                                     "switches of which one may change at a time (allowed: another mode set or solver)",
                                     v.solver, v.modes));
  for (const Switch& s : modes.switches()) longest_s = std::max({longest_s, s.rise_delay_s, s.fall_delay_s});
  if (longest_s > (PulseWidth::longest_interval + 0.5) * v.timing.tick_s)
    table.fail("solver",
               fmt::format("'{}' cuts pulses in intervals as long as the longest switching delay, here {:g} ms "
                           "(allowed: delays of at most {} ticks, or another solver)",
                           v.solver, 1e3 * longest_s, PulseWidth::longest_interval));
}

const SolverRow& solver_row(const VariantConfig& v) {
  const System& system = system_of(v);
  if (find_row(system.laws(), v.solver))
    throw std::invalid_argument(fmt::format("'{}' is a law, it has no solver", v.solver));
  if (const SolverRow* row = find_row(system.solvers(), v.solver)) return *row;
  throw std::invalid_argument(
      fmt::format("no solver '{}' (allowed: {})", v.solver, fmt::join(names_of(system.solvers()), ", ")));
}

void require_real_time(const VariantConfig& variant) {
  const SolverRow* row = find_row(system_of(variant).solvers(), variant.solver);
  if (row && !row->real_time)
    throw ConfigError(
        fmt::format("variant '{}': the solver '{}' is not real time: it allocates, and keeps no deadline to "
                    "the millisecond (allowed on a plant in real time: {})",
                    variant.name, variant.solver, row->instead));
}

}  // namespace solenoid
