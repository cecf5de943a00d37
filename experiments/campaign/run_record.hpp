#pragma once

#include "core/metrics/metrics.hpp"
#include "experiments/campaign/campaign.hpp"

#include <optional>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace solenoid {

/// One run as it is kept and reported: what it was, how it ended and, if it ended well, its metrics.
///
/// status   "ok" | "unstable": a state was not finite | "failed: REASON": an exception or a crash; its first line says what
struct RunRecord {
  std::string variant, scenario, trajectory;
  std::vector<double> conditions;  ///< of the scenario, in the order of the system's description
  std::uint64_t seed = 1;
  std::string status;
  std::optional<Metrics> metrics;  ///< with status "ok" only
  std::string system = {};         ///< its name; none: the first there is

  bool ok() const { return status == "ok"; }
  bool failed() const { return status.starts_with("failed"); }
};

/// Of a status, for tables and lists.
std::string first_line(const std::string& text);

/// The system that a record is of.
const SystemDescription& description_of(const RunRecord& record);

/// The record of a finished simulation.
RunRecord record_of(const Campaign& campaign, const CampaignRun& run, const Metrics& metrics);
RunRecord failed_record(const Campaign& campaign, const CampaignRun& run, const std::string& reason);

/// The run's object in `{"runs": [...]}`: names of the design, metrics only for a run that ended well.
nlohmann::ordered_json to_json(const RunRecord& record);
/// The inverse. Throws ConfigError with `name`, the file, and the key for anything else.
RunRecord record_from_json(const nlohmann::ordered_json& json, const std::string& name);

/// The same as a table: a heading line, then one line a run; numbers with all their digits, the timing columns
/// beginning with solve_us_; a run without metrics leaves them empty.
std::string to_csv(std::span<const RunRecord> records);
/// Its lines, each with its end.
std::string csv_heading(const SystemDescription& system);
void append_csv_line(const RunRecord& record, const SystemDescription& system, std::string& text);

/// One of the solver's numbers, which every system has: of the one list that JSON, CSV and what is kept of a run share.
struct SolverColumn {
  const char* name;
  double Percentiles::*solve_us = nullptr;  ///< in JSON inside `solve_us`, by `inner`
  const char* inner = nullptr;
  int Metrics::*count = nullptr;
  double Metrics::*number = nullptr;

  double value(const Metrics& m) const;
  void set(Metrics& m, double value) const;
};
std::span<const SolverColumn> solver_columns();

}  // namespace solenoid
