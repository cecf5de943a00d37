#include "experiments/rig/log/recorded_run.hpp"

#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/rig/log/mcap_reader.hpp"
#include "experiments/rig/log/tick_fields.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {

namespace {

/// The system that a log is of; logs of versions that knew one alone do not say.
const SystemDescription& logged_system(const std::map<std::string, std::string>& about, const std::string& path) {
  const auto said = about.find("system");
  if (said == about.end()) return systems().front()->description();
  if (const System* system = find_system(said->second)) return system->description();
  throw ConfigError(fmt::format("{}: is of the system '{}' (allowed: {})", path, said->second, system_names()));
}

}  // namespace

RecordedRun read_run(const std::string& path) {
  const auto bytes = read_whole_file(path);
  if (!bytes) throw ConfigError(fmt::format("{}: cannot be read (allowed: a log of `solenoid run`)", path));
  const McapContents contents = read_mcap(*bytes, path);
  RecordedRun run;
  run.problem = contents.problem;
  if (const auto about = contents.metadata.find("run"); about != contents.metadata.end()) run.about = about->second;
  if (const auto sum = contents.metadata.find("summary"); sum != contents.metadata.end()) run.summary = sum->second;
  run.system = &logged_system(run.about, path);
  const TickFormat format(*run.system);
  for (const McapContents::Message& message : contents.messages) {
    if (message.topic == "tick") run.ticks.push_back(format.from_json(message.json));
    if (message.topic != "event") continue;
    const auto event = nlohmann::json::parse(message.json);
    run.events.push_back(fmt::format("{:.3f} {} {}", event.at("time_s").get<double>(),
                                     event.at("kind").get<std::string>(), event.at("text").get<std::string>()));
  }
  if (run.ticks.empty()) throw ConfigError(fmt::format("{}: holds no tick (allowed: a log of `solenoid run`)", path));
  return run;
}

}  // namespace solenoid
