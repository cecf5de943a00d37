#include "core/metrics/metrics.hpp"
#include "experiments/base/text_table.hpp"
#include "experiments/ledger/ledger.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

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

std::string percent(double share) { return fmt::format("{:.3g}", 100.0 * share); }

std::string table_of(const LedgerOfVariant& ledger) {
  TextTable table({{"method", TextTable::Align::left},
                   {"states"},
                   {"at optimum %"},
                   {"gap % p50"},
                   {"p90"},
                   {"max"},
                   {"us p50"},
                   {"p99"},
                   {"max"}});
  for (std::size_t m = 0; m < ledger_methods; ++m) {
    const auto method = static_cast<LedgerMethod>(m);
    const Summary s = summarise(ledger, method);
    if (s.tried == 0) continue;
    table.add_row(std::vector<std::string>{
        to_string(method), std::to_string(s.tried),
        method == LedgerMethod::relaxed ? "-" : percent(static_cast<double>(s.optimal) / static_cast<double>(s.tried)),
        percent(s.gap.p50), percent(s.gap.p90), percent(s.gap.max), short_number(s.us.p50), short_number(s.us.p99),
        short_number(s.us.max)});
  }
  return table.text(false);
}

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json to_json(const LedgerOfVariant& ledger) {
  Json json = {{"name", ledger.name},
               {"blocks", ledger.blocks},
               {"states", ledger.states.size()},
               {"relaxed_stationary", ledger.relaxed_stationary},
               {"methods", Json::array()},
               {"violations", Json::array()},
               {"instances", Json::array()}};
  for (std::size_t m = 0; m < ledger_methods; ++m) {
    const Summary s = summarise(ledger, static_cast<LedgerMethod>(m));
    if (s.tried == 0) continue;
    json["methods"].push_back({{"name", to_string(static_cast<LedgerMethod>(m))},
                               {"states", s.tried},
                               {"at_optimum", s.optimal},
                               {"infeasible", s.infeasible},
                               {"gap_p50", number(s.gap.p50)},
                               {"gap_p90", number(s.gap.p90)},
                               {"gap_max", number(s.gap.max)},
                               {"us_p50", s.us.p50},
                               {"us_p99", s.us.p99},
                               {"us_max", s.us.max}});
  }
  for (const LedgerViolation& v : ledger.violations)
    json["violations"].push_back({{"record", v.record}, {"what", v.what}});
  for (const LedgerState& state : ledger.states) {
    Json costs = Json::object();
    for (std::size_t m = 0; m < ledger_methods; ++m)
      if (state.entries[m].tried) costs[to_string(static_cast<LedgerMethod>(m))] = number(state.entries[m].cost);
    json["instances"].push_back({{"record", state.record}, {"bound", state.bound}, {"cost", costs}});
  }
  return json;
}

}  // namespace

std::string ledger_text(const std::vector<LedgerOfVariant>& ledger) {
  std::string text = "Gaps are (cost - proven bound) / proven bound, on the same recorded states.\n";
  for (const LedgerOfVariant& variant : ledger) {
    text += fmt::format("\n{} (blocks of {} ms)\n{}", variant.name, variant.blocks, table_of(variant));
    text += fmt::format(
        "relaxed <= branch and bound = exhaustive <= plans: {} states, {} violations; {} relaxed solves "
        "stationary\n",
        variant.states.size(), variant.violations.size(), variant.relaxed_stationary);
    for (const LedgerViolation& v : variant.violations) text += fmt::format("  record {}: {}\n", v.record, v.what);
  }
  return text;
}

std::string ledger_json(const std::vector<LedgerOfVariant>& ledger) {
  Json json = {{"variants", Json::array()}};
  for (const LedgerOfVariant& variant : ledger) json["variants"].push_back(to_json(variant));
  return json.dump(1) + "\n";
}

std::string ledger_csv(const std::vector<LedgerOfVariant>& ledger) {
  std::string text = "variant,record,method,status,cost,bound,gap,time_us\n";
  for (const LedgerOfVariant& variant : ledger)
    for (const LedgerState& state : variant.states)
      for (std::size_t m = 0; m < ledger_methods; ++m) {
        const LedgerEntry& entry = state.entries[m];
        if (!entry.tried) continue;
        text += fmt::format("{},{},{},{},{},{},{},{}\n", variant.name, state.record,
                            to_string(static_cast<LedgerMethod>(m)), to_string(entry.status), entry.cost, state.bound,
                            state.gap(static_cast<LedgerMethod>(m)), entry.time_us);
      }
  return text;
}

}  // namespace solenoid
