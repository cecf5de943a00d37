#include "experiments/tune/free_parameter.hpp"

#include "core/config/reader.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include <fmt/format.h>

namespace solenoid {
namespace {

[[noreturn]] void refuse(const std::string& text, const std::string& problem) {
  throw ConfigError(
      fmt::format("--free '{}': {} (allowed: KEY=LOW..HIGH, KEY=LOW..HIGH:log, KEY=LOW..HIGH:whole; LOW below HIGH, "
                  "above 0 for log)",
                  text, problem));
}

double number(const std::string& text, std::string_view part) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
  if (error != std::errc() || end != part.data() + part.size() || !std::isfinite(value))
    refuse(text, fmt::format("'{}' is no number", part));
  return value;
}

}  // namespace

double FreeParameter::at(double point) const {
  const double p = std::clamp(point, 0.0, 1.0);
  if (scale == Scale::logarithmic) return std::clamp(low * std::pow(high / low, p), low, high);
  const double value = low + p * (high - low);
  return scale == Scale::whole ? std::round(value) : value;
}

double FreeParameter::point(double value) const {
  const double v = std::clamp(value, low, high);
  return scale == Scale::logarithmic ? std::log(v / low) / std::log(high / low) : (v - low) / (high - low);
}

FreeParameter parse_free_parameter(const std::string& text) {
  FreeParameter p;
  const std::size_t equals = text.find('='), dots = text.find("..");
  if (equals == std::string::npos || equals == 0) refuse(text, "names no key");
  if (dots == std::string::npos || dots < equals) refuse(text, "gives no range");
  p.key = text.substr(0, equals);
  std::string high = text.substr(dots + 2);
  if (const std::size_t colon = high.find(':'); colon != std::string::npos) {
    const std::string scale = high.substr(colon + 1);
    if (scale != "log" && scale != "whole") refuse(text, fmt::format("'{}' is no scale", scale));
    p.scale = scale == "log" ? FreeParameter::Scale::logarithmic : FreeParameter::Scale::whole;
    high.resize(colon);
  }
  p.low = number(text, std::string_view(text).substr(equals + 1, dots - equals - 1));
  p.high = number(text, high);
  if (!(p.low < p.high)) refuse(text, "the range is empty");
  if (p.scale == FreeParameter::Scale::logarithmic && !(p.low > 0.0))
    refuse(text, "a logarithm of what is not above 0");
  if (p.scale == FreeParameter::Scale::whole && (p.low != std::round(p.low) || p.high != std::round(p.high)))
    refuse(text, "the ends are not whole");
  return p;
}

}  // namespace solenoid
