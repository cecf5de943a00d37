#include "controllers/catalogue.hpp"

#include "controllers/common_solvers.hpp"
#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "solvers/rounding/pulse_width.hpp"
#include "solvers/search/branch_and_bound.hpp"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {

void check_tree(TableReader& table, const VariantConfig& v) {
  if (v.horizon.blocks.size() > max_tree_blocks)
    table.table("horizon").fail("blocks", fmt::format("{} of them are too many for '{}' (allowed: at most {})",
                                                      v.horizon.blocks.size(), v.solver, max_tree_blocks));
}

void check_sampling(TableReader& table, const VariantConfig& v) {
  if (v.sampling.iterations > v.sampling.samples)
    table.table("sampling")
        .fail("iterations", fmt::format("{} are more than the samples (allowed: at most {})", v.sampling.iterations,
                                        v.sampling.samples));
}

Modulation modulation_of(const VariantConfig& v) {
  if (v.modulation.kind == "delta_sigma") return Modulation::delta_sigma;
  if (v.modulation.kind == "delta_sigma_2") return Modulation::delta_sigma_2;
  if (v.modulation.kind == "dynamic_quantiser") return Modulation::dynamic_quantiser;
  return Modulation::pulse_width;
}

void check_taught_tree(TableReader& table, const VariantConfig& v) {
  check_tree(table, v);
  check_network(table, v);
}

void check_taught(TableReader& table, const VariantConfig& v) {
  check_tree(table, v);
  if (v.learned.network.empty())
    table.fail("learned", fmt::format("'{}' has no network (allowed: {{ network = \"...\" }}, a shipped one's name or "
                                      "a file NAME.toml)",
                                      v.solver));
  if (v.solver == "learned_tail" && v.learned.searched_blocks >= static_cast<int>(v.horizon.blocks.size()))
    table.table("learned").fail(
        "searched_blocks", fmt::format("{} of {} blocks leave none to a learned cost (allowed: fewer than the blocks)",
                                       v.learned.searched_blocks, std::max<std::size_t>(1, v.horizon.blocks.size())));
  check_network(table, v);
}

void check_pulses(TableReader& table, const VariantConfig& v) {
  double longest_s = 0.0;
  const ModeSet modes = system_of(v).modes(v);
  if (modes.switches().empty() && v.modulation != ModulationSettings())
    table.fail("modulation", fmt::format("nothing switches in mode set '{}' (allowed: no such table)", v.modes));
  // Pulses are cut switch by switch: those of one group would have to lie within each other. The quantiser takes modes.
  if (!modes.one_at_a_time().empty() && modulation_of(v) != Modulation::dynamic_quantiser)
    table.fail("solver",
               fmt::format("'{}' cuts the pulses of each switch by itself, and in mode set '{}' there are "
                           "switches of which one may change at a time (allowed: another mode set or solver, or "
                           "modulation.kind = \"dynamic_quantiser\")",
                           v.solver, v.modes));
  if (modulation_of(v) != Modulation::pulse_width) return;
  for (const Switch& s : modes.switches()) longest_s = std::max({longest_s, s.rise_delay_s, s.fall_delay_s});
  if (longest_s > (PulseWidth::longest_interval + 0.5) * v.timing.tick_s)
    table.fail("solver",
               fmt::format("'{}' cuts pulses in intervals as long as the longest switching delay, here {:g} ms "
                           "(allowed: delays of at most {} ticks, or another solver or modulation.kind)",
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
