#include "experiments/report/live/live_state.hpp"

#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/base/files.hpp"
#include "experiments/rig/log/tick_fields.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

constexpr auto between_looks = std::chrono::milliseconds(300);
constexpr std::size_t most_ticks = 60'000;  // ten minutes; then every second one is dropped

std::string dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json numbers(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double value : values) list.push_back(std::isfinite(value) ? Json(value) : Json());
  return list;
}

}  // namespace

LiveState::LiveState(const Campaign& campaign, const std::string& folder, bool only_new)
    : format_(*campaign.system->descriptions().back()) {
  results_.folder = folder;
  results_.campaign = campaign;
  results_.manifest = {{"campaign", campaign.name}, {"status", "running"}};
  manifest_text_ = read_whole_file(folder + "/manifest.json", file_size::json).value_or("");
  results_.kept = std::make_shared<StoredRuns>(folder, campaign);
  shown_.resize(results_.kept->size());
  if (only_new) results_.kept->leave_aside();
}

bool LiveState::read_manifest() {
  const auto text = read_whole_file(results_.folder + "/manifest.json", file_size::json);
  if (!text || *text == manifest_text_) return false;
  try {
    Json json = parse_json(*text, "manifest.json");
    require_manifest(json, "manifest.json");
    manifest_text_ = *text;
    results_.manifest = std::move(json);
    return true;
  } catch (const ConfigError&) {
    return false;
  }
}

/// Takes up what ended since; of an earlier program or campaign it is being repeated.
bool LiveState::read_runs() {
  try {
    if (!results_.kept->refresh()) return false;
  } catch (const ConfigError&) {
    return false;  // no files of ours
  }
  const std::size_t before = results_.runs.size();
  read_kept_runs(results_, [&](std::size_t run) { return !shown_[run] && results_.runs.size() < most_listed_runs; });
  for (std::size_t i = before; i < results_.runs.size(); ++i) {
    StoredRun& run = results_.runs[i];
    shown_[*run.index] = true;
    try {
      if (const auto trace = read_trace(results_, run); trace && !trace->ticks.empty()) {
        curves_[run.id] = "served";
        if (run.solves.counts.empty()) run.solves = trace->solves;
      }
    } catch (const ConfigError&) {
      // it is shown without curves
    }
  }
  std::ranges::sort(results_.runs, {}, &StoredRun::index);
  return true;
}

void LiveState::refresh() {
  const std::lock_guard lock(mutex_);
  if (Clock::now() < next_look_) return;
  bool news = read_manifest();
  news = read_runs() || news;
  revision_ += news;
  next_look_ = Clock::now() + between_looks;
}

std::string LiveState::report(int revision) {
  const std::lock_guard lock(mutex_);
  if (revision == revision_) return {};
  if (json_revision_ != revision_) {
    Json json = report_json(results_, curves_, true);
    json["revision"] = revision_;
    json["expected"] = results_.campaign.runs.size();
    json_ = dump(json);
    json_revision_ = revision_;
  }
  return json_;
}

std::string LiveState::trace(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto run = std::ranges::find(results_.runs, id, &StoredRun::id);
  if (run == results_.runs.end()) return {};
  const auto trace = read_trace(results_, *run);
  return trace ? encode_trace(*trace) : std::string();
}

void LiveState::take_tick(const std::string& json) {
  try {
    const TickRecord tick = format_.from_json(json);
    const std::lock_guard lock(mutex_);
    if (!ticks_.empty() && tick.sensors.time_s <= ticks_.back().sensors.time_s) {
      ticks_.clear();
      thinned_ = 0;
      run_ = std::min(run_ + 1, results_.campaign.runs.size() - 1);
    }
    ticks_.push_back(tick);
    if (ticks_.size() > most_ticks) thin_ticks();
  } catch (const ConfigError&) {
    // not from us
  }
}

void LiveState::thin_ticks() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < ticks_.size(); i += 2) ticks_[kept++] = ticks_[i];
  ticks_.resize(kept);
  ++thinned_;
}

std::string LiveState::series_key() const {
  return fmt::format("{}{}", results_.campaign.runs[run_].id, thinned_ > 0 ? fmt::format("#{}", thinned_) : "");
}

std::string LiveState::ticks(const std::string& key, std::size_t from) {
  const std::lock_guard lock(mutex_);
  const bool over = !ticks_.empty() && std::ranges::find(results_.runs, results_.campaign.runs[run_].id,
                                                         &StoredRun::id) != results_.runs.end();
  if (ticks_.empty() || over) return R"({"run":""})";
  if (key != series_key()) from = 0;
  from = std::min(from, ticks_.size());
  const CampaignRun& run = results_.campaign.runs[run_];
  const Trace trace = make_trace(results_.campaign.variants[run.variant], results_.campaign.scenarios[run.scenario],
                                 std::span(ticks_).subspan(from));
  Json json = {{"run", series_key()}, {"from", from}};
  json.update(trace_header(trace));
  json["columns"]["tick"] = trace.ticks;
  for (const Trace::Signal& signal : trace.signals) {
    json["signals"].push_back({{"name", signal.name}, {"unit", signal.unit}, {"resolution", signal.resolution}});
    json["columns"][signal.name] = numbers(signal.values);
  }
  return dump(json);
}

}  // namespace solenoid
