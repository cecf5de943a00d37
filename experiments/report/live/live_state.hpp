#pragma once

#include "experiments/report/report_data.hpp"
#include "experiments/rig/log/tick_fields.hpp"

#include <chrono>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace solenoid {

/// What a live page may ask for. Members may be called from several threads.
class LiveState {
 public:
  /// `only_new`: leaves aside what is in the folder already.
  LiveState(const Campaign& campaign, const std::string& folder, bool only_new);

  /// Looks for what is new in the folder; at most some times a second.
  void refresh();
  /// The report's JSON, or an empty text if the caller has `revision` already.
  std::string report(int revision);
  /// A finished run over time as bytes; empty if there is none of that ID.
  std::string trace(const std::string& id);

  /// A tick of the run under way as RunLog sends it. A time that goes back begins the next run.
  void take_tick(const std::string& json);
  /// Samples of the run under way, from number `from` of the series `key` on, or all of another series.
  std::string ticks(const std::string& key, std::size_t from);

 private:
  using Clock = std::chrono::steady_clock;
  bool read_manifest();
  bool read_runs();
  void thin_ticks();
  std::string series_key() const;

  std::mutex mutex_;
  Results results_;
  TickFormat format_;
  std::map<std::string, std::string> curves_;  // what report_json() has to know of them
  std::vector<bool> shown_;                    // of the campaign's runs
  std::string manifest_text_, json_;
  int revision_ = 0, json_revision_ = -1;
  Clock::time_point next_look_{};
  std::vector<TickRecord> ticks_;
  std::size_t run_ = 0;  ///< of the campaign, the one that sends ticks
  int thinned_ = 0;
};

}  // namespace solenoid
