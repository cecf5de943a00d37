#pragma once

#include "experiments/report/results.hpp"
#include "experiments/report/run_figure.hpp"

namespace solenoid {

/// Draws a figure of a results folder for a paper, with gnuplot:
///
///   pareto       error against each effort (draw_ranked)
///   profile      performance profiles (draw_profiles)
///   solve_time   a histogram of solver times a variant, with the line of the control period
///   a run's ID   the plots of draw_figure, from the run as it was kept
///
/// Throws ConfigError for another name, a run without curves, or without gnuplot.
void draw_report_figure(Results& results, const std::string& figure, const std::string& path, FigureFormat format);

}  // namespace solenoid
