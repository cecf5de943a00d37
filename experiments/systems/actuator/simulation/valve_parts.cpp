#include "experiments/systems/actuator/simulation/valve_parts.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/embedded.hpp"

#include <algorithm>
#include <map>

namespace solenoid {
namespace {

constexpr double seconds_a_year = 365.25 * 24 * 3600;
constexpr double most_years = 1000.0;

struct Part {
  double price_usd = 0.0;
  std::optional<double> rated_changes{};
};

Part read_part(TableReader table) {
  for (const char* said : {"what", "price_source", "life_source", "timing_source"}) table.text(said);
  table.text_or("dwell_source", "");
  for (const char* time : {"energise_ms", "deenergise_ms", "least_on_ms", "least_off_ms"})
    if (table.has(time)) table.number(time, Range::non_negative());
  Part part{table.number("price_usd", Range::positive())};
  if (table.has("rated_changes")) part.rated_changes = table.number("rated_changes", Range::positive());
  table.finish();
  return part;
}

std::map<std::string, ValveHardware> read_hardware() {
  const std::string name = "parts/valves.toml";
  TableReader file = TableReader::from_text(std::string(embedded_text(name)), name);
  std::map<std::string, Part> parts;
  TableReader part_tables = file.table("part");
  for (const std::string& part : part_tables.keys()) parts.emplace(part, read_part(part_tables.table(part)));
  std::map<std::string, ValveHardware> all;
  TableReader configurations = file.table("configuration");
  for (const std::string& configuration : configurations.keys()) {
    TableReader bill = configurations.table(configuration);
    ValveHardware& hardware = all[configuration];
    for (const auto& [part, what] : parts) {
      const int count = bill.integer_or(part, 0, 0, 1000);
      if (count == 0) continue;
      hardware.valves += count;
      hardware.price_usd += count * what.price_usd;
      if (what.rated_changes)
        hardware.rated_changes = std::min(hardware.rated_changes.value_or(*what.rated_changes), *what.rated_changes);
    }
    bill.finish();
  }
  return all;
}

}  // namespace

const ValveHardware& valve_hardware(const std::string& configuration) {
  static const std::map<std::string, ValveHardware> all = read_hardware();
  static const ValveHardware unknown;
  const auto found = all.find(configuration);
  return found == all.end() ? unknown : found->second;
}

double life_years(const ValveHardware& hardware, double changes_per_s) {
  if (!hardware.rated_changes) return 0.0;
  return changes_per_s > 0.0 ? std::min(most_years, *hardware.rated_changes / changes_per_s / seconds_a_year)
                             : most_years;
}

}  // namespace solenoid
