#pragma once

#include "experiments/base/printed_table.hpp"
#include "experiments/campaign/simulate.hpp"

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace solenoid {

struct Result;

/// One figure of a run beside the thesis's.
struct Comparison {
  std::string metric;
  std::optional<PrintedNumber> thesis;  ///< none: ours alone, for information
  std::function<double(const RunResult&, const ScenarioConfig&)> ours;
};

/// One case of a table under one parameter set: the runs it stands for (one a seed) and what is compared.
struct ReproducedCase {
  std::string table, parameters, name;
  VariantConfig variant = new_variant();
  ScenarioConfig scenario;
  std::vector<std::uint64_t> seeds = {1};
  std::vector<Comparison> compared;
};

/// A table of the thesis that can be reproduced. To add one, write the function that lists its cases and enter it in
/// reproducible_tables().
struct ReproducibleTable {
  std::string name;   ///< "table-6-1"
  std::string title;  ///< what is compared, one line
  std::vector<ReproducedCase> (*cases)(const std::string& name);
};
const std::vector<ReproducibleTable>& reproducible_tables();

/// The tables named, in the thesis's order, each once; "all" (or no name) is every one. Throws ConfigError for an
/// unknown name, with the allowed ones.
std::vector<ReproducibleTable> select_tables(const std::vector<std::string>& names);

/// One number beside the thesis's.
struct Cell {
  std::string table, parameters, case_name, metric;
  std::optional<PrintedNumber> thesis;
  double ours = 0.0;         ///< mean over the seeds
  double ours_spread = 0.0;  ///< sample standard deviation over the seeds, 0 for one
  int runs = 1;
};

/// Runs every case, `jobs` at a time, and returns the cells in the order of the cases. `progress(done, all)` is called
/// after each run, never by two threads at once. The result does not depend on `jobs`.
std::vector<Cell> reproduce(const std::vector<ReproducedCase>& cases, int jobs,
                            const std::function<void(std::size_t, std::size_t)>& progress = {});

/// Mean |ln(ours/thesis)| over the cells that `counted` accepts and the thesis has a number for; 0 if there is none.
double mean_abs_ln(std::span<const Cell> cells, const std::function<bool(const Cell&)>& counted);

/// How near a parameter set comes: mean |ln(ours/thesis)| of one metric over tables that belong together, as far as
/// present: each of chapter 5, those of chapter 6, those of chapter 7.
struct Agreement {
  std::string tables, parameters, metric;
  double mean_abs_ln = 0.0;
  int cells = 0;
};
/// Tables and metrics in the thesis's order, each parameter set in order of appearance.
std::vector<Agreement> agreements(std::span<const Cell> cells);

/// For a person: a block a table and parameter set, thesis beside ours, then the agreements. JSON: {"cells": [{table,
/// parameters, case, metric, thesis, ours, ...}], "agreement": [{tables, parameters, metric, mean_abs_ln, cells}]}.
/// `thesis` is the printed number, with "thesis_bound": "<" where only a bound is printed. With several seeds `ours` is
/// their mean, beside `ours_spread` (standard deviation) and `runs`. CSV: a line a cell.
Result result_of(std::span<const Cell> cells);

/// What a parameter set of named_parameters, or a stand-in for the rig, is in one sentence.
std::string parameters_in_words(const std::string& name);

}  // namespace solenoid
