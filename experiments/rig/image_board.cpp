#include "experiments/rig/image_board.hpp"

#include "core/config/reader.hpp"
#include "experiments/rig/node_protocol.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr double longest_boot_s = 10.0;
constexpr std::size_t frame_room = 2048;

/// A file that ends with its object's life, or is handed on.
class Descriptor {
 public:
  explicit Descriptor(int file, const char* what) : file_(file) {
    if (file < 0) throw OutputError(fmt::format("{}: {}", what, std::strerror(errno)));
  }
  ~Descriptor() {
    if (file_ >= 0) ::close(file_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  operator int() const { return file_; }
  int take() { return std::exchange(file_, -1); }

 private:
  int file_;
};

void keep_in_child(int file) { ::fcntl(file, F_SETFD, 0); }

}  // namespace

std::string built_image() {
  const std::filesystem::path program = this_program(), prefix = program.parent_path().parent_path();
  if (const auto image = prefix / "node/node_mps2.elf"; std::filesystem::exists(image)) return image.string();
  throw ConfigError(
      "the node's image was not built with this program: install gcc-arm-none-eabi, libstdc++-arm-none-eabi-dev and "
      "libnewlib-dev with apt-get, and build again; or name one: --image FILE");
}

std::string board_emulator() {
  std::string found = program_on_path("qemu-system-arm");
  if (found.empty()) throw ConfigError("the board's emulator is missing: apt-get install qemu-system-arm");
  return found;
}

BoardMemory::Description description_in_memory(const NodeDescription& of) {
  BoardMemory::Description in{};
  if (of.wire.size() > BoardMemory::most_wire || of.channels > most_node_channels || of.outputs > most_node_outputs)
    throw ConfigError("a node of so many channels, outputs and words is none that the board has room for");
  in.wire_size = static_cast<std::uint32_t>(of.wire.size());
  std::ranges::copy(of.wire, in.wire);
  in.channels = static_cast<std::uint32_t>(of.channels);
  in.outputs = static_cast<std::uint32_t>(of.outputs);
  in.switches = of.switches;
  in.safe_switches = of.safe_switches;
  in.period_us = of.sampling.period_us;
  in.conversions = of.sampling.conversions;
  if (of.key) {
    in.has_key = 1;
    std::ranges::copy(of.key->bytes, in.key);
  }
  for (const std::size_t half : {0u, 8u}) {
    const std::uint64_t number = unguessable_number();
    std::memcpy(in.seed + half, &number, sizeof number);
  }
  std::ranges::copy(of.continuous, in.continuous);
  std::ranges::copy(of.inputs, in.inputs);
  in.magic = BoardMemory::known;
  return in;
}

ImageBoard::ImageBoard(const ImageSettings& settings, const BoardMemory::Description& description)
    : frame_(frame_room) {
  const std::string qemu = board_emulator(), image = settings.file.empty() ? built_image() : settings.file;
  if (!std::filesystem::is_regular_file(image)) throw ConfigError(image + ": is no file (wanted: the node's image)");
  const Descriptor shared(::memfd_create("board", MFD_CLOEXEC), "the board's memory");
  if (::ftruncate(shared, BoardMemory::size) != 0) throw OutputError("the board's memory: there is not so much");
  void* const mapped = ::mmap(nullptr, sizeof(BoardMemory), PROT_READ | PROT_WRITE, MAP_SHARED, shared, 0);
  if (mapped == MAP_FAILED) throw OutputError("the board's memory cannot be mapped");
  memory_ = static_cast<BoardMemory*>(mapped);
  std::memcpy(const_cast<BoardMemory::Description*>(&memory_->description), &description, sizeof description);
  int pair[2];
  if (::socketpair(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0, pair) != 0) throw OutputError("no pair of sockets");
  frames_ = pair[0];
  const Descriptor other(pair[1], "the board's network");
  ::fcntl(frames_, F_SETFL, O_NONBLOCK);

  const int memory_file = shared, network = other;
  std::vector<std::string> arguments = {
      "-machine",
      "mps2-an385,memory-backend=psram",
      "-object",
      fmt::format("memory-backend-file,id=psram,size=16M,share=on,mem-path=/proc/self/fd/{}", memory_file),
      "-nodefaults",
      "-nographic",
      "-monitor",
      "none",
      "-serial",
      "file:" + (folder_.path() / "serial").string(),
      "-netdev",
      fmt::format("dgram,id=wire,local.type=fd,local.str={}", network),
      "-net",
      "nic,netdev=wire,model=lan9118",
      "-kernel",
      image};
  const int priority = settings.priority;
  process_ = std::make_unique<Child>(qemu, arguments, (folder_.path() / "output").string(), [=] {
    keep_in_child(memory_file);
    keep_in_child(network);
    sched_param wanted{};
    wanted.sched_priority = priority;
    if (priority > 0) ::sched_setscheduler(0, SCHED_FIFO, &wanted);
  });
}

ImageBoard::~ImageBoard() {
  process_.reset();
  ::munmap(const_cast<BoardMemory*>(memory_), sizeof(BoardMemory));
  ::close(frames_);
}

void ImageBoard::wait_for_start() {
  wait_until([&] { return memory_->report.writing > 0 || !process_->runs(); }, longest_boot_s);
  if (memory_->report.writing > 0 && process_->runs()) return;
  throw OutputError("the node's image does not start: " +
                    read_whole_file((folder_.path() / "output").string()).value_or("QEMU said nothing"));
}

BoardMemory::Report ImageBoard::report() const {
  BoardMemory::Report copy;
  for (int tries = 0; tries < 100'000; ++tries) {
    const std::uint32_t before = memory_->report.writing;
    std::atomic_thread_fence(std::memory_order_acquire);
    std::memcpy(&copy, const_cast<const BoardMemory::Report*>(&memory_->report), sizeof copy);
    std::atomic_thread_fence(std::memory_order_acquire);
    if (before % 2 == 0 && before == memory_->report.writing) break;
  }
  return copy;
}

std::string ImageBoard::serial() const { return read_whole_file((folder_.path() / "serial").string()).value_or(""); }

std::optional<std::string_view> ImageBoard::receive() {
  const ssize_t size = ::recv(frames_, frame_.data(), frame_.size(), MSG_DONTWAIT);
  if (size <= 0) return std::nullopt;
  return std::string_view(frame_.data(), static_cast<std::size_t>(size));
}

void ImageBoard::send(std::string_view frame) {
  [[maybe_unused]] const ssize_t sent = ::send(frames_, frame.data(), frame.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
}

}  // namespace solenoid
