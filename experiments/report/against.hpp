#pragma once

#include "experiments/base/table.hpp"
#include "experiments/report/ranking.hpp"

#include <optional>
#include <string>

namespace solenoid {

/// Variants against one of them, task by task (PairedVariants), for a person and as data.
struct Against {
  Table table;
  /// baseline                its name
  /// chosen                  "ranked first", corrected over all pairs, or "named", over the variants against it
  /// resampled, units        what was drawn, "scenarios", "seeds" or "groups of" either, and how many of them there are
  /// resamples, comparisons  how many draws, and how many comparisons were corrected together
  /// notes                   what the table's numbers are, in words
  /// variants                the table: [{variant, ratio, own_low, own_high, low, high, p, better, tasks, lost,
  ///                         baseline_lost, verdict}]; `own` by itself, low and high corrected; null: there is none
  /// matrix                  the same of every variant against every other, each with its `baseline` in front,
  ///                         corrected over all pairs; of more than PairedVariants::most_variants those against the
  ///                         baseline alone, not corrected
  /// profiles                [{variant, ok, runs, ratios}]: performance_profiles()
  Json json;
  bool several_tasks = false;  ///< whether a pair has more than one: one task says nothing of another
};

/// Of a ranking and the runs it is of. `baseline` empty: the best ranked. Nothing where there is no other variant.
/// Throws ConfigError for a name without runs.
std::optional<Against> against(const RunTable& runs, const Ranking& ranking, const std::string& baseline = "",
                               std::optional<std::uint32_t> group = {});

}  // namespace solenoid
