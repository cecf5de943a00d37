#include "experiments/rig/fault_script.hpp"

#include "core/config/reader.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

#include <fmt/format.h>

namespace solenoid {
namespace {

struct Kind {
  const char* target;
  const char* name;
  const char* unit;  ///< of its value; empty: it has none
};
constexpr std::array kinds = {
    Kind{"sensor", "off", ""},
    Kind{"sensor", "stuck", ""},
    Kind{"sensor", "garbage", ""},
    Kind{"sensor", "offset", "M_OR_PA"},
    Kind{"sensor", "slow", "S"},
    Kind{"sensor", "delayed", "S"},
    Kind{"sensor", "intermittent", "S"},
    Kind{"valves", "stuck", ""},
    Kind{"valves", "swapped", ""},
    Kind{"supply", "lost", ""},
    Kind{"packets", "lost", "SHARE"},
    Kind{"packets", "late", "MS"},
    Kind{"packets", "repeated", "SHARE"},
    Kind{"packets", "corrupt", "SHARE"},
    Kind{"process", "killed", ""},
    Kind{"process", "stopped", "S"},
    Kind{"process", "crashed", ""},
    Kind{"solver", "late", "MS"},
    Kind{"solver", "hang", ""},
    Kind{"solver", "nan", ""},
    Kind{"solver", "throw", ""},
    Kind{"disk", "slow", "MS"},
    Kind{"disk", "full", ""},
    Kind{"disk", "read_only", ""},
};

[[noreturn]] void refuse(const std::string& text, const std::string& problem) {
  throw ConfigError(fmt::format("fault '{}': {} (allowed: {})", text, problem, fault_help()));
}

double number(const std::string& text, const std::string& part, const char* what) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
  if (error != std::errc() || end != part.data() + part.size() || !std::isfinite(value))
    refuse(text, fmt::format("'{}' is no {}", part, what));
  return value;
}

/// Cuts what follows the last `mark` off `text`.
std::optional<std::string> cut_tail(std::string& text, char mark) {
  const std::size_t at = text.rfind(mark);
  if (at == std::string::npos) return std::nullopt;
  std::string tail = text.substr(at + 1);
  text.resize(at);
  return tail;
}

}  // namespace

InjectedFault parse_fault(const std::string& text) {
  InjectedFault fault;
  std::string rest = text;
  const auto when = cut_tail(rest, '@');
  if (!when) refuse(text, "says no time");
  std::string from = *when;
  const auto duration = cut_tail(from, '+');
  fault.from_s = number(text, from, "time");
  fault.until_s =
      duration ? fault.from_s + number(text, *duration, "duration") : std::numeric_limits<double>::infinity();
  const auto value = cut_tail(rest, '=');
  const auto kind = cut_tail(rest, ':');
  if (!kind) refuse(text, "names no kind of fault");
  fault.target = rest;
  fault.kind = *kind;
  const bool sensor = rest == "position" || rest == "pressure_a" || rest == "pressure_b";
  for (const Kind& k : kinds) {
    if ((sensor ? "sensor" : rest) != k.target || fault.kind != k.name) continue;
    const bool wants = *k.unit != '\0';
    if (wants != value.has_value()) refuse(text, wants ? "says no value" : "takes no value");
    if (value) fault.value = number(text, *value, "value");
    return fault;
  }
  refuse(text, "is not known");
}

std::vector<InjectedFault> parse_faults(const std::vector<std::string>& texts) {
  std::vector<InjectedFault> faults;
  for (const std::string& text : texts) faults.push_back(parse_fault(text));
  return faults;
}

std::string fault_help() {
  std::string list;
  for (const Kind& k : kinds)
    list += fmt::format("{}{}:{}{}{}", list.empty() ? "" : ", ", k.target, k.name, *k.unit ? "=" : "", k.unit);
  return "TARGET:KIND@FROM_S[+DURATION_S], sensor one of position, pressure_a, pressure_b: " + list;
}

}  // namespace solenoid
