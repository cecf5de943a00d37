#include "experiments/rig/log/run_log.hpp"

#include "core/rt/clock.hpp"
#include "core/rt/process_setup.hpp"
#include "experiments/base/build_info.hpp"
#include "experiments/base/files.hpp"

#include <cerrno>
#include <cmath>
#include <cstring>

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/socket.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr const char* event_schema =
    R"({"title":"solenoid.event","type":"object","properties":{"time_s":{"type":"number"},"kind":{"type":"string"},"text":{"type":"string"}}})";
constexpr double look_s = 0.02;  // between two looks into the ring
constexpr double sync_s = 1.0;   // what a loss of power may take
constexpr int live_every = 10;   // ticks

/// From nowhere else than this machine: what is not bound takes from every net. -1 if there is none.
int loopback_socket() {
  const int descriptor = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (descriptor >= 0 && ::bind(descriptor, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0) return descriptor;
  if (descriptor >= 0) ::close(descriptor);
  return -1;
}

}  // namespace

RunLog::RunLog(RunLogSettings settings, std::function<void(const TickRecord&)> keep)
    : settings_(std::move(settings)),
      format_(*settings_.system),
      keep_(std::move(keep)),
      path_(settings_.folder + "/" + settings_.name + ".mcap"),
      ring_(settings_.ring_ticks) {
  require_no_device(path_);
  file_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (file_ < 0) throw OutputError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
  if (!settings_.udp_ports.empty()) live_ = loopback_socket();
  mcap_ = std::make_unique<McapWriter>([this](std::string_view bytes) { write_file(bytes); },
                                       "solenoid " + build_info().version);
  settings_.about["system"] = settings_.system->name;
  mcap_->write_metadata("run", settings_.about);
  tick_channel_ = mcap_->add_channel("tick", "solenoid.tick", format_.schema());
  event_channel_ = mcap_->add_channel("event", "solenoid.event", event_schema);
  thread_ = std::thread([this] { work(); });
}

RunLog::~RunLog() {
  if (thread_.joinable()) close({});
  if (file_ >= 0) ::close(file_);
  if (live_ >= 0) ::close(live_);
}

void RunLog::record(const TickRecord& tick) noexcept {
  if (!ring_.push(tick)) dropped_.fetch_add(1, std::memory_order_relaxed);
  newest_.back() = tick;
  newest_.put();
}

void RunLog::write_file(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = settings_.write(file_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) throw OutputError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

void RunLog::work() noexcept {
  prepare_thread("log");
  MonotonicClock clock;
  double flushed = 0.0, synced = 0.0;
  while (!stop_.load()) {
    clock.sleep_until(clock.now_s() + look_s);
    if (failed_.load()) continue;  // the ring fills up and counts what it drops
    try {
      drain();
      if (clock.now_s() - flushed >= settings_.flush_s) mcap_->flush(), flushed = clock.now_s();
      if (clock.now_s() - synced >= sync_s) sync(), synced = clock.now_s();
    } catch (const std::exception& error) {
      problem_ = error.what();
      failed_.store(true);
    }
  }
}

void RunLog::sync() {
  if (settings_.sync(file_) != 0 && errno != EINVAL && errno != EROFS)  // of what cannot be synced nothing is asked
    throw OutputError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
}

void RunLog::drain() {
  TickRecord tick;
  while (ring_.pop(tick)) take(tick);
}

void RunLog::take(const TickRecord& tick) {
  keep_(tick);
  format_.json(tick, json_);
  mcap_->write(tick_channel_, time_ns(tick.sensors.time_s), json_);
  if (ticks_ % live_every == 0) send_live(json_);
  ++ticks_;
  last_.push_back(tick);
  if (last_.size() > settings_.black_box_ticks) last_.pop_front();
  note_changes(tick);
}

void RunLog::note_changes(const TickRecord& tick) {
  const double t = tick.sensors.time_s;
  if (tick.skipped > 0) event(t, "skipped", fmt::format("{} ticks", tick.skipped));
  if (tick.decision.faults.bits() & ~faults_.bits())
    event(t, "fault", to_string(tick.decision.faults, *settings_.system));
  faults_ = tick.decision.faults;
  if (tick.decision.failed_switch != failed_switch_) {
    failed_switch_ = tick.decision.failed_switch;
    const auto c = static_cast<std::size_t>(failed_switch_);
    event(t, "switch",
          fmt::format("{} {} {}: {}", settings_.system->switch_noun,
                      c < settings_.switches.size() ? settings_.switches[c] : std::to_string(c),
                      to_string(tick.decision.failed_as),
                      tick.decision.mode_set > 0 ? "the others go on without it" : "nothing is left"));
  }
  if (tick.decision.rung == rung_) return;
  rung_ = tick.decision.rung;
  const bool safe = rung_ == Rung::safe;
  event(t, "rung",
        to_string(rung_, *settings_.system) +
            (safe ? ": " + to_string(tick.decision.safe_causes, *settings_.system) : ""));
  FaultSet stopped;
  stopped.add(Fault::stopped);
  if (safe && tick.decision.safe_causes != stopped) dump_black_box();
}

void RunLog::event(double time_s, const char* kind, const std::string& text) {
  const nlohmann::ordered_json json = {{"time_s", time_s}, {"kind", kind}, {"text", text}};
  mcap_->write(event_channel_, time_ns(time_s), json.dump());
}

void RunLog::dump_black_box() {
  std::string csv = format_.csv_heading();
  for (const TickRecord& tick : last_) format_.csv(tick, csv);
  write_file_atomically(fmt::format("{}/{}-fault-{}.csv", settings_.folder, settings_.name, ++dumps_), csv);
  mcap_->flush();
}

void RunLog::send_live(const std::string& json) {
  if (settings_.live_socket >= 0) ::send(settings_.live_socket, json.data(), json.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  if (live_ < 0) return;
  for (const int port : settings_.udp_ports) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    [[maybe_unused]] const ssize_t sent =  // nobody need listen
        ::sendto(live_, json.data(), json.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  }
}

std::uint64_t RunLog::time_ns(double time_s) const {
  return settings_.start_ns + static_cast<std::uint64_t>(std::llround(1e9 * std::max(0.0, time_s)));
}

std::string RunLog::close(const std::map<std::string, std::string>& summary) {
  if (!thread_.joinable()) return problem_;
  stop_.store(true);
  thread_.join();
  if (!failed_.load()) {
    try {
      drain();
      mcap_->flush();
      mcap_->write_metadata("summary", summary);
      mcap_->close();
      sync();
    } catch (const std::exception& error) {
      problem_ = error.what();
      failed_.store(true);
    }
  }
  if (problem_.empty() && dropped_.load() > 0)
    problem_ = fmt::format("{}: {} ticks are missing", path_, dropped_.load());
  return problem_;
}

}  // namespace solenoid
