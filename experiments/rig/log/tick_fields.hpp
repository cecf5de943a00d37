#pragma once

#include "core/rt/recorder.hpp"
#include "core/system/description.hpp"

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace solenoid {

/// One number of a tick record.
struct TickField {
  std::string name, meaning;
  std::function<double(const TickRecord&)> get;
  std::function<void(TickRecord&, double)> set;
  bool exact;  ///< written with all its digits, so that a replay starts from the same numbers
};

/// The numbers of a system's ticks: the one list that JSON, its schema, CSV and reading back share.
class TickFormat {
 public:
  explicit TickFormat(const SystemDescription& system);

  const SystemDescription& system() const { return *system_; }
  std::span<const TickField> fields() const { return fields_; }

  /// The record as one JSON object; what is no number becomes null. `out` is replaced.
  void json(const TickRecord& tick, std::string& out) const;
  /// The inverse; missing fields keep their defaults. Throws ConfigError for what is no such object.
  TickRecord from_json(std::string_view json) const;
  /// JSON schema of json().
  std::string schema() const;

  std::string csv_heading() const;
  void csv(const TickRecord& tick, std::string& out) const;       ///< appends a line
  std::string csv_text(std::span<const TickRecord> ticks) const;  ///< heading and lines

 private:
  const SystemDescription* system_;
  std::vector<TickField> fields_;
};

}  // namespace solenoid
