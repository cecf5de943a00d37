#include "experiments/systems/actuator/sizing/size_task.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/embedded.hpp"
#include "experiments/systems/actuator/sizing/size_output.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <functional>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

constexpr double degree = std::numbers::pi / 180;

void section(TableReader& table, const char* key, const std::function<void(TableReader&)>& read) {
  if (!table.has(key)) return;
  TableReader inner = table.table(key);
  read(inner);
  inner.finish();
}

void read_motion(TableReader& t, ArmMotion& m) {
  const std::string now = m.law == ArmMotionLaw::cycloidal ? "cycloidal"
                          : m.law == ArmMotionLaw::quintic ? "quintic"
                                                           : "cosine";
  const std::string law = t.text_or("kind", now, {"cycloidal", "quintic", "cosine"});
  m.law = law == "cycloidal" ? ArmMotionLaw::cycloidal
          : law == "quintic" ? ArmMotionLaw::quintic
                             : ArmMotionLaw::cosine;
  m.from_rad = degree * t.number_or("from_deg", m.from_rad / degree, Range::between(-360.0, 360.0));
  m.total_rad = degree * t.number_or("total_deg", m.total_rad / degree, Range::between(-360.0, 360.0));
  if (m.total_rad == 0.0) t.fail("total_deg", "is no motion (allowed: -360 to 360, not 0)");
  m.move_s = t.number_or("move_s", m.move_s, {0.0, 3600.0, true});
}

void read_cylinder(TableReader& t, SizingTask& task) {
  task.supply_gauge_pa = t.number_or("supply_gauge_pa", task.supply_gauge_pa, Range::positive());
  task.rod_diameter_m = millimetre * t.number_or("rod_mm", task.rod_diameter_m / millimetre, Range::non_negative());
  task.stroke_m = millimetre * t.number_or("stroke_mm", task.stroke_m / millimetre, Range::positive());
  if (t.has("bore_mm")) task.bore_m = millimetre * t.number("bore_mm", Range::positive());
  if (task.bore_m && !(task.rod_diameter_m < *task.bore_m))
    t.fail(t.has("bore_mm") ? "bore_mm" : "rod_mm", "the rod fills the bore (allowed: rod_mm less than bore_mm)");
  if (!t.has("standard_bores_mm")) return;
  task.standard_bores_m = t.numbers("standard_bores_mm", Range::positive());
  if (task.standard_bores_m.empty() || !std::ranges::is_sorted(task.standard_bores_m))
    t.fail("standard_bores_mm", "not in order (allowed: at least one bore, rising)");
  for (double& bore : task.standard_bores_m) bore *= millimetre;
}

void read_gear(TableReader& t, SizingTask& task) {
  task.module_m = millimetre * t.number_or("module_mm", task.module_m / millimetre, Range::positive());
  task.gear_teeth = t.integer_or("teeth", task.gear_teeth, 12, 10000);
  task.pinion_teeth = t.integer_or("pinion_teeth", task.pinion_teeth, 12, 10000);
  task.face_width_m = millimetre * t.number_or("face_width_mm", task.face_width_m / millimetre, Range::positive());
  task.tooth_strength_pa = t.number_or("strength_pa", task.tooth_strength_pa, Range::positive());
}

PrintedFigure read_printed_figure(TableReader& t) {
  PrintedFigure figure{t.text("value"), t.text_or("at", ""), t.text_or("note", "")};
  const char* end = figure.text.data() + figure.text.size();
  const auto [rest, error] = std::from_chars(figure.text.data(), end, figure.value, std::chars_format::fixed);
  if (error != std::errc() || rest != end || !std::isfinite(figure.value))
    t.fail("value", fmt::format("'{}' is no printed number (allowed: digits in quotes, \"61.33\")", figure.text));
  t.finish();
  return figure;
}

void read_printed(TableReader& t, SizingInput& input) {
  const std::vector<std::string> known = printable_quantities();
  for (const std::string& key : known) {
    if (!t.has(key)) continue;
    TableReader figure = t.table(key);
    input.printed.emplace(key, read_printed_figure(figure));
  }
}

/// `input`: what is true of keys that the table leaves out.
SizingInput read_task(TableReader& table, SizingInput input) {
  SizingTask& task = input.task;
  input.printed.clear();
  task.name = table.text_or("name", task.name);
  task.vertical =
      table.text_or("plane", task.vertical ? "vertical" : "horizontal", {"vertical", "horizontal"}) == "vertical";
  task.gravity = table.number_or("gravity", task.gravity, Range::non_negative());
  section(table, "arm", [&](TableReader& t) {
    task.arm_mass_kg = t.number_or("mass_kg", task.arm_mass_kg, Range::non_negative());
    task.arm_length_m = t.number_or("length_m", task.arm_length_m, Range::positive());
    task.payload_kg = t.number_or("payload_kg", task.payload_kg, Range::non_negative());
  });
  section(table, "motion", [&](TableReader& t) { read_motion(t, task.motion); });
  section(table, "slide", [&](TableReader& t) {
    task.slide_mass_kg = t.number_or("mass_kg", task.slide_mass_kg, Range::non_negative());
    task.coulomb_friction_n = t.number_or("coulomb_friction_n", task.coulomb_friction_n, Range::non_negative());
    task.viscous_friction = t.number_or("viscous_friction", task.viscous_friction, Range::non_negative());
  });
  section(table, "cylinder", [&](TableReader& t) { read_cylinder(t, task); });
  section(table, "gear", [&](TableReader& t) { read_gear(t, task); });
  section(table, "motor",
          [&](TableReader& t) { task.motor_share = t.number_or("share", task.motor_share, Range::between(0.0, 1.0)); });
  section(table, "printed", [&](TableReader& t) { read_printed(t, input); });
  table.finish();
  if (!(task.arm_mass_kg + task.payload_kg > 0))
    table.fail("arm", "nothing to be moved (allowed: mass_kg or payload_kg above 0)");
  return input;
}

}  // namespace

double PrintedFigure::half_digit() const {
  const std::size_t point = text.find('.');
  const double decimals = point == std::string::npos ? 0.0 : static_cast<double>(text.size() - point - 1);
  return 0.5 * std::pow(10.0, -decimals);
}

const SizingInput& thesis_sizing() {
  static const SizingInput input = [] {
    TableReader table = TableReader::from_text(std::string(embedded_text("tasks/sizing.toml")), "tasks/sizing.toml");
    return read_task(table, {});
  }();
  return input;
}

SizingInput read_sizing_file(const std::string& path) {
  TableReader table = TableReader::from_file(path);
  SizingInput base = thesis_sizing();
  base.task.name = std::filesystem::path(path).stem().string();
  base.task.bore_m.reset();
  return read_task(table, base);
}

SizingInput with_settings(const SizingInput& input, const std::vector<std::string>& settings) {
  if (settings.empty()) return input;
  std::string text;
  for (const std::string& setting : settings) {
    const std::size_t equals = setting.find('=');
    if (equals == std::string::npos || equals == 0 || setting.find('\n') != std::string::npos)
      throw ConfigError(fmt::format("--set: '{}' is no setting (allowed: KEY=VALUE, as arm.payload_kg=1.5)", setting));
    text += setting + "\n";
  }
  TableReader table = TableReader::from_text(text, "--set");
  SizingInput changed = input;
  changed.task.name += fmt::format(" with {}", fmt::join(settings, ", "));
  return read_task(table, changed);
}

}  // namespace solenoid
