#pragma once

#include "experiments/report/results.hpp"

#include <map>
#include <string>

namespace solenoid {

/// What a report's page shows, as one JSON object; curves come apart from it, as traces.
///
///   format       1
///   campaign, status, generator, folder_name, deadline_us, live
///   manifest, resolved_toml                   as the folder has them
///   system       {name, judged, heading, label, unit, error, margin, p95, worst, efforts: [METRIC], metrics: [METRIC],
///                conditions: [{key, label, unit}], modes_key, timing: {tick_s, period_s}}: what the others' keys are and
///                how people read them; METRIC {key, heading, label, unit, whole, effort, detail, best_least}; judged,
///                margin, p95 and worst are keys: "rmse_mm", "rmse_margin", "p95_rmse_mm", "worst_rmse_mm"
///   variants     [{name, summary, solver, MODES_KEY, estimator}]
///   counts       {runs, ok, unstable, failed}: of all runs that there are, which rankings are over
///   sample       whether `runs` are a choice among them (sampled_rows), else all
///   rankings     [{name, scenarios: [...], scenario_count, common, variants: [{variant, ranked, runs, failed, unstable,
///                solves: {first, counts, late}, and from 20 runs that ended well on distribution: {ok, runs, errors};
///                if ranked JUDGED, MARGIN, P95, WORST, each effort, solve_p50_us, solve_p99_us}], paired}] over all
///                scenarios first, then over each ensemble and each scenario outside of one; `scenarios`: those of `runs`;
///                paired: Against::json with the best ranked as baseline, of several variants when the campaign has
///                ended, over all and, where they are not too many, over each ensemble;
///                solves and distribution: of all runs of the variant there, ErrorDistribution by at most 201 numbers,
///                fewer or none over single scenarios where these are many
///   runs         [{id, trace, everything `compare --format json` prints of the run, and where it is known
///                solves: {first, counts}, thesis: {table, measured, rmse_mm, mae_mm, sse_mm, ssa_mm}}]
///                thesis figures are texts as printed; trace: what there is of it over time: full, every tick; overview;
///                both, in the page itself; served, asked for when it is shown; none
///   left_out     [{id, reason, in_part}] runs whose files are damaged; in_part: it is among `runs`, but its log is not
///                whole
///
/// `curves`: `trace` by the run's ID, of those that have any.
nlohmann::ordered_json report_json(const Results& results, const std::map<std::string, std::string>& curves, bool live);

}  // namespace solenoid
