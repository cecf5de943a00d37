#include "experiments/systems/actuator/identify/experiment.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/embedded.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr const char* shipped_name = "tasks/identification.toml";
constexpr double longest_way_m = 0.13;  // the stroke

ChamberAction read_action(TableReader& table, const char* key) {
  const std::string text = table.text_or(key, "exhaust", {"exhaust", "fill", "blocked", "random"});
  return text == "exhaust"   ? ChamberAction::exhaust
         : text == "fill"    ? ChamberAction::fill
         : text == "blocked" ? ChamberAction::blocked
                             : ChamberAction::random;
}

ExperimentStep read_step(TableReader& table) {
  const ActuatorParameters p;
  const Range stroke = Range::between(p.position_min_m(), p.position_max_m());
  const Range force = Range::between(-p.motor_force_limit_n(), p.motor_force_limit_n());
  ExperimentStep s;
  s.label = table.text_or("label", "");
  s.a = read_action(table, "a");
  s.b = read_action(table, "b");
  s.random_bit_s = table.number_or("random_bit_s", s.random_bit_s, Range::between(0.006, 10.0));
  if (table.has("motor_n") && (table.has("motor_from_n") || table.has("motor_to_n")))
    table.fail("motor_n", "beside motor_from_n and motor_to_n (allowed: one force, or a line from one to another)");
  s.motor_from_n = s.motor_to_n = table.number_or("motor_n", 0.0, force);
  s.motor_from_n = table.number_or("motor_from_n", s.motor_from_n, force);
  s.motor_to_n = table.number_or("motor_to_n", s.motor_to_n, force);
  s.sine_n = table.number_or("sine_n", 0.0, force);
  s.sine_hz = table.number_or("sine_hz", 1.0, Range::between(0.01, 50.0));
  if (table.has("hold_m")) s.hold_m = table.number("hold_m", stroke);
  if (table.has("to_m")) {
    if (s.hold_m) table.fail("to_m", "beside hold_m (allowed: one of them)");
    s.to_m = table.number("to_m", stroke);
    s.speed_m_s = table.number("speed_m_s", {0.0, 0.5, true});
    s.seconds = table.number_or("seconds", longest_way_m / s.speed_m_s, {0.0, 3600.0, true});
  } else {
    s.seconds = table.number("seconds", {0.0, 3600.0, true});
  }
  if (table.has("until_moved_m")) s.until_moved_m = table.number("until_moved_m", {0.0, 0.1, true});
  table.finish();
  return s;
}

Experiment read_experiment(TableReader& table) {
  Experiment e;
  e.name = table.text("name");
  e.about = table.text_or("about", "");
  e.prepare = table.text_or("prepare", "");
  const bool vertical = table.text_or("plane", "horizontal", {"horizontal", "vertical"}) == "vertical";
  e.plane = vertical ? Plane::vertical : Plane::horizontal;
  e.loaded = table.boolean_or("loaded", false);
  const ActuatorParameters p;
  e.start_m = table.number_or("start_m", e.start_m, Range::between(p.position_min_m(), p.position_max_m()));
  e.stiffness = table.number_or("stiffness", e.stiffness, Range::between(0.0, 1e5));
  e.damping = table.number_or("damping", e.damping, Range::between(0.0, 1e4));
  e.cycles = table.integer_or("cycles", 1, 1, 10000);
  for (TableReader& step : table.tables("step")) e.steps.push_back(read_step(step));
  if (e.steps.empty()) table.fail("step", "missing (allowed: at least one [[experiment.step]])");
  if (e.longest_s() > 3600) table.fail("cycles", "may last longer than an hour (allowed: less)");
  table.finish();
  return e;
}

}  // namespace

double Experiment::longest_s() const {
  double sum = 0;
  for (const ExperimentStep& s : steps) sum += s.seconds;
  return cycles * sum;
}

std::vector<Experiment> read_experiments(TableReader& table) {
  std::vector<Experiment> all;
  for (TableReader& one : table.tables("experiment")) {
    all.push_back(read_experiment(one));
    if (std::ranges::count(all, all.back().name, &Experiment::name) > 1)
      one.fail("name", fmt::format("'{}' is there twice (allowed: one experiment a name)", all.back().name));
  }
  if (all.empty()) table.fail("experiment", "missing (allowed: at least one table headed [[experiment]])");
  table.finish();
  return all;
}

std::vector<Experiment> read_experiments_file(const std::string& path) {
  TableReader table = TableReader::from_file(path);
  return read_experiments(table);
}

const std::vector<Experiment>& shipped_experiments() {
  static const std::vector<Experiment> all = [] {
    TableReader table = TableReader::from_text(std::string(embedded_text(shipped_name)), shipped_name);
    return read_experiments(table);
  }();
  return all;
}

}  // namespace solenoid
