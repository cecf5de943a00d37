#pragma once

#include "experiments/base/printed_table.hpp"
#include "experiments/campaign/scenario.hpp"

#include <optional>

namespace solenoid {

/// What the thesis prints for a run.
struct ThesisCell {
  std::string table;      ///< "6-1"
  bool measured = false;  ///< on the thesis's rig (chapter 7, mean of five tests); else in its simulation (chapter 6)
  PrintedNumber rmse_mm, mae_mm;
  std::optional<PrintedNumber> sse_mm, ssa_mm;  ///< of motions that end in a dwell
};

/// The cell of a run of the thesis's own law, whatever its name, on one of the thesis's motions with its payload and
/// plane: of chapter 6 for a plant "model", of chapter 7 for the twin, neither with a mismatch. The parameters may be
/// any set; the thesis's contradict themselves (docs/results/reproduction.md).
std::optional<ThesisCell> thesis_cell(const VariantConfig& variant, const ScenarioConfig& scenario);

}  // namespace solenoid
