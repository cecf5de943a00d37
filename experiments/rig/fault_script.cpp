#include "experiments/rig/fault_script.hpp"

#include "core/config/reader.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <string_view>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr std::string_view swapped_sensor = "swapped";

struct Kind {
  std::string target, name, unit;  ///< unit of its value; empty: it has none
  bool below_zero = false;         ///< whether its value may be
};

/// What a system's script may say; the target "sensor" stands for each measured channel.
std::vector<Kind> kinds_of(const SimulatedSystem& system) {
  std::vector<Kind> kinds = {
      {"sensor", "off", ""},           {"sensor", "stuck", ""},
      {"sensor", "garbage", ""},       {"sensor", "offset", "VALUE", true},
      {"sensor", "slow", "S"},         {"sensor", "delayed", "S"},
      {"sensor", "intermittent", "S"}, {"sensor", "inverted", ""},
      {"sensor", "gain", "FACTOR"},    {"sensor", "swapped", "SENSOR"},
  };
  for (const ActuationFault& fault : system.actuation_faults())
    kinds.push_back(
        {fault.of_switch == SwitchFaultKind::none ? fault.target : fault.target + "_NAME", fault.kind, fault.unit});
  for (const Kind& kind :
       {Kind{"packets", "lost", "SHARE"}, Kind{"packets", "late", "MS"}, Kind{"packets", "jitter", "MS"},
        Kind{"packets", "repeated", "SHARE"}, Kind{"packets", "corrupt", "SHARE"}, Kind{"process", "killed", ""},
        Kind{"process", "stopped", "S"}, Kind{"process", "crashed", ""}, Kind{"solver", "late", "MS"},
        Kind{"solver", "hang", ""}, Kind{"solver", "nan", ""}, Kind{"solver", "throw", ""}, Kind{"disk", "slow", "MS"},
        Kind{"disk", "full", ""}, Kind{"disk", "read_only", ""}})
    kinds.push_back(kind);
  return kinds;
}

/// Whether a script's target is a kind's: "coil_NAME" stands for each of the coils, which the variant has.
bool is_target(const std::string& kinds, const std::string& target) {
  constexpr std::string_view any = "NAME";
  if (!kinds.ends_with(any)) return kinds == target;
  const std::size_t length = kinds.size() - any.size();
  return target.size() > length && target.compare(0, length, kinds, 0, length) == 0;
}

/// A script under way, for messages.
struct Script {
  const std::string& text;
  const SimulatedSystem& system;
  [[noreturn]] void refuse(const std::string& problem) const {
    throw ConfigError(fmt::format("fault '{}': {} (allowed: {})", text, problem, fault_help(system)));
  }
};

double number(const Script& script, const std::string& part, const char* what) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
  if (error != std::errc() || end != part.data() + part.size() || !std::isfinite(value))
    script.refuse(fmt::format("'{}' is no {}", part, what));
  return value;
}

/// The number of the channel that a sensor is swapped with.
double other_channel(const Script& script, const std::string& sensor, const std::string& other) {
  const auto& channels = script.system.system().description().channels;
  const auto at = std::ranges::find(channels, other, &Signal::name);
  if (at == channels.end()) script.refuse(fmt::format("'{}' is no sensor", other));
  if (other == sensor) script.refuse(fmt::format("'{}' is not another sensor", other));
  return static_cast<double>(at - channels.begin());
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

InjectedFault parse_fault(const std::string& text, const SimulatedSystem& system) {
  const Script script{text, system};
  InjectedFault fault;
  std::string rest = text;
  const auto when = cut_tail(rest, '@');
  if (!when) script.refuse("says no time");
  std::string from = *when;
  const auto duration = cut_tail(from, '+');
  fault.from_s = number(script, from, "time");
  fault.until_s =
      duration ? fault.from_s + number(script, *duration, "duration") : std::numeric_limits<double>::infinity();
  const auto value = cut_tail(rest, '=');
  const auto kind = cut_tail(rest, ':');
  if (!kind) script.refuse("names no kind of fault");
  fault.target = rest;
  fault.kind = *kind;
  const auto& channels = system.system().description().channels;
  const bool sensor = std::ranges::count(channels, rest, &Signal::name) > 0;
  for (const Kind& k : kinds_of(system)) {
    if (!is_target(k.target, sensor ? "sensor" : rest) || fault.kind != k.name) continue;
    const bool wants = !k.unit.empty();
    if (wants != value.has_value()) script.refuse(wants ? "says no value" : "takes no value");
    if (value)
      fault.value = k.name == swapped_sensor ? other_channel(script, rest, *value) : number(script, *value, "value");
    if (fault.value < 0 && !k.below_zero) script.refuse(fmt::format("{} is below 0", *value));
    if (k.name == "gain" && fault.value == 0.0) script.refuse("a gain of 0 is 'off'");
    return fault;
  }
  script.refuse("is not known");
}

std::vector<InjectedFault> parse_faults(const std::vector<std::string>& texts, const SimulatedSystem& system) {
  std::vector<InjectedFault> faults;
  faults.reserve(texts.size());
  for (const std::string& text : texts) faults.push_back(parse_fault(text, system));
  return faults;
}

std::string fault_help(const SimulatedSystem& system) {
  std::string list, channels;
  for (const Kind& k : kinds_of(system))
    list += fmt::format("{}{}:{}{}{}", list.empty() ? "" : ", ", k.target, k.name, k.unit.empty() ? "" : "=", k.unit);
  for (const Signal& channel : system.system().description().channels)
    channels += (channels.empty() ? "" : ", ") + channel.name;
  return fmt::format("TARGET:KIND@FROM_S[+DURATION_S], sensor one of {}: {}", channels, list);
}

}  // namespace solenoid
