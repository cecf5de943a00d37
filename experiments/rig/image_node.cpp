#include "experiments/rig/image_node.hpp"

#include "core/rt/process_setup.hpp"
#include "core/system/description.hpp"
#include "experiments/rig/node_protocol.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <sstream>

#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

constexpr double converters_s = 125e-6;
constexpr int most_passed = 32;  // passed on between two looks at the plant

}  // namespace

ImageNode::ImageNode(std::unique_ptr<FaultyPlant> plant, const Calibration& calibration,
                     const NodeDescription& description, const EmulatorSettings& settings, const ImageSettings& image)
    : plant_(std::move(plant)),
      calibration_(calibration),
      settings_(settings),
      socket_(settings.port),
      faults_(settings.faults, settings.seed),
      board_(image, description_in_memory(description)),
      bridge_(board_),
      done_(settings.faults.size()) {
  board_.wait_for_start();
  bridge_.find();
  sensors_ = plant_->read(0.0);
  write_converters();
  changes_ = board_.memory().outputs.changes;
}

void ImageNode::serve(const std::function<bool()>& stop) {
  while (!stop() && board_.process().runs()) {
    socket_.wait(faults_.rest_s(socket_.now_s(), converters_s), board_.frames());
    pass_packets();
    const double now_s = socket_.now_s();
    step(now_s);
    if (begun()) fail_as_told(now_s);
    if (heard_s_ > 0 && settings_.idle_exit_s > 0 && now_s - heard_s_ > settings_.idle_exit_s) return;
  }
}

void ImageNode::pass_packets() {
  const double now_s = socket_.now_s();
  for (int i = 0; i < most_passed; ++i) {
    NodePeer from;
    const auto bytes = socket_.receive(from);
    if (!bytes) break;
    heard_s_ = now_s;
    faults_.to_node(*bytes, from, now_s, time_s(now_s));
  }
  while (const auto packet = faults_.at_node(now_s)) bridge_.send(packet->bytes, packet->peer);
  for (int i = 0; i < most_passed; ++i) {
    const auto packet = bridge_.receive();
    if (!packet) break;
    faults_.to_controller(packet->bytes, packet->to, now_s, time_s(now_s));
  }
  while (const auto packet = faults_.at_controller(now_s)) socket_.send(packet->bytes, packet->peer);
}

void ImageNode::step(double now_s) {
  const bool changed = board_.memory().outputs.changes != changes_;
  if (!changed && now_s < due_s_) return;
  due_s_ = now_s + converters_s;
  if (!begun()) {
    if (board_.memory().report.counters.sessions == 0) return;
    begun_s_ = now_s;
    begun_ns_ = std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
  }
  sensors_ = plant_->read(time_s(now_s));
  write_converters();
  if (changed) read_outputs();
}

void ImageNode::write_converters() {
  for (std::size_t i = 0; i < calibration_.channels.size(); ++i)
    board_.memory().from_host.counts[i] = to_microvolts(calibration_.channels[i].volts(sensors_.value[i]));
}

void ImageNode::read_outputs() {
  const volatile BoardMemory::Outputs& out = board_.memory().outputs;
  changes_ = out.changes;
  Command told{out.switches, {}};
  for (std::size_t i = 0; i < calibration_.continuous.size(); ++i)
    told.continuous[i] = calibration_.continuous[i].value(from_microvolts(out.microvolts[i]));
  plant_->write(told);
}

/// A board that stands still is one whose processor does: QEMU's process is stopped, while the plant's time goes on.
void ImageNode::fail_as_told(double now_s) {
  if (goes_on_s_ >= 0 && now_s >= goes_on_s_) {
    board_.process().send(SIGCONT);
    goes_on_s_ = -1.0;
  }
  for (std::size_t i = 0; i < settings_.faults.size(); ++i) {
    const InjectedFault& f = settings_.faults[i];
    if (f.target != "process" || time_s(now_s) < f.from_s || done_[i]) continue;
    done_[i] = true;
    if (f.kind == "killed") std::raise(SIGKILL);
    if (f.kind == "crashed") std::raise(SIGSEGV);
    board_.process().send(SIGSTOP);
    goes_on_s_ = now_s + f.value;
  }
}

void serve(ImageNode& node, const EmulatorSettings& settings, const std::function<bool()>& stop,
           const std::function<void(const std::string&)>& listening) {
  prepare_thread("board");
  std::string setup = "as an ordinary process";
  if (settings.priority > 0) {
    const SetupStep step = set_fifo_priority("board", settings.priority);
    setup = step.granted ? step.what : step.what + " refused (" + step.detail + ")";
  }
  listening("the firmware's image on a Cortex-M3, " + setup);
  node.serve(stop);
}

std::string image_report(const ImageNode& node, const SystemDescription& system) {
  const BoardMemory::Report report = node.board().report();
  const NodeCounters& c = report.counters;
  const volatile BoardMemory::Lasting& lasting = node.board().memory().lasting;
  const auto ms = [](std::uint64_t microseconds) { return 1e-3 * static_cast<double>(microseconds); };
  // If the emulated processor stood still, both expiries of the watchdog came at once: a reset without a warning.
  const std::uint64_t bitten_us = lasting.watchdog_resets > 0 ? lasting.safe_us - lasting.before_us : 0;
  nlohmann::ordered_json json = counters_json(c);
  json["dropped"] = node.dropped();
  json["longest_silence_ms"] = ms(c.longest_silence_us);
  json["safe_after_ms"] = ms(c.safe_after_us);
  if (node.begun()) json["begun_ns"] = node.begun_ns();
  json["board"] = {{"starts", std::uint32_t{lasting.boots}},
                   {"watchdog_resets", lasting.boots - 1 - lasting.faults},
                   {"watchdog_safe_after_ms", ms(bitten_us)},
                   {"processor_faults", std::uint32_t{lasting.faults}},
                   {"clock_s", 1e-6 * static_cast<double>(report.now_us)},
                   {"stack_bytes", report.stack_bytes},
                   {"conversions", report.conversions},
                   {"frames", report.frames},
                   {"answers", report.answers},
                   {"longest_round_ms", ms(report.longest_gap_us)}};
  if (node.begun()) json["final_outputs"] = outputs_json(node.outputs(), system);
  json["events"] = nlohmann::ordered_json::array();
  std::istringstream lines(node.board().serial());
  for (std::string line; std::getline(lines, line);) {
    const std::size_t end = line.find(" ms: ");
    const double time_ms = end == std::string::npos ? 0.0 : std::atof(line.c_str());
    json["events"].push_back(
        {{"time_s", 1e-3 * time_ms}, {"what", end == std::string::npos ? line : line.substr(end + 5)}});
  }
  return json.dump(1) + "\n";
}

}  // namespace solenoid
