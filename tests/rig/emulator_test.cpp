// The node's loop on a socket, while others send as fast as they can.
#include "experiments/rig/emulator.hpp"

#include "controllers/variant.hpp"
#include "core/mpc/mode_set.hpp"
#include "experiments/rig/udp_io.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <atomic>
#include <chrono>
#include <thread>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

namespace solenoid {
namespace {

struct AtRest final : SimulatedPlant {
  Measurement read(double time_s) noexcept override { return {time_s, 0.02, 150e3, 120e3}; }
  void write(const Command&) noexcept override {}
  double consumed() const override { return 0; }
};

/// A stranger's hellos, in bunches, from a thread that gives way to others.
void flood(int port, const std::atomic<bool>& stop) {
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), 10);
  NodePacket hello(NodePacket::Type::hello);
  hello.append(std::string_view("another wire"));
  std::array<char, NodePacket::most_size> bytes;
  iovec content{bytes.data(), hello.encode(bytes, nullptr)};
  std::array<mmsghdr, 64> bunch{};
  for (mmsghdr& message : bunch) message.msg_hdr.msg_iov = &content, message.msg_hdr.msg_iovlen = 1;
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int file = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ASSERT_EQ(::connect(file, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  while (!stop) ::sendmmsg(file, bunch.data(), bunch.size(), MSG_DONTWAIT);
  ::close(file);
}

TEST(Emulator, AFloodKeepsNobodyFromTheSafeState) {
  const VariantConfig variant = new_variant();
  const SystemDescription& system = system_of(variant).description();
  const ModeSet modes = system_of(variant).modes(variant);
  const std::string wire = wire_text(system, modes);
  EmulatedNode node(std::make_unique<FaultyPlant>(std::make_unique<AtRest>(), std::vector<InjectedFault>{}, variant, 1),
                    usual_calibration(variant), modes, wire);
  EmulatorSettings settings;
  settings.port = test::free_udp_port();
  settings.priority = 0;
  std::atomic<bool> listening = false, stop = false, calm = false;
  std::thread server([&] {
    serve(
        node, settings, [&] { return stop.load(); }, [&](const std::string&) { listening = true; });
  });
  while (!listening) std::this_thread::yield();

  UdpSettings where;
  where.port = settings.port;
  UdpIo io(where, {wire, system.channels.size(), system.continuous.size()});
  io.open();
  const auto drive = [&](int ticks) {
    for (int k = 0; k < ticks; ++k) {
      io.read();
      io.write({0b0101, {1.0}});
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  };
  drive(50);
  std::vector<std::thread> strangers;
  strangers.reserve(6);
  for (int k = 0; k < 6; ++k) strangers.emplace_back([&] { flood(settings.port, calm); });
  drive(20);
  std::this_thread::sleep_for(std::chrono::seconds(2));
  calm = true;
  for (std::thread& thread : strangers) thread.join();
  stop = true;
  server.join();
  EXPECT_GE(node.log().timeouts, 1);
  EXPECT_EQ(node.outputs(), Command{});
  EXPECT_LT(node.log().safe_after_s, 1.0);  // not when the flood was over
  RecordProperty("safe_after_ms", static_cast<int>(1e3 * node.log().safe_after_s));
}

}  // namespace
}  // namespace solenoid
