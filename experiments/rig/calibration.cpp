#include "experiments/rig/calibration.hpp"

#include "core/config/reader.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdlib>

#include <fmt/format.h>

namespace solenoid {
namespace {

void read_channel(TableReader& table, const char* key, LinearChannel& channel) {
  if (!table.has(key)) return;
  TableReader inner = table.table(key);
  channel.offset = inner.number_or("offset", channel.offset);
  channel.gain = inner.number_or("gain", channel.gain);
  if (channel.gain == 0.0) inner.fail("gain", "is 0 (allowed: any other number)");
  inner.finish();
}

std::atomic<RigIo*> crash_io{nullptr};
constexpr int crashes[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};

extern "C" void make_safe_and_crash(int signal) {
  if (RigIo* io = crash_io.exchange(nullptr)) io->safe();
  std::signal(signal, SIG_DFL);
  std::raise(signal);
}

}  // namespace

std::string IoHealth::text() const {
  return fmt::format("{} reads, {} missed, {} late, {} corrupt, {} write errors, {} timeouts of the node", reads,
                     missed, late, corrupt, write_errors, node_timeouts);
}

Calibration read_calibration(TableReader& table) {
  Calibration c;
  read_channel(table, "position", c.position);
  read_channel(table, "pressure_a", c.pressure_a);
  read_channel(table, "pressure_b", c.pressure_b);
  read_channel(table, "motor", c.motor);
  c.motor_limit_v = table.number_or("motor_limit_v", c.motor_limit_v, {0.0, 10.0, true});
  table.finish();
  return c;
}

RigPlant::RigPlant(std::unique_ptr<RigIo> io, const Calibration& calibration, double tick_s)
    : io_(std::move(io)), calibration_(calibration), tick_s_(tick_s) {
  io_->open();
}

RigPlant::~RigPlant() { io_->safe(); }

Measurement RigPlant::read(double time_s) noexcept {
  const RigInputs in = io_->read();
  const double elapsed = last_time_s_ < 0 ? 1.0 : std::round((time_s - last_time_s_) / tick_s_);
  stale_ticks_ = in.fresh ? 0 : stale_ticks_ + std::max(1, static_cast<int>(std::min(elapsed, 1e6)));
  last_time_s_ = time_s;
  Measurement s;
  s.time_s = time_s;
  const double y = calibration_.position.value(in.position_v);
  const double pa = calibration_.pressure_a.value(in.pressure_a_v), pb = calibration_.pressure_b.value(in.pressure_b_v);
  s.value = {y, pa, pb};
  s.truth = {y, 0.0, pa, pb};
  s.stale_ticks = stale_ticks_;
  s.node_was_safe = in.node_was_safe;
  return s;
}

void RigPlant::write(const Command& command) noexcept {
  const double volts = calibration_.motor.volts(motor_force_n(command));
  io_->write({std::clamp(volts, -calibration_.motor_limit_v, calibration_.motor_limit_v), command.switches});
}

CrashGuard::CrashGuard(RigIo& io) {
  crash_io.store(&io);
  for (const int signal : crashes) std::signal(signal, make_safe_and_crash);
}

CrashGuard::~CrashGuard() {
  crash_io.store(nullptr);
  for (const int signal : crashes) std::signal(signal, SIG_DFL);
}

}  // namespace solenoid
