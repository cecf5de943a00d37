#pragma once

#include "experiments/thesis/reproduce.hpp"

#include <span>
#include <string>

namespace solenoid {

/// {"cells": [{table, parameters, case, metric, thesis, ours, ...}], "agreement": [{tables, parameters, metric,
/// mean_abs_ln, cells}]}. `thesis` is the printed number, with "thesis_bound": "<" where only a bound is printed. With
/// several seeds `ours` is their mean, beside `ours_spread` (standard deviation) and `runs`. A figure that is not
/// finite is null.
std::string reproduction_json(std::span<const Cell> cells);

/// One line a cell: table,parameters,case,metric,thesis_bound,thesis,ours,ours_spread,runs.
std::string reproduction_csv(std::span<const Cell> cells);

/// For a person: one block a table and parameter set, thesis beside ours, then the agreements.
std::string reproduction_text(std::span<const Cell> cells);

/// What a parameter set of named_parameters, or a stand-in for the rig, is in one sentence.
std::string parameters_in_words(const std::string& name);

}  // namespace solenoid
