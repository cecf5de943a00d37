#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/base/bytes.hpp"
#include "experiments/rig/log/json_numbers.hpp"
#include "experiments/rig/log/mcap_compression.hpp"
#include "experiments/rig/log/mcap_reader.hpp"
#include "experiments/rig/log/mcap_writer.hpp"
#include "experiments/rig/log/recorded_run.hpp"
#include "experiments/rig/log/tick_fields.hpp"
#include "experiments/systems/actuator/identify/log_source.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <cmath>
#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lz4frame.h>
#include <sys/stat.h>
#include <zstd.h>

namespace solenoid {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::string sized(std::string_view text) {
  std::string out;
  append_little_endian(out, static_cast<std::uint32_t>(text.size()));
  return out += text;
}

std::string mcap_record(McapRecord opcode, const std::string& content) {
  std::string out(1, static_cast<char>(opcode));
  append_little_endian(out, static_cast<std::uint64_t>(content.size()));
  return out + content;
}

std::string mcap_schema(std::uint16_t id, std::string_view name) {
  std::string content;
  append_little_endian(content, id);
  return mcap_record(McapRecord::schema, content + sized(name) + sized("ros2msg") + sized(""));
}

std::string mcap_channel(std::uint16_t id, std::string_view topic, std::string_view encoding,
                         std::uint16_t schema = 0) {
  std::string content;
  append_little_endian(content, id);
  append_little_endian(content, schema);
  return mcap_record(McapRecord::channel, content + sized(topic) + sized(encoding) + sized(""));
}

std::string mcap_message(std::uint16_t channel, std::uint64_t time_ns, std::string_view data) {
  std::string content;
  append_little_endian(content, channel);
  append_little_endian(content, std::uint32_t{0});
  append_little_endian(content, time_ns);
  append_little_endian(content, time_ns);
  return mcap_record(McapRecord::message, content + std::string(data));
}

std::string zstd_of(const std::string& plain) {
  std::string out(ZSTD_compressBound(plain.size()), '\0');
  out.resize(ZSTD_compress(out.data(), out.size(), plain.data(), plain.size(), 3));
  return out;
}

std::string lz4_of(const std::string& plain) {
  std::string out(LZ4F_compressFrameBound(plain.size(), nullptr), '\0');
  out.resize(LZ4F_compressFrame(out.data(), out.size(), plain.data(), plain.size(), nullptr));
  return out;
}

struct ChunkClaims {
  std::uint64_t size;
  std::uint32_t crc;
};

std::string mcap_chunk(const std::string& compression, const std::string& stored, const ChunkClaims& claims) {
  std::string content;
  for (const std::uint64_t number : {std::uint64_t{0}, std::uint64_t{0}, claims.size})
    append_little_endian(content, number);
  append_little_endian(content, claims.crc);
  content += sized(compression);
  append_little_endian(content, static_cast<std::uint64_t>(stored.size()));
  return mcap_record(McapRecord::chunk, content + stored);
}

std::string whole_chunk(const std::string& compression, const std::string& plain) {
  const std::string stored = compression == "zstd" ? zstd_of(plain) : compression == "lz4" ? lz4_of(plain) : plain;
  return mcap_chunk(compression, stored, {plain.size(), crc32(plain)});
}

std::string mcap_file(const std::string& records, std::uint32_t data_crc = 0) {
  std::string data_end, footer(20, '\0');
  append_little_endian(data_end, data_crc);
  return std::string(mcap_magic) + records + mcap_record(McapRecord::data_end, data_end) +
         mcap_record(McapRecord::footer, footer) + std::string(mcap_magic);
}

/// `from`, `from` + 1, ... ms.
std::string ticks_json(int from, int count) {
  std::string out;
  const TickFormat format(actuator_description());
  std::string json;
  for (int k = from; k < from + count; ++k) {
    TickRecord tick;
    tick.sensors.time_s = 1e-3 * k;
    tick.sensors.value[position_channel] = 0.05 + 1e-4 * std::sin(0.1 * k);
    tick.sensors.value[pressure_a_channel] = tick.sensors.value[pressure_b_channel] = 1.5e5;
    tick.applied.switches = static_cast<SwitchPattern>(k % 16);
    format.json(tick, json);
    out += mcap_message(1, 1000, json);
  }
  return out;
}

/// What reading a log says; "accepted" if it is taken.
std::string complaint_about(const std::string& bytes) {
  const test::Folder folder;
  std::ofstream(folder / "x.mcap", std::ios::binary) << bytes;
  try {
    read_run((folder / "x.mcap").string());
  } catch (const ConfigError& error) {
    std::string text = error.what();
    EXPECT_THAT(text, HasSubstr("x.mcap: "));
    EXPECT_THAT(text, HasSubstr("(allowed: "));
    EXPECT_THAT(text, Not(HasSubstr("json.exception")));
    EXPECT_THAT(text, Not(HasSubstr("\n")));
    return text;
  }
  return "accepted";
}

std::string one_tick(const std::string& json) {
  return mcap_file(whole_chunk("", mcap_channel(1, "tick", "json") + mcap_message(1, 1000, json)));
}

TEST(ForeignMcap, CompressedChunksAreReadToTheSameTicks) {
  const std::string records = mcap_channel(1, "tick", "json") + ticks_json(0, 300);
  for (const char* compression : {"", "zstd", "lz4"}) {
    const test::Folder folder;
    std::ofstream(folder / "x.mcap", std::ios::binary) << mcap_file(whole_chunk(compression, records));
    const RecordedRun run = read_run((folder / "x.mcap").string());
    EXPECT_EQ(run.problem, "") << compression;
    ASSERT_EQ(run.ticks.size(), 300u) << compression;
    EXPECT_DOUBLE_EQ(run.ticks[299].sensors.time_s, 0.299);
    EXPECT_EQ(run.ticks[15].applied.switches, 15u);
  }
}

TEST(ForeignMcap, ACutCompressedChunkGivesWhatCameBefore) {
  const std::string records = mcap_channel(1, "tick", "json") + ticks_json(0, 4000);
  for (const char* compression : {"zstd", "lz4"}) {
    const std::string whole = std::string(mcap_magic) + whole_chunk(compression, records);
    const test::Folder folder;
    std::ofstream(folder / "x.mcap", std::ios::binary) << whole.substr(0, whole.size() * 3 / 4);
    const RecordedRun run = read_run((folder / "x.mcap").string());
    EXPECT_THAT(run.problem, HasSubstr("cut")) << compression;
    EXPECT_GT(run.ticks.size(), 100u) << compression;
    EXPECT_LT(run.ticks.size(), 4000u) << compression;
  }
}

TEST(ForeignMcap, NoMoreIsDecompressedThanAChunkSays) {
  const std::string zeros(500'000, '\0');
  for (const char* compression : {"zstd", "lz4"}) {
    const Decompressed some =
        decompress(compression, compression == std::string("zstd") ? zstd_of(zeros) : lz4_of(zeros), 5000);
    EXPECT_EQ(some.bytes.size(), 5000u) << compression;
    EXPECT_THAT(some.problem, HasSubstr("more than the 5000 bytes")) << compression;
  }
  EXPECT_THAT(complaint_about(mcap_file(mcap_chunk("zstd", zstd_of(zeros), {std::uint64_t{1} << 40, 0}))),
              HasSubstr("byte 8: a chunk of 1099511627776 bytes (allowed: at most 128000000)"));
  std::string many;
  const std::string one = mcap_chunk("zstd", zstd_of(""), {mcap_bounds::chunk_bytes, 0});
  for (int i = 0; i < 3; ++i) many += mcap_chunk("", "", {mcap_bounds::chunk_bytes, 1});
  EXPECT_THAT(complaint_about(mcap_file(many)), AllOf(HasSubstr("holds no tick"), HasSubstr("wrong checksum")));
  EXPECT_THAT(complaint_about(mcap_file(one)), HasSubstr("another size than it says"));
}

TEST(ForeignMcap, OtherPeoplesFilesAreRefusedInWords) {
  EXPECT_THAT(complaint_about(mcap_file(whole_chunk("", mcap_schema(1, "sensor_msgs/msg/JointState") +
                                                            mcap_channel(1, "/joint_states", "cdr", 1) +
                                                            mcap_message(1, 1000, "....")))),
              HasSubstr("holds no tick; channel '/joint_states' is 'cdr' of 'sensor_msgs/msg/JointState'"));
  EXPECT_THAT(complaint_about(mcap_file(mcap_channel(1, "tick", "protobuf") + mcap_message(1, 1000, "...."))),
              HasSubstr("channel 'tick' is 'protobuf' (allowed: 'json'"));
  EXPECT_THAT(complaint_about(one_tick(R"({"t":0,"y":0.06})")), HasSubstr("tick 0 (byte"));
  EXPECT_THAT(complaint_about(mcap_file(mcap_chunk("br9", "x", {1, 0}))),
              HasSubstr("compressed with 'br9' (allowed: none, zstd, lz4)"));
  EXPECT_THAT(complaint_about(mcap_file(mcap_chunk("zstd", "no frame of it", {1, 0}))),
              HasSubstr("a damaged chunk (zstd: "));
  EXPECT_THAT(complaint_about(mcap_file(mcap_channel(1, "tick\x1b[2J", "json"))), HasSubstr("'tick\\x1b[2J'"));
  EXPECT_THAT(complaint_about(""), HasSubstr("no MCAP file"));
}

TEST(ForeignMcap, WhatMcapForbidsIsRefusedWithItsByte) {
  std::string nested = mcap_channel(1, "tick", "json");
  for (int i = 0; i < 100; ++i) nested = whole_chunk("", nested);
  EXPECT_THAT(complaint_about(mcap_file(nested)), HasSubstr("byte 0 of the chunk at byte 8: a chunk in a chunk"));
  std::string channels;
  for (std::uint16_t i = 0; i < 5000; ++i) channels += mcap_channel(i, "tick", "json");
  EXPECT_THAT(complaint_about(mcap_file(channels)), HasSubstr("another channel (allowed: at most 4096)"));
  EXPECT_THAT(complaint_about(mcap_file(mcap_channel(1, "a", "json") + mcap_channel(1, "b", "json"))),
              HasSubstr("channel 1 a second time"));
}

TEST(ForeignMcap, EventsAndMetadataAreBounded) {
  const std::string channels = mcap_channel(1, "tick", "json") + mcap_channel(2, "event", "json");
  const auto event = [](std::size_t size) {
    return mcap_message(2, 1000, R"({"time_s":0,"kind":")" + std::string(size, 'a') + "\"}");
  };
  EXPECT_THAT(complaint_about(mcap_file(channels + event(5000))),
              AllOf(HasSubstr("event 0 (byte"), HasSubstr("5022 bytes (allowed: at most 4096)")));
  std::string many;
  for (int i = 0; i <= 100'000; ++i) many += event(1);
  EXPECT_THAT(complaint_about(mcap_file(channels + whole_chunk("zstd", many))),
              HasSubstr("event 100000 (byte 5400000 of the chunk"));
  std::string metadata;
  for (int i = 0; i < 5000; ++i) metadata += mcap_record(McapRecord::metadata, sized(fmt::format("{}", i)) + sized(""));
  EXPECT_THAT(complaint_about(mcap_file(channels + metadata)),
              HasSubstr("more metadata (allowed: at most 4096 records and entries)"));
}

TEST(ForeignMcap, AChangedFileIsTold) {
  const std::string data =
      std::string(mcap_magic) + whole_chunk("", mcap_channel(1, "tick", "json") + ticks_json(0, 10));
  const std::string records = data.substr(mcap_magic.size());
  const auto problem = [&](std::uint32_t crc, const std::string& behind) {
    const test::Folder folder;
    std::ofstream(folder / "x.mcap", std::ios::binary) << mcap_file(records, crc) << behind;
    const RecordedRun run = read_run((folder / "x.mcap").string());
    EXPECT_EQ(run.ticks.size(), 10u);
    return run.problem;
  };
  EXPECT_EQ(problem(crc32(data), ""), "");
  EXPECT_EQ(problem(0, ""), "");
  EXPECT_THAT(problem(crc32(data) + 1, ""), HasSubstr("another checksum"));
  EXPECT_THAT(problem(0, "another log"), HasSubstr("more behind its end"));
}

TEST(ForeignMcap, NumbersThatNoTickHasAreRefusedByKey) {
  const auto tick = [](const std::string& key, const std::string& value) {
    TickRecord t;
    std::string json;
    TickFormat(actuator_description()).json(t, json);
    const std::size_t at = json.find("\"" + key + "\":") + key.size() + 3;
    json.replace(at, json.find_first_of(",}", at) - at, value);
    return complaint_about(one_tick(json));
  };
  EXPECT_EQ(tick("coils", "15"), "accepted");
  EXPECT_THAT(tick("coils", "-1"), HasSubstr("key 'coils': -1 (allowed: a whole number from 0 to 4294967295)"));
  EXPECT_THAT(tick("coils_decided", "4294967296"), HasSubstr("coils_decided"));
  EXPECT_THAT(tick("coils", "1.5"), HasSubstr("coils"));
  EXPECT_THAT(tick("coils", "null"), HasSubstr("coils"));
  EXPECT_THAT(tick("coils", "\"all\""), HasSubstr("no key 'coils'"));
  EXPECT_THAT(tick("time_s", "1e308"), HasSubstr("key 'time_s': 1e+308 (allowed: 0 to 100000)"));
  EXPECT_THAT(tick("time_s", "null"), HasSubstr("time_s"));
  EXPECT_THAT(tick("time_s", "-0.5"), HasSubstr("time_s"));
  EXPECT_THAT(tick("rung", "7"), HasSubstr("rung"));
  EXPECT_THAT(tick("solve_status", "9"), HasSubstr("solve_status"));
  EXPECT_THAT(tick("position_m", "1e300"), HasSubstr("position_m"));
  EXPECT_EQ(tick("position_m", "null"), "accepted");  // a channel that was not there
  EXPECT_THAT(tick("position_m", "1e999"), HasSubstr("no JSON at its byte"));
  EXPECT_THAT(complaint_about(one_tick("[1]")), HasSubstr("no JSON object"));
  EXPECT_THAT(complaint_about(one_tick(std::string(5000, '[') + std::string(5000, ']'))), HasSubstr("no JSON object"));
  EXPECT_THAT(complaint_about(one_tick(R"({"a":)" + std::string(5000, '[') + "1")), HasSubstr("16 deep"));
  EXPECT_THAT(complaint_about(one_tick(std::string(70000, ' '))), HasSubstr("70000 bytes"));
}

TEST(ForeignMcap, TimesIncreaseAndGapsAreBounded) {
  const auto two = [](int second) {
    return complaint_about(
        mcap_file(whole_chunk("", mcap_channel(1, "tick", "json") + ticks_json(5, 1) + ticks_json(second, 1))));
  };
  EXPECT_EQ(two(6), "accepted");
  EXPECT_THAT(two(5), HasSubstr("tick 1"));
  EXPECT_THAT(two(4), HasSubstr("times that increase"));
  EXPECT_THAT(two(4'000'000), HasSubstr("by at most 3600 s"));
}

TEST(ForeignMcap, MetadataHasOnlyTheValuesThatRunWrites) {
  const auto with = [](const std::string& key, const std::string& value) {
    std::string content = sized("run") + sized(sized(key) + sized(value));
    return complaint_about(mcap_file(mcap_record(McapRecord::metadata, content) +
                                     whole_chunk("", mcap_channel(1, "tick", "json") + ticks_json(0, 3))));
  };
  EXPECT_EQ(with("policy", "next_slot"), "accepted");
  EXPECT_THAT(with("policy", "abc"), HasSubstr("key 'policy': 'abc' (allowed: at_once, next_slot)"));
  EXPECT_THAT(with("plant", "moon"), HasSubstr("sim, emulator, comedi"));
  EXPECT_THAT(with("seed", "-1"), HasSubstr("seed"));
  EXPECT_THAT(with("seed", "18446744073709551616"), HasSubstr("seed"));
  EXPECT_THAT(with("system", "boat"), HasSubstr("'boat' (allowed: "));
}

TEST(ForeignMcap, NumbersOfNestedJsonHavePaths) {
  std::string seen;
  const auto take = [&](const std::string& path, double value) {
    seen += path + "=" + std::to_string(value).substr(0, 3) + " ";
  };
  EXPECT_EQ(read_json_numbers(R"({"a":1,"b":{"c":[2,"x",{"d":true}],"e":3},"f":4})", take), std::nullopt);
  EXPECT_EQ(seen, "a=1.0 b.c.0=2.0 b.c.2.d=1.0 b.e=3.0 f=4.0 ");
}

/// Other people's topics at rates of their own, their pressures in bar and half a step late.
std::string bench_channels() {
  std::string records = mcap_channel(1, "/slide", "json") + mcap_channel(2, "/air", "json") +
                        mcap_channel(3, "/valves", "json") + mcap_channel(4, "/ros", "cdr") +
                        mcap_message(4, 0, "....");
  for (std::uint64_t k = 0; k < 400; ++k) {
    const std::uint64_t at = 1'700'000'000'000'000'000u + k * 1'000'000;
    const std::uint64_t half_newtons = k / 50;
    if (k % 50 == 0)
      records += mcap_message(
          3, at, fmt::format(R"({{"bits":{},"force":{}}})", half_newtons, 0.5 * static_cast<double>(half_newtons)));
    records +=
        mcap_message(1, at, fmt::format(R"({{"name":"y","pose":{{"y":{}}}}})", 50.0 + 0.01 * static_cast<double>(k)));
    records +=
        mcap_message(2, at + 500'000, fmt::format(R"({{"bar":[{},{}]}})", 1.5 + 0.001 * static_cast<double>(k), 1.4));
  }
  return mcap_file(whole_chunk("zstd", records));
}

TEST(ForeignMcap, JsonChannelsGiveARecord) {
  const test::Folder folder;
  const std::string path = (folder / "bench.mcap").string();
  std::ofstream(path, std::ios::binary) << bench_channels();
  LogSettings settings;
  settings.columns = {"position_m=/slide.pose.y*1e-3", "pressure_a_pa=/air.bar.0*1e5", "pressure_b_pa=/air.bar.1*1e5",
                      "motor_n=/valves.force", "coils=/valves.bits"};
  const LogRecords log = read_log_records(path, settings);
  ASSERT_EQ(log.records.size(), 1u);
  const Record& r = log.records[0];
  ASSERT_EQ(r.size(), 399u);  // before the first pressure nothing is known
  EXPECT_EQ(r.period_s, 0.001);
  EXPECT_EQ(r.name, "bench");
  for (std::size_t t = 0; t < r.size(); ++t) {
    const double k = static_cast<double>(t) + 1;
    EXPECT_NEAR(r.position_m[t], 0.05 + 1e-5 * k, 1e-9) << t;
    EXPECT_NEAR(r.pressure_a_pa[t], 1.5e5 + 100 * (k - 0.5), 0.1) << t;
    EXPECT_EQ(r.coils[t], (t + 1) / 50) << t;
    EXPECT_EQ(r.motor_n[t], 0.5 * r.coils[t]) << t;
  }
  const auto complaint = [&](std::size_t column, const std::string& text) -> std::string {
    LogSettings other = settings;
    other.columns[column] = text;
    try {
      read_log_records(path, other);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(complaint(4, "coils=/ros.bits"), HasSubstr("channel '/ros' is 'cdr'"));
  EXPECT_THAT(complaint(4, "coils=/valves.bit"), AllOf(HasSubstr("'/valves.bit'"), HasSubstr("'/slide', '/air'")));
  EXPECT_THAT(complaint(4, "coils=/valves.force"), HasSubstr("coils 0.5 at"));
  EXPECT_THAT(complaint(4, "time_s=/valves.t"), HasSubstr("--column time_s"));
  EXPECT_THAT(complaint(4, "label=/valves.t"), HasSubstr("no --column coils"));
}

/// Each log command refuses in a line, at once.
TEST(ForeignMcap, EveryCommandRefusesHostileLogs) {
  const test::Folder folder;
  std::ofstream(folder / "negative.mcap", std::ios::binary) << one_tick(R"({"time_s":0,"coils":-1})");
  folder.write("empty.mcap", "");
  ASSERT_EQ(::mkfifo((folder / "pipe.mcap").c_str(), 0600), 0);
  for (const char* log : {"negative.mcap", "empty.mcap", "pipe.mcap"})
    for (const char* command : {"export", "replay", "profile", "identify --log"}) {
      const std::string text = test::refusal_of(folder, std::string(command) + " " + log);
      EXPECT_THAT(text, HasSubstr(log));
      EXPECT_THAT(text, HasSubstr("(allowed: "));
    }
}

}  // namespace
}  // namespace solenoid
