#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "core/systems/actuator/valves.hpp"
#include "experiments/base/bytes.hpp"
#include "experiments/base/child_process.hpp"
#include "experiments/rig/log/mcap_reader.hpp"
#include "experiments/rig/log/mcap_writer.hpp"
#include "experiments/rig/log/recorded_run.hpp"
#include "experiments/rig/log/run_log.hpp"
#include "experiments/rig/log/tick_fields.hpp"
#include "experiments/rig/replay_run.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using test::Folder;
using test::text_of;

TEST(Crc32, IsTheStandardOne) {
  EXPECT_EQ(crc32("123456789"), 0xCBF43926u);
  EXPECT_EQ(crc32("6789", crc32("12345")), 0xCBF43926u);
  EXPECT_EQ(crc32(""), 0u);
}

/// A log of `count` messages on two topics, a chunk each ten.
std::string small_log(int count, bool closed = true) {
  std::string bytes;
  McapWriter writer([&](std::string_view b) { bytes += b; }, "test");
  writer.write_metadata("run", {{"variant", "nine_state"}, {"empty", ""}});
  const auto a = writer.add_channel("tick", "a", R"({"type":"object"})");
  const auto b = writer.add_channel("event", "b", R"({"type":"object"})");
  for (int i = 0; i < count; ++i) {
    writer.write(i % 3 == 0 ? b : a, 1000u + static_cast<unsigned>(i), nlohmann::json{{"i", i}}.dump());
    if (i % 10 == 9) writer.flush();
  }
  if (closed)
    writer.close();
  else
    writer.flush();
  return bytes;
}

/// A log with its messages in memory.
struct WholeLog : McapContents {
  struct Message {
    std::string topic;
    std::uint64_t time_ns;
    std::string json;
  };
  std::vector<Message> messages;
};
WholeLog read_all(std::string_view bytes) {
  WholeLog log;
  static_cast<McapContents&>(log) = read_mcap(bytes, "x", [&](const McapMessage& m, const McapContents&) {
    log.messages.push_back({m.channel.topic, m.time_ns, std::string(m.data)});
  });
  return log;
}

TEST(Mcap, ReadsBackWhatWasWritten) {
  const WholeLog log = read_all(small_log(25));
  EXPECT_TRUE(log.complete);
  EXPECT_TRUE(log.problem.empty());
  ASSERT_EQ(log.messages.size(), 25u);
  for (int i = 0; i < 25; ++i) {
    const auto& m = log.messages[static_cast<std::size_t>(i)];
    EXPECT_EQ(m.topic, i % 3 == 0 ? "event" : "tick");
    EXPECT_EQ(m.time_ns, 1000u + static_cast<unsigned>(i));
    EXPECT_EQ(nlohmann::json::parse(m.json).at("i"), i);
  }
  EXPECT_EQ(log.metadata.at("run").at("variant"), "nine_state");
}

TEST(Mcap, CutAnywhereGivesAllMessagesBeforeTheCut) {
  const std::string whole = small_log(60);
  std::size_t before = 0;
  for (std::size_t size = mcap_magic.size(); size < whole.size(); ++size) {
    const WholeLog log = read_all(std::string_view(whole).substr(0, size));
    ASSERT_GE(log.messages.size(), before) << size;
    for (std::size_t i = 0; i < log.messages.size(); ++i)
      ASSERT_EQ(nlohmann::json::parse(log.messages[i].json).at("i"), i) << size;
    ASSERT_TRUE(log.complete || !log.problem.empty()) << size;
    before = log.messages.size();
  }
  EXPECT_EQ(before, 60u);
}

TEST(Mcap, RefusesOtherFilesAndNoticesASpoiltChunk) {
  EXPECT_THROW(read_all("time_s,position"), ConfigError);
  std::string spoilt = small_log(30);
  const std::size_t at = spoilt.find(R"({"i":15})");
  spoilt[at + 5] = '2';
  const WholeLog log = read_all(spoilt);
  EXPECT_THAT(log.problem, testing::HasSubstr("checksum"));
  EXPECT_EQ(log.messages.size(), 10u);
}

