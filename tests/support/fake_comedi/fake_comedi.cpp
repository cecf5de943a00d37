// Stands in for libcomedi.so.0: a MultiQ3 (8 inputs of 13 bits at +-5 V, 8 outputs of 12 bits, 16 digital inputs, 16
// digital outputs) whose wires end at the twin, in real time.
//
//   FAKE_COMEDI=fail@N | block@N   every read from the Nth on fails, or never comes back
//   FAKE_COMEDI_REPORT=FILE        holds the outputs of the last write
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/scenario.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/rig/calibration.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <thread>

#include <comedilib.h>
#include <fcntl.h>
#include <unistd.h>

namespace {

using namespace solenoid;

constexpr unsigned analog_in = 0, analog_out = 1, digital_in = 2, digital_out = 3;
constexpr lsampl_t most_in = 8191, most_out = 4095;
comedi_range volts = {-5.0, 5.0, UNIT_volt};

struct Board {
  Board() {
    const Campaign campaign = read_campaign("rig", {{"nine_state"}, {"cycloidal"}});
    plant = make_plant(campaign.variants.front(), campaign.scenarios.front(), 1);
    calibration = usual_calibration(campaign.variants.front());
    if (const char* path = std::getenv("FAKE_COMEDI_REPORT")) report = ::open(path, O_WRONLY | O_CREAT | O_TRUNC, 0644);
    if (const char* fault = std::getenv("FAKE_COMEDI"))
      if (const char* at = std::strchr(fault, '@')) {
        fails = std::strncmp(fault, "fail", 4) == 0;
        blocks = std::strncmp(fault, "block", 5) == 0;
        fault_at = std::atol(at + 1);
      }
  }
  double now_s() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); }
  void apply() {
    plant->read(now_s());
    plant->write({bits & 0xfu, {calibration.continuous[0].value(motor_v)}});
    ++writes;
    if (report < 0) return;
    char line[128];
    const int size = std::snprintf(line, sizeof line, "coils %2u motor_v %8.4f toggles %9ld writes %9ld reads %9ld\n",
                                   bits & 0xfu, motor_v, toggles, writes, reads.load());
    [[maybe_unused]] const ssize_t written = ::pwrite(report, line, static_cast<std::size_t>(size), 0);
  }

  std::unique_ptr<SimulatedPlant> plant;
  Calibration calibration;
  std::chrono::steady_clock::time_point begin = std::chrono::steady_clock::now();
  std::mutex mutex;
  unsigned bits = 0;
  double motor_v = 0.0;
  long writes = 0, toggles = 0, fault_at = 0;
  std::atomic<long> reads{0};
  int report = -1;
  bool fails = false, blocks = false;
};
std::unique_ptr<Board> board;

}  // namespace

extern "C" {

comedi_t* comedi_open(const char* device) {
  if (std::strcmp(device, "/dev/comedi0") != 0) return nullptr;
  board = std::make_unique<Board>();
  return reinterpret_cast<comedi_t*>(board.get());
}
int comedi_close(comedi_t*) { return 0; }
int comedi_get_n_channels(comedi_t*, unsigned subdevice) {
  return subdevice <= analog_out ? 8 : subdevice <= digital_out ? 16 : -1;
}
int comedi_get_subdevice_type(comedi_t*, unsigned subdevice) {
  constexpr int types[] = {COMEDI_SUBD_AI, COMEDI_SUBD_AO, COMEDI_SUBD_DI, COMEDI_SUBD_DO};
  return subdevice <= digital_out ? types[subdevice] : -1;
}
lsampl_t comedi_get_maxdata(comedi_t*, unsigned subdevice, unsigned) {
  return subdevice == analog_in ? most_in : subdevice == analog_out ? most_out : 1;
}
comedi_range* comedi_get_range(comedi_t*, unsigned subdevice, unsigned, unsigned range) {
  return subdevice <= analog_out && range == 0 ? &volts : nullptr;
}
int comedi_dio_config(comedi_t*, unsigned, unsigned, unsigned) { return -1; }

int comedi_do_insnlist(comedi_t*, comedi_insnlist* list) {
  const long read = ++board->reads;
  if (board->blocks && read >= board->fault_at)
    for (;;) std::this_thread::sleep_for(std::chrono::seconds(1));
  if (board->fails && read >= board->fault_at) return -1;
  const std::lock_guard lock(board->mutex);
  const Measurement s = board->plant->read(board->now_s());
  const Calibration& c = board->calibration;
  std::array<double, 8> wires{};
  for (std::size_t i = 0; i < c.channels.size(); ++i) wires[i] = c.channels[i].volts(s.value[i]);
  for (unsigned i = 0; i < list->n_insns; ++i) {
    const comedi_insn& in = list->insns[i];
    if (in.insn != INSN_READ || in.subdev != analog_in || CR_CHAN(in.chanspec) >= wires.size())
      return static_cast<int>(i);
    const double share = (wires[CR_CHAN(in.chanspec)] + 5.0) / 10.0;
    in.data[0] = static_cast<lsampl_t>(std::lround(std::fmin(1.0, std::fmax(0.0, share)) * most_in));
  }
  return static_cast<int>(list->n_insns);
}
int comedi_data_write(comedi_t*, unsigned subdevice, unsigned channel, unsigned, unsigned, lsampl_t data) {
  if (subdevice != analog_out || channel >= 8 || data > most_out) return -1;
  const std::lock_guard lock(board->mutex);
  board->motor_v = -5.0 + 10.0 * data / most_out;
  board->apply();
  return 1;
}
int comedi_dio_bitfield2(comedi_t*, unsigned subdevice, unsigned mask, unsigned* bits, unsigned) {
  if (subdevice != digital_out) return -1;
  const std::lock_guard lock(board->mutex);
  const unsigned before = board->bits;
  board->bits = (before & ~mask) | (*bits & mask);
  if ((before ^ board->bits) & 0x8000u) ++board->toggles;
  *bits = board->bits;
  return 0;
}
}
