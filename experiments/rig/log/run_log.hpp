#pragma once

#include "core/rt/mailbox.hpp"
#include "core/rt/recorder.hpp"
#include "core/rt/ring.hpp"
#include "experiments/rig/log/mcap_writer.hpp"
#include "experiments/rig/log/tick_fields.hpp"

#include <atomic>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <unistd.h>

namespace solenoid {

/// Where a run's records go.
struct RunLogSettings {
  const SystemDescription* system = nullptr;
  std::string folder;  ///< of `NAME.mcap` and, after a fault, `NAME-fault-1.csv`
  std::string name = "run";
  std::uint64_t start_ns = 0;                ///< wall time of tick 0
  std::size_t ring_ticks = 8192;             ///< the disk may stand still for so long
  std::size_t black_box_ticks = 2000;        ///< of the dump on a fault: so many before it
  double flush_s = 0.25;                     ///< a chunk of the log
  std::vector<int> udp_ports;                ///< of 127.0.0.1, which get every tenth tick as JSON
  int live_socket = -1;                      ///< of the live page, which gets the same as a message
  std::vector<std::string> switches;         ///< their names, for messages
  std::map<std::string, std::string> about;  ///< of the run: what a replay needs
  /// How bytes reach the file: as ::write, or a disk that fails on purpose.
  std::function<ssize_t(int file, const char* bytes, std::size_t size)> write = ::write;
  std::function<int(int file)> sync = ::fdatasync;  ///< and from there to the disk
};

/// Takes ticks from the real-time thread and writes them from a thread of its own: MCAP with the topics `tick` and
/// `event`, and the last ticks as CSV when SAFE is latched. A disk that fails is noticed, not waited for.
class RunLog {
 public:
  /// Opens the file: throws OutputError. `keep` is called by the log's thread with every tick, in order.
  RunLog(RunLogSettings settings, std::function<void(const TickRecord&)> keep);
  ~RunLog();
  RunLog(const RunLog&) = delete;
  RunLog& operator=(const RunLog&) = delete;

  /// From the tick; no allocation, lock or exception.
  void record(const TickRecord& tick) noexcept;
  /// The newest tick, for a person to look at.
  Mailbox<TickRecord>& newest() { return newest_; }

  bool failed() const { return failed_.load(); }
  std::int64_t dropped() const { return dropped_.load(); }
  /// Writes what is left, the summary as metadata, index and footer. Empty, or why the log is incomplete.
  std::string close(const std::map<std::string, std::string>& summary);
  const std::string& path() const { return path_; }

 private:
  void work() noexcept;
  void drain();
  void sync();
  void take(const TickRecord& tick);
  void event(double time_s, const char* kind, const std::string& text);
  void note_changes(const TickRecord& tick);
  void dump_black_box();
  void send_live(const std::string& json);
  void write_file(std::string_view bytes);
  std::uint64_t time_ns(double time_s) const;

  RunLogSettings settings_;
  TickFormat format_;
  std::function<void(const TickRecord&)> keep_;
  std::string path_;
  int file_ = -1, live_ = -1;
  Ring<TickRecord> ring_;
  Mailbox<TickRecord> newest_;
  std::unique_ptr<McapWriter> mcap_;
  std::uint16_t tick_channel_ = 0, event_channel_ = 0;
  std::deque<TickRecord> last_;
  std::string json_;
  Rung rung_ = Rung::fresh;
  FaultSet faults_;
  int failed_switch_ = -1;
  int dumps_ = 0;
  std::int64_t ticks_ = 0;
  std::atomic<bool> stop_{false}, failed_{false};
  std::atomic<std::int64_t> dropped_{0};
  std::string problem_;
  std::thread thread_;
};

}  // namespace solenoid
