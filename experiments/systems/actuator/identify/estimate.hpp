#pragma once

#include <string>
#include <vector>

namespace solenoid {

/// A value found from data, with how well it is known.
struct Estimate {
  std::string name;  ///< the key of docs/reference/configuration.md, or a name of its own
  std::string unit;
  double value = 0.0;
  double sigma = 0.0;        ///< standard error
  double freedom = 0.0;      ///< degrees of freedom behind sigma
  double low = 0, high = 0;  ///< 95 % interval: value +- t(freedom) sigma
  bool parameter = false;    ///< `name` is a key that goes into the parameter file
  std::string method;
  bool contains(double truth) const { return low <= truth && truth <= high; }
};

/// With its two-sided 95 % interval by Student's t.
Estimate make_estimate(const std::string& name, const std::string& unit, double value, double sigma, double freedom,
                       const std::string& method);

/// Measured against modelled, to be drawn with its residuals.
struct ResidualPlot {
  struct Point {
    double x, measured, modelled;
  };
  std::string name, title, x_label, y_label;
  std::vector<Point> points;
  bool lines = true;  ///< points follow each other in time
};

/// What an estimator gives.
struct Findings {
  std::vector<Estimate> estimates;
  std::vector<ResidualPlot> plots;
  std::vector<std::string> remarks;

  void add(Findings other);
  const Estimate* find(const std::string& name) const;
};

}  // namespace solenoid
