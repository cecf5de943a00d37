#pragma once

#include "core/rt/recorder.hpp"

#include <span>
#include <string>
#include <string_view>

namespace solenoid {

/// One number of a tick record: the one list that JSON, its schema, CSV and reading back share.
struct TickField {
  const char* name;
  const char* meaning;
  double (*get)(const TickRecord&);
  void (*set)(TickRecord&, double);
  bool exact;  ///< written with all its digits, so that a replay starts from the same numbers
};
std::span<const TickField> tick_fields();

/// The record as one JSON object; what is no number becomes null. `out` is replaced.
void tick_json(const TickRecord& tick, std::string& out);
/// The inverse; missing fields keep their defaults. Throws ConfigError for what is no such object.
TickRecord tick_from_json(std::string_view json);
/// JSON schema of tick_json.
std::string tick_schema();

std::string tick_csv_heading();
void tick_csv(const TickRecord& tick, std::string& out);       ///< appends a line
std::string tick_csv_text(std::span<const TickRecord> ticks);  ///< heading and lines

}  // namespace solenoid
