#include "experiments/systems/actuator/commission/commission_record.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/base/result.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

std::size_t place_of(const std::string& step) {
  const auto& all = commission_steps();
  return static_cast<std::size_t>(std::ranges::find(all, step, [](const StepInfo& s) { return std::string(s.name); }) -
                                  all.begin());
}

StepVerdict verdict_of(const std::string& text) {
  for (const StepVerdict v : {StepVerdict::passed, StepVerdict::failed, StepVerdict::skipped, StepVerdict::stopped})
    if (text == to_string(v)) return v;
  throw ConfigError(fmt::format("verdict '{}' (allowed: passed, failed, skipped, stopped)", text));
}

Json json_of(const Measured& m) {
  Json json = {{"name", m.name}, {"value", m.value}, {"unit", m.unit}};
  if (m.low) json["low"] = *m.low;
  if (m.high) json["high"] = *m.high;
  return json;
}

Json json_of(const StepOutcome& o) {
  const std::size_t place = place_of(o.name);
  Json json = {{"name", o.name},
               {"verdict", to_string(o.verdict)},
               {"criterion", commission_steps()[place].criterion},
               {"at", o.at},
               {"seconds", o.seconds},
               {"measured", Json::array()},
               {"findings", o.findings},
               {"note", o.note}};
  for (const Measured& m : o.measured) json["measured"].push_back(json_of(m));
  return json;
}

double number(const Json& json) {
  const double value = json.get<double>();
  if (!std::isfinite(value)) throw ConfigError("a value that is no finite number");
  return value;
}

StepOutcome outcome_of(const Json& json) {
  StepOutcome o;
  o.name = json.at("name").get<std::string>();
  if (place_of(o.name) == commission_steps().size()) throw ConfigError(fmt::format("no step is called '{}'", o.name));
  o.verdict = verdict_of(json.at("verdict").get<std::string>());
  o.at = json.at("at").get<std::string>();
  o.seconds = number(json.at("seconds"));
  o.findings = json.at("findings").get<std::vector<std::string>>();
  o.note = json.at("note").get<std::string>();
  for (const Json& m : json.at("measured")) {
    Measured measured{m.at("name").get<std::string>(), number(m.at("value")), m.at("unit").get<std::string>()};
    if (m.contains("low")) measured.low = number(m.at("low"));
    if (m.contains("high")) measured.high = number(m.at("high"));
    o.measured.push_back(std::move(measured));
  }
  return o;
}

}  // namespace

std::string text_of(const Measured& m) {
  std::string text = fmt::format("{} {:.4g}{}{}", m.name, m.value, m.unit.empty() ? "" : " ", m.unit);
  if (m.low && m.high)
    text += fmt::format(" ({:.4g} to {:.4g})", *m.low, *m.high);
  else if (m.low)
    text += fmt::format(" (from {:.4g})", *m.low);
  else if (m.high)
    text += fmt::format(" (up to {:.4g})", *m.high);
  return text;
}

void CommissionRecord::add(StepOutcome outcome) {
  std::erase_if(steps, [&](const StepOutcome& o) { return o.name == outcome.name; });
  const std::size_t place = place_of(outcome.name);
  const auto after = std::ranges::find_if(steps, [&](const StepOutcome& o) { return place_of(o.name) > place; });
  steps.insert(after, std::move(outcome));
}

void CommissionRecord::forget_from(const std::string& step) {
  std::erase_if(steps, [&](const StepOutcome& o) { return place_of(o.name) >= place_of(step); });
}

std::vector<std::string> CommissionRecord::findings() const {
  std::vector<std::string> all;
  for (const StepOutcome& o : steps) all.insert(all.end(), o.findings.begin(), o.findings.end());
  return all;
}

bool CommissionRecord::all_good() const {
  return std::ranges::any_of(steps, [](const StepOutcome& o) { return o.verdict == StepVerdict::passed; }) &&
         std::ranges::none_of(steps, [](const StepOutcome& o) {
           return o.verdict == StepVerdict::failed || o.verdict == StepVerdict::stopped;
         });
}

std::string CommissionRecord::json() const {
  Json json = {{"variant", variant}, {"plant", plant}, {"plane", plane}, {"steps", Json::array()}};
  for (const StepOutcome& o : steps) json["steps"].push_back(json_of(o));
  return json.dump(1) + "\n";
}

CommissionRecord CommissionRecord::parse(const std::string& text, const std::string& name) {
  const Json json = parse_json(text, name);
  CommissionRecord record;
  try {
    record.variant = json.at("variant").get<std::string>();
    record.plant = json.at("plant").get<std::string>();
    record.plane = json.at("plane").get<std::string>();
    for (const Json& step : json.at("steps")) record.add(outcome_of(step));
  } catch (const Json::exception& error) {
    throw ConfigError(fmt::format("{}: {} (allowed: what commission has written)", name, problem_with_json(error)));
  } catch (const ConfigError& error) {
    throw ConfigError(fmt::format("{}: {} (allowed: what commission has written)", name, error.what()));
  }
  return record;
}

Result result_of(const CommissionRecord& record) {
  Table steps{.name = "steps",
              .columns = {{"step", "step", "<"}, {"verdict", "verdict", "<"}, {"remarks", "remarks", "<"}}};
  for (const StepOutcome& o : record.steps) steps.add({o.name, to_string(o.verdict), o.note});
  Result result{.facts = {{"variant", record.variant},
                          {"plant", record.plant},
                          {"plane", record.plane},
                          {"findings", record.findings()}},
                .tables = {steps}};
  for (const std::string& what : record.findings()) result.notes.push_back("FOUND " + what);
  std::string left_out;
  for (const StepOutcome& o : record.steps)
    if (o.verdict == StepVerdict::skipped) left_out += (left_out.empty() ? "" : ", ") + o.name;
  if (record.all_good()) result.notes.emplace_back("nothing found");
  if (!left_out.empty()) result.notes.push_back("not done: " + left_out);
  return result;
}

Result steps_result() {
  Table steps{.name = "steps",
              .columns = {{"step", "step", "<"}, {"what", "what is done", "<"}, {"criterion", "passed if", "<"}}};
  for (const StepInfo& s : commission_steps()) steps.add({s.name, s.what, s.criterion});
  return {.tables = {steps}};
}

}  // namespace solenoid
