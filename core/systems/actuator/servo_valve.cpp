#include "core/systems/actuator/servo_valve.hpp"

#include "core/config/reader.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// A number of the valve's table: key, field, allowed range.
struct ServoField {
  const char* key;
  double ServoValve::*value;
  Range range;
};

const std::array<ServoField, 6>& servo_fields() {
  static const std::array<ServoField, 6> all = {
      {{"frequency_hz", &ServoValve::frequency_hz, Range::between(0.0, 1e3)},
       {"damping", &ServoValve::damping, Range::between(0.05, 0.99)},
       {"dead_band", &ServoValve::dead_band, Range::between(0.0, 0.5)},
       {"hysteresis", &ServoValve::hysteresis, Range::between(0.0, 0.5)},
       {"leakage", &ServoValve::leakage, Range::between(0.0, 0.2)},
       {"leakage_width", &ServoValve::leakage_width, Range::between(0.001, 1.0)}}};
  return all;
}

}  // namespace

double ServoValve::opening(double x) const noexcept {
  const double land = (x - dead_band) / (1.0 - dead_band),
               leak = leakage * std::clamp(1.0 + x / leakage_width, 0.0, 1.0);
  return std::min(std::max(land, leak), 1.0);
}

void read_servo_valve(TableReader& table, ServoValve& valve) {
  for (const ServoField& field : servo_fields())
    valve.*field.value = table.number_or(field.key, valve.*field.value, field.range);
  table.finish();
}

std::string servo_valve_problem(const ServoValve& valve) {
  for (const ServoField& field : servo_fields())
    if (const double value = valve.*field.value; !std::isfinite(value) || !field.range.contains(value))
      return fmt::format("key '{}': {} is refused (allowed: {})", field.key, value, field.range.text());
  return {};
}

SpoolStep::SpoolStep(const ServoValve& valve, double t) noexcept {
  if (valve.frequency_hz == 0.0) return;
  const double w = 2.0 * std::numbers::pi * valve.frequency_hz, decay = valve.damping * w;
  const double swing = w * std::sqrt(1.0 - valve.damping * valve.damping);
  const double envelope = std::exp(-decay * t);
  const double cosine = envelope * std::cos(swing * t), sine = envelope * std::sin(swing * t) / swing;
  xx = cosine + decay * sine, xv = sine;
  vx = -w * w * sine, vv = cosine - decay * sine;
}

void Spool::command(const ServoValve& valve, double c) noexcept {
  if (!std::isfinite(c)) return;
  const double half = valve.hysteresis / 2, cut = (1.0 + half) * std::clamp(c, -1.0, 1.0);
  target = std::max(cut - half, std::min(cut + half, target));
}

std::array<double, 2> signed_opening(const ServoValve& valve, const Spool& spool) noexcept {
  const double beyond = std::abs(spool.x) - valve.dead_band;
  if (beyond <= 0.0) return {0.0, 0.0};
  const double scale = 1.0 / (1.0 - valve.dead_band);
  return {std::copysign(scale * beyond, spool.x), scale * spool.v};
}

std::array<double, 4> ServoPair::openings(double command_a, double command_b) noexcept {
  std::array<double, 4> mean{};
  const std::array<double, 2> commands = {command_a, command_b};
  for (std::size_t i = 0; i < 2; ++i) {
    Spool spool = now_[i];
    spool.command(valve_, commands[i]);
    next_[i] = spool.after(step_);
    mean[2 * i] = 0.5 * (valve_.opening(spool.x) + valve_.opening(next_[i].x));
    mean[2 * i + 1] = 0.5 * (valve_.opening(-spool.x) + valve_.opening(-next_[i].x));
  }
  return mean;
}

std::array<double, 4> ServoPair::state() const noexcept {
  const auto a = signed_opening(valve_, now_[0]), b = signed_opening(valve_, now_[1]);
  return {a[0], a[1], b[0], b[1]};
}

}  // namespace solenoid
