#pragma once

#include "experiments/campaign/campaign.hpp"

#include <string>

#include <sys/types.h>

namespace solenoid {

inline constexpr int usual_live_port = 8642;

/// Serves the report of a results folder on 127.0.0.1 while the folder fills, from a process of its own: it only reads
/// files and, of a run in real time, messages with ticks, so it can neither delay nor break what it shows. It ends
/// with this object, and with the program however that ends.
///
///   /                      the page
///   /report.json?revision=N   what it shows (report_json) with `revision` and `expected` runs; 204 if N is the newest
///   /trace/ID              a finished run over time (encode_trace)
///   /ticks.json?run=KEY&from=N   the run under way from sample N on; KEY names the series of samples: `run`, its key or
///                          nothing, `from`, what trace_header() says, signals [{name, unit, resolution}],
///                          columns {tick, SIGNAL: [...]}
class LiveServer {
 public:
  /// Results that are in the folder already: of a campaign that goes on, or of runs that will be done again.
  enum class Earlier { shown, repeated };

  /// `port` 0: the usual one, or a free one if that is taken. Throws ConfigError if `port` is taken or the program was
  /// built without uPlot. The folder need not exist yet. To be made before any thread and before memory is locked.
  LiveServer(const Campaign& campaign, const std::string& folder, int port, Earlier earlier);
  ~LiveServer();
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  std::string url() const;
  /// A socket that takes ticks as RunLog sends them, a message each; nobody else can send there.
  int tick_socket() const { return tick_socket_; }
  /// Serves on until Ctrl-C. Needs an InterruptGuard.
  void stay() const;

 private:
  pid_t process_ = -1;
  int port_ = 0, tick_socket_ = -1;
};

}  // namespace solenoid
