#pragma once

#include "core/rt/recorder.hpp"
#include "core/system/description.hpp"

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace solenoid {

/// One number of a tick record.
struct TickField {
  std::string name, meaning;
  std::function<double(const TickRecord&)> get;
  std::function<void(TickRecord&, double)> set;
  bool exact;  ///< written with all its digits, so that a replay starts from the same numbers
  bool whole;  ///< a whole number, which is never missing
  double low, high;
  /// What a log may say instead of `value`; nothing if it may say that.
  std::optional<std::string> refusal(double value) const;
};

/// The numbers of a system's ticks: the one list that JSON, its schema, CSV and reading back share.
class TickFormat {
 public:
  explicit TickFormat(const SystemDescription& system);

  const SystemDescription& system() const { return *system_; }
  std::span<const TickField> fields() const { return fields_; }

  /// The record as one JSON object; what is no number becomes null. `out` is replaced.
  void json(const TickRecord& tick, std::string& out) const;
  /// The inverse. Time, channels and written switches must be there, other fields keep their defaults. Throws
  /// ConfigError, which does not know the file, for what is no such object, and for values that no tick has.
  TickRecord from_json(std::string_view json) const;
  /// JSON schema of json().
  std::string schema() const;

  std::string csv_heading() const;
  void csv(const TickRecord& tick, std::string& out) const;       ///< appends a line
  std::string csv_text(std::span<const TickRecord> ticks) const;  ///< heading and lines

 private:
  /// Where a name is in fields(), most likely at `expected`.
  std::optional<std::size_t> find(const std::string& name, std::size_t expected) const;

  const SystemDescription* system_;
  std::vector<TickField> fields_;
  std::unordered_map<std::string, std::size_t> places_;
  std::vector<std::size_t> needed_;
};

}  // namespace solenoid
