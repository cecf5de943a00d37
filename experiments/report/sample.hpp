#pragma once

#include "experiments/report/run_table.hpp"

#include <cstddef>
#include <vector>

namespace solenoid {

/// Rows of a table that say most about it: of each variant, an equal share of `most`, a fifth of that those with the largest
/// errors, a tenth each the first that were unstable and that failed, and the rest at evenly spaced ranks of the error, from
/// the least on. Where a variant has fewer runs, all of them. Increasing; the same table gives the same rows.
std::vector<std::size_t> sampled_rows(const RunTable& runs, std::size_t most);

}  // namespace solenoid
