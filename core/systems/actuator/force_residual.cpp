#include "core/systems/actuator/force_residual.hpp"

#include "core/config/reader.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// No plant of this size has a friction beyond it.
constexpr double largest_force_n = 100.0;
/// What rounding leaves of a zero.
constexpr double rest_tolerance_n = 1e-9;

HatSum read_share(TableReader& table, const char* name, const char* knots_key) {
  if (!table.has(name)) return {};
  TableReader share = table.table(name);
  const std::vector<double> knots = share.numbers(knots_key);
  const std::vector<double> force = share.numbers("force_n", Range::between(-largest_force_n, largest_force_n));
  share.finish();
  try {
    return HatSum(knots, force);
  } catch (const std::invalid_argument& wrong) {
    share.fail(knots_key, wrong.what());
  }
}

}  // namespace

HatSum::HatSum(std::span<const double> knots, std::span<const double> values) {
  const auto require = [](bool holds, const std::string& what) {
    if (!holds) throw std::invalid_argument(what);
  };
  require(knots.size() >= 3 && knots.size() <= most_knots,
          fmt::format("{} knots (allowed: 3 to {})", knots.size(), most_knots));
  require(values.size() == knots.size(),
          fmt::format("{} values at {} knots (allowed: a value a knot)", values.size(), knots.size()));
  for (std::size_t i = 0; i < knots.size(); ++i) {
    require(std::isfinite(knots[i]) && std::isfinite(values[i]), "not a number (allowed: finite numbers)");
    require(i == 0 || knots[i - 1] < knots[i],
            fmt::format("{:g} after {:g} (allowed: increasing knots)", knots[i], i ? knots[i - 1] : 0.0));
  }
  require(values.front() == 0.0 && values.back() == 0.0,
          "the first or last value is not 0 (allowed: 0, nothing is known beyond)");
  size_ = knots.size();
  std::ranges::copy(knots, knots_.begin());
  std::ranges::copy(values, values_.begin());
  double before = 0.0;
  for (std::size_t i = 0; i + 1 < size_; ++i) {
    const double slope = (values_[i + 1] - values_[i]) / (knots_[i + 1] - knots_[i]);
    bends_[i] = slope - before;
    before = slope;
  }
  low_ = knots_[0];
  high_ = knots_[size_ - 1];
  for (std::size_t i = 0; i + 1 < size_; ++i)  // what rounding makes of a bend at the other end
    require(
        std::abs(bends_[i]) * (high_ - low_) * std::numeric_limits<double>::epsilon() <= rest_tolerance_n,
        fmt::format("knots too close for their forces at {:g} (allowed: bends that rounding leaves alone)", knots_[i]));
}

ForceResidual read_force_residual(TableReader& table) {
  ForceResidual residual;
  residual.velocity = read_share(table, "velocity", "knots_m_s");
  residual.position = read_share(table, "position", "knots_m");
  if (std::abs(residual.velocity.at(0.0)) > rest_tolerance_n)
    table.table("velocity")
        .fail("force_n",
              fmt::format("{:g} N at rest (allowed: 0 at velocity 0, a knot there)", residual.velocity.at(0.0)));
  if (table.has("identified")) static_cast<void>(table.table("identified"));
  table.finish();
  return residual;
}

}  // namespace solenoid
