#include "core/metrics/metrics.hpp"
#include "experiments/base/result.hpp"
#include "experiments/ledger/ledger.hpp"

#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Column = Table::Column;

/// One method over a variant's states: gaps to the proven bound (shares of it), and times.
struct Summary {
  std::size_t tried = 0, optimal = 0, infeasible = 0;
  Percentiles gap, us;
};

Summary summarise(const LedgerOfVariant& ledger, LedgerMethod method) {
  Summary s;
  std::vector<double> gaps, times;
  for (const LedgerState& state : ledger.states) {
    const LedgerEntry& entry = state.of(method);
    if (!entry.tried) continue;
    ++s.tried;
    times.push_back(entry.time_us);
    if (!std::isfinite(entry.cost)) {
      ++s.infeasible;
      continue;
    }
    gaps.push_back(state.gap(method));
    s.optimal += entry.cost <= state.bound * (1.0 + 1e-9);
  }
  s.gap = percentiles(gaps);
  s.us = percentiles(times);
  return s;
}

Table methods(const LedgerOfVariant& ledger) {
  Table table{.title = fmt::format("{} (blocks of {} steps)", ledger.name, ledger.blocks),
              .columns = {Column("name", "method", "<"), Column("states", "states"), Column("", "at optimum %", ".3g%"),
                          Column("at_optimum"), Column("infeasible"), Column("gap_p50", "gap % p50", ".3g%"),
                          Column("gap_p90", "p90", ".3g%"), Column("gap_max", "max", ".3g%"),
                          Column("us_p50", "us p50"), Column("us_p99", "p99"), Column("us_max", "max")}};
  for (std::size_t m = 0; m < ledger_methods; ++m) {
    const auto method = static_cast<LedgerMethod>(m);
    const Summary s = summarise(ledger, method);
    if (s.tried == 0) continue;
    const double share = static_cast<double>(s.optimal) / static_cast<double>(s.tried);
    table.add({to_string(method), s.tried, method == LedgerMethod::relaxed ? Json() : Json(share), s.optimal,
               s.infeasible, s.gap.p50, s.gap.p90, s.gap.max, s.us.p50, s.us.p99, s.us.max});
  }
  table.notes = {
      fmt::format("relaxed <= branch and bound = exhaustive <= plans: {} states, {} violations; {} relaxed "
                  "solves stationary",
                  ledger.states.size(), ledger.violations.size(), ledger.relaxed_stationary)};
  for (const LedgerViolation& v : ledger.violations)
    table.notes.push_back(fmt::format("  record {}: {}", v.record, v.what));
  return table;
}

}  // namespace

Result result_of(const std::vector<LedgerOfVariant>& ledger) {
  Result result{.title = "Gaps are (cost - proven bound) / proven bound, on the same recorded states.",
                .facts = {{"variants", Json::array()}},
                .flat = Table{.columns = {Column("variant"), Column("record"), Column("method"), Column("status"),
                                          Column("cost"), Column("bound"), Column("gap"), Column("time_us")}}};
  for (const LedgerOfVariant& variant : ledger) {
    result.tables.push_back(methods(variant));
    Json violations = Json::array(), instances = Json::array();
    for (const LedgerViolation& v : variant.violations) violations.push_back({{"record", v.record}, {"what", v.what}});
    for (const LedgerState& state : variant.states) {
      Json costs = Json::object();
      for (std::size_t m = 0; m < ledger_methods; ++m) {
        const LedgerEntry& entry = state.entries[m];
        if (!entry.tried) continue;
        const auto method = static_cast<LedgerMethod>(m);
        costs[to_string(method)] = entry.cost;
        result.flat->add({variant.name, state.record, to_string(method), to_string(entry.status), entry.cost,
                          state.bound, state.gap(method), entry.time_us});
      }
      instances.push_back({{"record", state.record}, {"bound", state.bound}, {"cost", costs}});
    }
    result.facts["variants"].push_back({{"name", variant.name},
                                        {"blocks", variant.blocks},
                                        {"states", variant.states.size()},
                                        {"relaxed_stationary", variant.relaxed_stationary},
                                        {"methods", result.tables.back().json()},
                                        {"violations", violations},
                                        {"instances", instances}});
  }
  return result;
}

}  // namespace solenoid
