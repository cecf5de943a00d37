#pragma once

#include "experiments/campaign/run_record.hpp"

#include <optional>
#include <string>

namespace solenoid {

/// A run as the version before kept it (now: shard_file.hpp): runs/ID.json, beside which runs/ID.trace may lie:
///
///   {"configuration": HASH, "run": to_json(RunRecord), "checksums": {"run": CRC, "trace": CRC}}
///
/// CRC-32 in hexadecimal, of configuration and record as compact JSON, and of the trace's bytes, if there is a trace.
/// Whoever edits, cuts or loses either is found out; who forges both is not.
struct RunFile {
  std::string configuration;
  RunRecord record;
  bool checked = false;              ///< false: a version before wrote it, without checksums
  std::optional<std::string> trace;  ///< the checksum of its trace
};

/// Reads runs/ID.json. Nothing if it is not there. Throws ConfigError naming the file if it is damaged.
std::optional<RunFile> read_run_file(const std::string& path);

/// Throws ConfigError naming the file unless the trace at `path` is the one that the run was written with; none, if it
/// was written with none.
void require_trace(const RunFile& run, const std::string& path);

}  // namespace solenoid
