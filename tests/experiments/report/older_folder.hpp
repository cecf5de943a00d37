#pragma once

#include "experiments/base/bytes.hpp"
#include "experiments/campaign/run_record.hpp"
#include "experiments/report/results.hpp"

#include <filesystem>
#include <fstream>
#include <string>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid::test {

/// runs/ID.json as the version before the shards wrote it (experiments/campaign/run_file.hpp).
inline std::string older_run_text(const std::string& configuration, const RunRecord& record, const std::string& trace) {
  const auto checksum = [](const std::string& bytes) { return fmt::format("{:08x}", crc32(bytes)); };
  nlohmann::ordered_json json = {{"configuration", configuration}, {"run", to_json(record)}};
  json["checksums"]["run"] = checksum(json["configuration"].dump() + json["run"].dump());
  if (!trace.empty()) json["checksums"]["trace"] = checksum(trace);
  return json.dump(2) + "\n";
}

/// Makes a results folder what that version would have left there.
inline void make_older(const std::string& folder) {
  const Results results = read_results(folder);
  std::filesystem::create_directory(folder + "/runs");
  for (const StoredRun& run : results.runs) {
    const std::string file = folder + "/runs/" + run.id, trace = results.kept->trace(run.index.value()).value_or("");
    std::ofstream(file + ".json") << older_run_text("0123456789abcdef", run.record, trace);
    if (!trace.empty()) std::ofstream(file + ".trace", std::ios::binary) << trace;
  }
  std::filesystem::remove_all(folder + "/shards");
  nlohmann::ordered_json manifest = results.manifest;
  manifest["program"].erase("maker");
  std::ofstream(folder + "/manifest.json") << manifest.dump(2);
}

}  // namespace solenoid::test