TickRecord some_tick() {
  TickRecord t;
  t.sensors = {1.234, {0.1 / 3, 150123.456789, 1e5 / 7}, {0.05, -0.1, 1e5, 2e5}, false, 2};
  t.decision.command = {0b1010, {-1.0 / 3}};
  t.applied = {0b0010, {2.0 / 3}};
  t.decision.rung = Rung::held;
  t.decision.faults.add(pressure_b_channel, SensorFault::slew);
  t.decision.faults.add(Fault::switch_failed);
  t.decision.safe_causes.add(Fault::aborted);
  t.decision.safe_causes.add(Fault::switches_lost);
  t.decision.report.status = Status::deadline_reached;
  t.decision.solved = true;
  t.decision.ticket = 1230;
  t.skipped = 3;
  return t;
}

TEST(TickJson, KeepsEveryDigitThatAReplayNeeds) {
  const TickRecord tick = some_tick();
  std::string json;
  const TickFormat format(actuator_description());
  format.json(tick, json);
  const TickRecord again = format.from_json(json);
  EXPECT_EQ(again.decision.faults, tick.decision.faults);
  EXPECT_EQ(again.decision.safe_causes, tick.decision.safe_causes);
  for (const TickField& field : format.fields()) {
    if (field.exact) {
      EXPECT_EQ(field.get(again), field.get(tick)) << field.name;
    } else if (std::isfinite(field.get(tick))) {
      EXPECT_NEAR(field.get(again), field.get(tick), 1e-5 * std::abs(field.get(tick))) << field.name;
    }
  }
  EXPECT_TRUE(nlohmann::json::parse(json).at("solve_cost").is_null());  // infinite: JSON has no such number
  EXPECT_EQ(again.decision.faults, tick.decision.faults);
}

TEST(TickJson, MatchesItsSchemaAndItsCsvHeading) {
  std::string json, line;
  const TickFormat format(actuator_description());
  format.json(some_tick(), json);
  format.csv(some_tick(), line);
  const auto object = nlohmann::json::parse(json), schema = nlohmann::json::parse(format.schema());
  EXPECT_EQ(object.size(), schema.at("properties").size());
  for (const auto& [key, value] : object.items()) EXPECT_TRUE(schema.at("properties").contains(key)) << key;
  EXPECT_EQ(std::count(line.begin(), line.end(), ','), static_cast<std::ptrdiff_t>(object.size()) - 1);
}

TEST(RunLog, WritesTicksEventsAndABlackBoxWhenSafeIsLatched) {
  const Folder folder;
  RunLogSettings settings;
  settings.system = &actuator_description();
  settings.folder = (folder / "").string();
  settings.start_ns = 1'700'000'000'000'000'000u;
  settings.about = {{"variant", "nine_state"}};
  int kept = 0;
  RunLog log(settings, [&](const TickRecord&) { ++kept; });
  for (int k = 0; k < 300; ++k) {
    TickRecord t = some_tick();
    t.sensors.time_s = 1e-3 * k;
    t.decision.rung = k < 200 ? Rung::fresh : Rung::safe;
    log.record(t);
  }
  EXPECT_EQ(log.close({{"ticks", "300"}}), "");
  EXPECT_EQ(kept, 300);
  const RecordedRun run = read_run(log.path());
  EXPECT_EQ(run.problem, "");
  EXPECT_EQ(run.ticks.size(), 300u);
  EXPECT_EQ(run.summary.at("ticks"), "300");
  EXPECT_THAT(run.events, testing::Contains(testing::HasSubstr("rung safe: aborted")));
  const std::string box = text_of(folder / "run-fault-1.csv");
  EXPECT_EQ(std::count(box.begin(), box.end(), '\n'), 202);  // heading, and ticks 0 to 200
}

TEST(RunLog, NoticesADiskThatIsFullAndNeverWaitsForIt) {
  if (::access("/dev/full", W_OK) != 0) GTEST_SKIP() << "no /dev/full here";
  const Folder folder;
  std::filesystem::create_symlink("/dev/full", folder / "run.mcap");
  RunLogSettings settings;
  settings.system = &actuator_description();
  settings.folder = (folder / "").string();
  settings.ring_ticks = 16;
  EXPECT_ANY_THROW(RunLog(settings, [](const TickRecord&) {}));  // found before the first tick
}

