#include "experiments/rig/log/recorded_run.hpp"

#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/shown_text.hpp"
#include "experiments/rig/log/json_numbers.hpp"
#include "experiments/rig/log/mcap_reader.hpp"
#include "experiments/rig/log/tick_fields.hpp"

#include <algorithm>
#include <charconv>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

constexpr double longest_gap_s = 3600.0;
constexpr std::size_t longest_tick = 65536, longest_event = 4096;
constexpr std::size_t most_ticks = 10'000'000, most_events = 100'000;
constexpr const char* a_log = "allowed: a log of `solenoid run`";

/// Of a system's descriptions the one with the inputs that a log has; a log with those of
/// every variant does not say.
const SystemDescription& described_as(const System& system, const std::map<std::string, std::string>& about,
                                      const std::string& path) {
  const auto said = about.find("inputs");
  if (said == about.end()) return system.description();
  std::vector<std::string> known;
  for (const SystemDescription* description : system.descriptions()) {
    if (input_names(*description) == said->second) return *description;
    known.push_back(fmt::format("'{}'", input_names(*description)));
  }
  throw ConfigError(fmt::format("{}: metadata 'run', key 'inputs': {} (allowed of {}: {})", path, shown(said->second),
                                system.name(), fmt::join(known, ", ")));
}

/// The system that a log is of; logs of versions that knew one alone do not say.
const SystemDescription& logged_system(const std::map<std::string, std::string>& about, const std::string& path) {
  const auto said = about.find("system");
  if (said == about.end()) return systems().front()->description();
  if (const System* system = find_system(said->second)) return described_as(*system, about, path);
  throw ConfigError(fmt::format("{}: is of the system {} (allowed: {})", path, shown(said->second), system_names()));
}

std::map<std::string, std::string> about_in(const McapContents& contents) {
  const auto about = contents.metadata.find("run");
  return about == contents.metadata.end() ? std::map<std::string, std::string>() : about->second;
}

/// What `run` says about itself has only some values.
void check_about(const std::map<std::string, std::string>& about, const std::string& path) {
  const auto refuse = [&](const std::string& key, const std::string& value, const std::string& allowed) {
    throw ConfigError(fmt::format("{}: metadata 'run', key '{}': {} (allowed: {})", path, key, shown(value), allowed));
  };
  const auto one_of = [&](const char* key, std::initializer_list<std::string_view> allowed) {
    const auto said = about.find(key);
    if (said != about.end() && std::ranges::find(allowed, said->second) == allowed.end())
      refuse(key, said->second, fmt::format("{}", fmt::join(allowed, ", ")));
  };
  one_of("policy", {"at_once", "next_slot"});
  one_of("plant", {"sim", "emulator", "comedi"});
  if (const auto seed = about.find("seed"); seed != about.end()) {
    std::uint64_t value = 0;
    const std::string& text = seed->second;
    const auto end = std::from_chars(text.data(), text.data() + text.size(), value);
    if (end.ec != std::errc() || end.ptr != text.data() + text.size())
      refuse("seed", text, "a whole number from 0 to 2^64 - 1");
  }
}

std::string event_text(std::string_view json) {
  std::optional<double> time_s;
  auto problem = read_json_numbers(json, [&](const std::string& name, double value) {
    if (name == "time_s") time_s = value;
  });
  std::string kind, text;
  if (!problem) {  // read once: it is not deeply nested, and short
    const auto event = nlohmann::json::parse(json);
    const auto text_at = [&](const char* key) {
      const auto value = event.find(key);
      return value != event.end() && value->is_string() ? value->get<std::string>() : std::string();
    };
    kind = text_at("kind");
    text = text_at("text");
    if (!time_s || kind.empty()) problem = "no event with time_s, kind and text";
  }
  if (problem) throw ConfigError(fmt::format("{} (allowed: an event of `solenoid run`)", *problem));
  return fmt::format("{:.3f} {} {}", *time_s, kind, text);
}

/// Makes ticks and events of messages.
class RunReader {
 public:
  RunReader(const std::string& path, RecordedRun& run) : path_(path), run_(run) {}

  void take(const McapMessage& message, const McapContents& so_far) {
    const bool tick = message.channel.topic == "tick";
    if (!tick && message.channel.topic != "event") return;
    if (message.channel.encoding != "json")
      throw ConfigError(
          fmt::format("{}: {} (allowed: 'json', as `solenoid run` writes)", path_, message.channel.text()));
    try {
      const std::size_t longest = tick ? longest_tick : longest_event;
      if (message.data.size() > longest)
        throw ConfigError(fmt::format("{} bytes (allowed: at most {})", message.data.size(), longest));
      if (tick ? run_.ticks.size() == most_ticks : run_.events.size() == most_events)
        throw ConfigError(fmt::format("one more (allowed: {})", tick ? most_ticks : most_events));
      if (tick)
        take_tick(message, so_far);
      else
        run_.events.push_back(event_text(message.data));
    } catch (const ConfigError& error) {
      throw ConfigError(fmt::format("{}: {} {} ({}): {}", path_, tick ? "tick" : "event",
                                    tick ? run_.ticks.size() : run_.events.size(), message.where(), error.what()));
    }
  }

 private:
  void take_tick(const McapMessage& message, const McapContents& so_far) {
    if (!format_) format_.emplace(logged_system(about_in(so_far), path_));
    const TickRecord tick = format_->from_json(message.data);
    const double t = tick.sensors.time_s, before = run_.ticks.empty() ? t : run_.ticks.back().sensors.time_s;
    if (!run_.ticks.empty() && !(t > before && t - before <= longest_gap_s))
      throw ConfigError(fmt::format("key 'time_s': {} after {} (allowed: times that increase, by at most {:.0f} s)", t,
                                    before, longest_gap_s));
    run_.ticks.push_back(tick);
  }

  const std::string& path_;
  RecordedRun& run_;
  std::optional<TickFormat> format_;
};

/// Why a file without ticks is none of ours.
std::string without_ticks(const McapContents& contents) {
  std::string text = "holds no tick";
  if (!contents.problem.empty()) text += ", " + contents.problem;
  std::size_t told = 0;
  for (const auto& [id, channel] : contents.channels)
    if (channel.topic != "tick" && channel.topic != "event" && ++told <= 3) text += "; " + channel.text();
  if (told > 3) text += fmt::format("; and {} more", told - 3);
  return text;
}

}  // namespace

RecordedRun read_run(const std::string& path) {
  const auto bytes = read_whole_file(path, mcap_bounds::file_bytes);
  if (!bytes) throw ConfigError(fmt::format("{}: cannot be read ({})", path, a_log));
  RecordedRun run;
  run.path = path;
  RunReader reader(path, run);
  const McapContents contents = read_mcap(
      *bytes, path, [&](const McapMessage& message, const McapContents& so_far) { reader.take(message, so_far); });
  run.problem = contents.problem;
  run.about = about_in(contents);
  if (const auto sum = contents.metadata.find("summary"); sum != contents.metadata.end()) run.summary = sum->second;
  run.system = &logged_system(run.about, path);
  check_about(run.about, path);
  if (run.ticks.empty()) throw ConfigError(fmt::format("{}: {} ({})", path, without_ticks(contents), a_log));
  return run;
}

}  // namespace solenoid
