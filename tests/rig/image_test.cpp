#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/rig/image_node.hpp"
#include "experiments/rig/plants.hpp"
#include "experiments/rig/udp_io.hpp"
#include "tests/experiments/program_under_test.hpp"
#include "tests/rig/rig_parts.hpp"

#include <atomic>
#include <cstdlib>
#include <random>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

namespace solenoid {
namespace {

using test::Mirror;
using test::with_valves;
using testing::HasSubstr;

/// What the image and its board need and have not; empty: nothing.
std::string missing_for_an_image() {
  try {
    board_emulator();
    built_image();
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

/// The firmware's image on a board whose plant shows what it is told, served by a thread.
struct Image : testing::Test {
  static constexpr std::uint32_t stranger = 10u << 24 | 2u << 8 | 77u;
  VariantConfig variant = with_valves("two_way");
  std::string wire = node_wire(variant).text;
  Calibration calibration = usual_calibration(variant);
  int port = 40000 + ::getpid() % 20000;
  std::unique_ptr<ImageNode> node;
  std::atomic<bool> done = false;
  std::thread server;

  void SetUp() override {
    const std::string missing = missing_for_an_image();
    if (missing.empty()) return;
    if (std::getenv("CI") != nullptr) FAIL() << missing;
    GTEST_SKIP() << missing;
  }
  void TearDown() override { stop(); }

  void start(const NodeKey* key = nullptr) {
    EmulatorSettings settings;
    settings.port = port;
    node = std::make_unique<ImageNode>(
        std::make_unique<FaultyPlant>(std::make_unique<Mirror>(), std::vector<InjectedFault>{}, variant, 1),
        calibration, node_description(calibration, system_of(variant).modes(variant), wire, key), settings,
        ImageSettings{"", settings.priority});
  }
  void serve() {
    done = false;
    server = std::thread([&] { node->serve([&] { return done.load(); }); });
  }
  void stop() {
    done = true;
    if (server.joinable()) server.join();
  }
  volatile BoardMemory& memory() { return node->board().memory(); }
  UdpSettings here(const std::optional<NodeKey>& key = {}) const {
    UdpSettings settings;
    settings.port = port;
    settings.key = key;
    return settings;
  }
  NodeWire its_wire() const { return {wire, 3, 1}; }
  /// The image's answer to a ping, whole; none within a second: empty.
  std::string ping(std::string_view text) {
    std::string echo("\x08\0\0\0\0\x01\0\x02", 8);
    echo += text;
    const std::uint32_t sum = ~internet_sum(echo);
    echo[2] = static_cast<char>(sum >> 8);
    echo[3] = static_cast<char>(sum);
    node->board().send(node->bridge().ip_frame(1, stranger, echo));
    std::string answer;
    wait_until(
        [&] {
          const auto frame = node->board().receive();
          if (frame && frame->size() >= 42 && (*frame)[23] == 1) answer = *frame;
          return !answer.empty();
        },
        1.0);
    return answer;
  }
};

TEST_F(Image, BootsSaysSoAndAnswersAPing) {
  start();
  EXPECT_TRUE(wait_until([&] { return node->board().serial() == "node: start 1, UDP port 47811\n"; }, 5.0))
      << node->board().serial();
  EXPECT_EQ(memory().lasting.boots, 1u);
  EXPECT_EQ(memory().outputs.switches, 0u);
  const std::string text = "as long as it takes", answer = ping(text);
  ASSERT_GE(answer.size(), 42 + text.size());
  EXPECT_EQ(answer[34], 0);
  EXPECT_EQ(answer.substr(42, text.size()), text);
  EXPECT_EQ(internet_sum(std::span(answer).subspan(14, 20)), 0xffffu);
  EXPECT_EQ(internet_sum(std::span(answer).subspan(34, 8 + text.size())), 0xffffu);
}

TEST_F(Image, ShowsTheConvertersAndSetsTheOutputs) {
  const NodeKey key{{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16}};
  start(&key);
  serve();
  UdpIo io(here(key), its_wire());
  io.open();
  RigOutputs told;
  told.switches = 0b0110;
  told.volts[0] = 1.25;
  RigInputs seen;
  for (int i = 0; i < 200 && !(seen.fresh && memory().outputs.switches == 0b0110); ++i) {
    io.write(told);
    seen = io.read();
    wait_s(1e-3);
  }
  EXPECT_TRUE(seen.fresh);
  EXPECT_NEAR(seen.volts[0], calibration.channels[0].volts(0.02), 1e-6);
  EXPECT_NEAR(seen.volts[1], calibration.channels[1].volts(150e3), 1e-6);
  EXPECT_NEAR(seen.volts[2], calibration.channels[2].volts(120e3), 1e-6);
  EXPECT_EQ(memory().outputs.switches, 0b0110u);
  EXPECT_EQ(memory().outputs.microvolts[0], 1'250'000);
  UdpIo without(here(), its_wire());
  EXPECT_THROW(without.open(), OutputError);
  io.safe();
  EXPECT_TRUE(wait_until([&] { return memory().outputs.switches == 0u && memory().outputs.microvolts[0] == 0; }, 1.0));
  stop();
  EXPECT_EQ(node->outputs(), Command{});
}

/// By the image's own clock. A machine that is shared may leave the emulated processor out for longer than the node may
/// be late: then it is asked again.
TEST_F(Image, GoesSafeWithinTwentyMillisecondsOfTheLastCommand) {
  start();
  serve();
  std::uint64_t soonest_us = ~0u;
  for (int attempt = 0; attempt < 20 && soonest_us > 20'000; ++attempt) {
    const std::uint32_t boots = memory().lasting.boots;
    {
      UdpIo io(here(), its_wire());
      io.open();
      RigOutputs told;
      told.switches = 0b1001;
      for (int i = 0; i < 30; ++i) {
        io.read();
        io.write(told);
        wait_s(1e-3);
      }
      EXPECT_TRUE(
          wait_until([&] { return memory().outputs.switches == 0b1001u || memory().lasting.boots > boots; }, 1.0));
      wait_until([&] { return memory().outputs.switches == 0u; }, 1.0);  // it is silent from here
    }
    EXPECT_EQ(memory().outputs.switches, 0u);
    if (memory().lasting.boots > boots || memory().report.counters.timeouts != attempt + 1) continue;
    const std::uint64_t after_us = memory().outputs.changed_us - memory().report.last_command_us;
    EXPECT_GE(after_us, node_timeout_us);
    soonest_us = std::min(soonest_us, after_us);
  }
  EXPECT_LE(soonest_us, 20'000u);
}

TEST_F(Image, ItsWatchdogEndsAHangSafelyAndItServesOn) {
  start();
  serve();
  UdpIo io(here(), its_wire());
  io.open();
  RigOutputs told;
  told.switches = 0b1001;
  for (int i = 0; i < 200 && memory().outputs.switches != 0b1001u; ++i) {
    io.read();
    io.write(told);
    wait_s(1e-3);
  }
  ASSERT_EQ(memory().outputs.switches, 0b1001u);
  const std::uint32_t boots = memory().lasting.boots, resets = memory().lasting.watchdog_resets;
  memory().from_host.hang = 1;
  EXPECT_TRUE(wait_until([&] { return memory().lasting.boots > boots; }, 2.0));
  EXPECT_GT(memory().lasting.watchdog_resets, resets);
  EXPECT_EQ(memory().lasting.faults, 0u);
  EXPECT_EQ(memory().outputs.switches, 0u);
  const bool told_so = wait_until(
      [&] {
        io.read();
        io.write(told);
        return io.health().displaced;
      },
      2.0);
  EXPECT_TRUE(told_so);  // its session is gone: the node says so, and obeys no more
  EXPECT_EQ(memory().outputs.switches, 0u);
  UdpIo next(here(), its_wire());
  next.open();
  EXPECT_TRUE(next.health().connected);
  EXPECT_THAT(node->board().serial(), HasSubstr("node: start 2"));
}

/// Frames that nobody should send: cut, too long, with wrong sums, fragments, of other protocols, and packets of the
/// node's own protocol that somebody changed. It lives, no output changes, and it is still somebody's node.
TEST_F(Image, NoFrameKillsItOrMovesAnOutput) {
  const NodeKey key{{9, 9, 9}};
  start(&key);
  std::mt19937 random(11);
  const auto any = [&](std::size_t size) {
    std::string bytes(size, ' ');
    for (char& c : bytes) c = static_cast<char>(random());
    return bytes;
  };
  NodePacket command(NodePacket::Type::command);
  NodeCommand{0b1111, {}, 0}.put(command, 1);
  std::array<char, NodePacket::most_size> room;
  const std::string known(room.data(), command.encode(room, nullptr));
  ASSERT_FALSE(ping("before").empty());
  const std::uint32_t boots = memory().lasting.boots, changes = memory().outputs.changes;
  for (int i = 0; i < 3000; ++i) {
    std::string frame;
    const std::size_t size = random() % 1500;
    switch (random() % 6) {
      case 0:
        frame = any(14 + random() % 1900);
        break;
      case 1:
        frame = node->bridge().frame(static_cast<std::uint16_t>(random() % 2 ? 0x0806 : 0x0800), any(size));
        break;
      case 2:
        frame = node->bridge().ip_frame(static_cast<std::uint8_t>(random() % 20), static_cast<std::uint32_t>(random()),
                                        any(size));
        break;
      case 3:
        frame = node->bridge().udp_frame({stranger, static_cast<std::uint16_t>(random())}, node_port, any(size % 1472));
        break;
      case 4:
        frame = node->bridge().udp_frame({stranger, 5000}, node_port, known);
        break;
      default:
        frame = node->bridge().udp_frame({stranger, 5000}, node_port, known);
        frame[14 + random() % (frame.size() - 14)] = static_cast<char>(random());
        frame.resize(14 + random() % (frame.size() - 13));
    }
    node->board().send(frame);
    if (i % 8 == 0) wait_s(2e-4);  // or most would be lost on the way
    while (node->board().receive()) {
    }
  }
  // Frames that are still on their way may keep a ping waiting, or cost it its room.
  EXPECT_TRUE(wait_until([&] { return !ping("after").empty(); }, 10.0));
  EXPECT_EQ(memory().outputs.changes, changes);
  EXPECT_EQ(memory().lasting.boots, boots);
  EXPECT_EQ(memory().lasting.faults, 0u);
  EXPECT_TRUE(wait_until([&] { return node->board().report().counters.invalid_packets > 100; }, 2.0));
  serve();
  UdpIo io(here(key), its_wire());
  io.open();
  EXPECT_TRUE(io.health().connected);
}

TEST_F(Image, UsesNoMoreStackThanTheBuildSays) {
  const auto text = read_whole_file((std::filesystem::path(built_image()).parent_path() / "figures.json").string());
  if (!text) GTEST_SKIP() << "needs python3 when it is built";
  const auto figures = nlohmann::json::parse(*text);
  start();
  serve();
  {
    UdpIo io(here(), its_wire());
    io.open();
    for (int i = 0; i < 100; ++i) {
      io.read();
      io.write({});
      wait_s(1e-3);
    }
  }
  ASSERT_TRUE(wait_until([&] { return node->board().report().now_us > 1'000'000; }, 5.0));
  const std::uint32_t used = node->board().report().stack_bytes;
  EXPECT_GT(used, 100u);
  EXPECT_LE(used, figures.at("worst_stack_bytes"));
  EXPECT_LE(figures.at("worst_stack_bytes"), figures.at("stack_room_bytes"));
}

/// A run with the program, in real time, on the image.
struct ImageRun : Image {
  test::Folder folder;
  std::string report() const { return (folder / "node.json").string(); }
  std::unique_ptr<Child> emulator(std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {"emulator",           "--image",  "--variant", "nine_robust", "--port",
                                          std::to_string(port), "--report", report(),    "--idle-exit", "1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    auto child = std::make_unique<Child>(SOLENOID_PROGRAM, arguments, (folder / "emulator.txt").string());
    const auto listens = [&] {
      return read_whole_file((folder / "emulator.txt").string()).value_or("").find("127.0.0.1") != std::string::npos;
    };
    EXPECT_TRUE(wait_until(listens, 10.0));
    return child;
  }
  std::vector<std::string> run(const char* seconds) const {
    return {"run",
            "nine_robust",
            "--plant",
            "emulator",
            "--node",
            "127.0.0.1:" + std::to_string(port),
            "--duration",
            seconds,
            "--out",
            (folder / "out").string(),
            "--quiet",
            "--rig",
            folder.file("rig.toml")};
  }
  nlohmann::json seen() const { return nlohmann::json::parse(read_whole_file(report()).value_or("null")); }
};

TEST_F(ImageRun, ClosesTheLoopOfTheRobustController) {
  folder.write("rig.toml", "[limits]\nlongest_gap_ms = 1000\n");
  nlohmann::json node;
  int code = -1;
  for (int attempt = 0; attempt < 5 && code != 0; ++attempt) {
    std::filesystem::remove_all(folder / "out");
    const auto server = emulator();
    code = test::run_program(run("4")).exit_code;
    EXPECT_EQ(server->wait(10.0), 0);
    node = seen();
  }
  EXPECT_EQ(code, 0);
  EXPECT_EQ(node.at("sessions"), 1);
  EXPECT_GT(node.at("commands"), SOLENOID_TEST_ONE_IN == 1 ? 3500 : 1000);
  EXPECT_EQ(node.at("refused"), 0);
  EXPECT_EQ(node.at("board").at("processor_faults"), 0);
  EXPECT_EQ(node.at("final_outputs").at("coils"), 0);
}

TEST_F(ImageRun, AControllerThatIsKilledLeavesItSafe) {
  folder.write("rig.toml", "[limits]\nlongest_gap_ms = 1000\n");
  double safe_after_ms = 1e9;
  for (int attempt = 0; attempt < 5 && safe_after_ms > 20.0; ++attempt) {
    const auto server = emulator();
    Child controller(SOLENOID_PROGRAM, run("20"), (folder / "run.txt").string());
    const auto driven = [&] { return std::filesystem::exists(folder / "out"); };
    ASSERT_TRUE(wait_until(driven, 20.0));
    wait_s(1.5);
    controller.send(SIGKILL);
    EXPECT_EQ(controller.wait(5.0), 128 + SIGKILL);
    EXPECT_EQ(server->wait(10.0), 0);
    const auto node = seen();
    EXPECT_EQ(node.at("final_outputs").at("coils"), 0);
    EXPECT_EQ(node.at("final_outputs").at("motor_n"), 0.0);
    EXPECT_GT(node.at("commands"), 100);
    if (node.at("board").at("watchdog_resets") == 0) {
      EXPECT_EQ(node.at("timeouts"), 1);
      safe_after_ms = node.at("safe_after_ms");
    }
    std::filesystem::remove_all(folder / "out");
  }
  EXPECT_LE(safe_after_ms, 20.0);
}

}  // namespace
}  // namespace solenoid