/// Bytes arrive, but the disk loses them.
TEST(RunLog, NoticesADiskThatCannotKeepWhatItTook) {
  const auto log_with = [](const Folder& folder, int error) {
    RunLogSettings settings;
    settings.system = &actuator_description();
    settings.folder = folder.path();
    settings.sync = [error](int) { return errno = error, -1; };
    return std::make_unique<RunLog>(settings, [](const TickRecord&) {});
  };
  const Folder folder;
  EXPECT_THAT(log_with(folder, EIO)->close({}), testing::HasSubstr("run.mcap: cannot be written: Input/output error"));
  EXPECT_THAT(log_with(folder, ENOSPC)->close({}), testing::HasSubstr("No space left on device"));
  for (const int cannot_sync : {EINVAL, EROFS}) EXPECT_EQ(log_with(folder, cannot_sync)->close({}), "");
  const auto log = log_with(folder, EIO);
  EXPECT_TRUE(wait_until([&] { return log->failed(); }, 10.0));  // while the run still goes on
}

TEST(Replay, TellsAVariantWithOtherValvesTheModeThatOpensAlike) {
  const ModeSet two = valve_modes("two_way", {}), three = valve_modes("three_way", {}),
                seven = valve_modes("seven_mode", {});
  const auto translated = [](const ModeSet& from, const ModeSet& to) {
    std::vector<SwitchPattern> all;
    for (SwitchPattern p = 0; p < 1u << from.switch_count(); ++p) all.push_back(translated_pattern(from, to, p));
    return all;
  };
  const auto to_two = translated(three, two), to_three = translated(two, three);
  EXPECT_THAT(to_two, testing::ElementsAre(0b1010, 0b1001, 0b0110, 0b0101));  // each chamber fills or exhausts
  ASSERT_EQ(to_three.size(), 16u);
  for (SwitchPattern p = 0; p < 4; ++p) EXPECT_EQ(to_three[to_two[p]], p);
  EXPECT_EQ(to_three[0b0001], 1u);  // B, held, is as far from filled as from exhausted: the first mode
  EXPECT_EQ(to_three[0b0000], 0u);
  const auto to_seven = translated(two, seven);  // the same coils, whether it would command them or not
  for (SwitchPattern p = 0; p < 16; ++p) EXPECT_EQ(to_seven[p], p);
}

TEST(Mcap, IsReadByTheReferenceImplementation) {
  const char* node = std::getenv("SOLENOID_MCAP_CORE");  // a folder where `npm install @mcap/core` was done
  const std::string modules = node ? node : SOLENOID_SOURCE_DIR "/node_modules/..";
  if (!std::filesystem::exists(modules + "/node_modules/@mcap/core") ||
      std::system("node --version >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "needs node, and @mcap/core by `npm ci` here or in $SOLENOID_MCAP_CORE";
  const Folder folder;
  const std::string whole = small_log(60);
  const auto read = [&](const std::string& bytes, bool indexed) {
    std::ofstream(folder / "log.mcap", std::ios::binary) << bytes;
    const std::string command = "cd '" + modules + "' && node '" SOLENOID_SOURCE_DIR "/tests/rig/read_mcap.mjs' '" +
                                (folder / "log.mcap").string() + "' " + (indexed ? "indexed" : "stream") + " > '" +
                                (folder / "out").string() + "' 2>&1";
    const int status = std::system(command.c_str());
    return std::pair(status, text_of(folder / "out"));
  };
  EXPECT_EQ(read(whole, false), std::pair(0, std::string("60\n")));
  EXPECT_EQ(read(whole, true), std::pair(0, std::string("60\n")));
  const std::string open = small_log(60, false);
  EXPECT_EQ(read(open, false), std::pair(0, std::string("60\n")));
  for (const double share : {0.3, 0.5, 0.77, 0.95}) {  // a cut chunk is lost to it, the ones before are not
    const std::string cut = open.substr(0, static_cast<std::size_t>(share * static_cast<double>(open.size())));
    const auto [status, out] = read(cut, false);
    EXPECT_EQ(status, 0);
    EXPECT_EQ(std::stoi(out) % 10, 0);
    EXPECT_GE(std::stoi(out) + 10, static_cast<int>(read_all(cut).messages.size()));
  }
}

}  // namespace
}  // namespace solenoid
