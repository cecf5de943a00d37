#include "core/config/reader.hpp"
#include "experiments/rig/log/mcap_writer.hpp"
#include "experiments/systems/actuator/identify/log_source.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <cstdint>
#include <fstream>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

constexpr int bench_rows = 1000;
constexpr std::uint64_t bench_epoch_ns = 1'700'000'000'000'000'000u;
const std::vector<std::string> bench_columns = {"position_m=/slide.y", "pressure_a_pa=/air.a", "pressure_b_pa=/air.b",
                                                "motor_n=/valves.force", "coils=/valves.bits"};

/// What is said at a row of a bench's log: topics and their messages.
using BenchRow = std::vector<std::pair<std::string, std::string>>;

BenchRow bench_row(int k) {
  return {{"/valves", fmt::format(R"({{"force":{},"bits":{}}})", 0.001 * k, k / 50 % 16)},
          {"/air", fmt::format(R"({{"a":{},"b":140000}})", 150000 + k)},
          {"/slide", fmt::format(R"({{"y":{}}})", 0.05 + 1e-5 * k)}};
}

/// A channel for each of a row's messages, even where their topics are the same; a chunk each hundred rows.
std::string bench_bytes(const std::function<BenchRow(int)>& row = bench_row, std::uint64_t from_ns = bench_epoch_ns) {
  std::string bytes;
  McapWriter writer([&](std::string_view some) { bytes += some; }, "another tool");
  std::vector<std::uint16_t> channels;
  for (const auto& [topic, json] : row(0)) channels.push_back(writer.add_channel(topic, "bench", "{}"));
  for (int k = 0; k < bench_rows; ++k) {
    const BenchRow messages = row(k);
    for (std::size_t i = 0; i < messages.size(); ++i)
      writer.write(channels[i], from_ns + static_cast<std::uint64_t>(k) * 1'000'000, messages[i].second);
    if (k % 100 == 99) writer.flush();
  }
  writer.close();
  return bytes;
}

LogRecords read_bench(const std::string& bytes, const std::vector<std::string>& columns = bench_columns) {
  const test::Folder folder;
  std::ofstream(folder / "x.mcap", std::ios::binary) << bytes;
  LogSettings settings;
  settings.columns = columns;
  return read_log_records((folder / "x.mcap").string(), settings);
}

std::string bench_complaint(const std::string& bytes, const std::vector<std::string>& columns = bench_columns) {
  try {
    read_bench(bytes, columns);
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("x.mcap: "), HasSubstr("(allowed: "), Not(HasSubstr("\n"))));
    return error.what();
  }
  return "accepted";
}

std::vector<std::string> with_column(std::size_t place, const std::string& column) {
  std::vector<std::string> columns = bench_columns;
  columns.at(place) = column;
  return columns;
}

void expect_bench(const Record& r) {
  for (std::size_t t = 0; t < r.size(); ++t) {
    const double k = static_cast<double>(t);
    ASSERT_NEAR(r.position_m[t], 0.05 + 1e-5 * k, 1e-9) << t;
    ASSERT_NEAR(r.pressure_a_pa[t], 150000 + k, 1e-6) << t;
    ASSERT_NEAR(r.motor_n[t], 0.001 * k, 1e-9) << t;
    ASSERT_EQ(r.coils[t], t / 50 % 16) << t;
  }
}

TEST(ForeignChannels, AWholeLogIsReadWithoutAWord) {
  const LogRecords log = read_bench(bench_bytes());
  EXPECT_THAT(log.told, IsEmpty());
  ASSERT_EQ(log.records.at(0).size(), 1000u);
  expect_bench(log.records[0]);
}

TEST(ForeignChannels, AClockMayBeginAtZero) {
  const LogRecords log = read_bench(bench_bytes(bench_row, 0));
  ASSERT_EQ(log.records.at(0).size(), 1000u);
  expect_bench(log.records[0]);
}

TEST(ForeignChannels, DamageIsToldWithItsByteAndWhatCameBeforeIsRead) {
  const std::string whole = bench_bytes();
  const auto told_of = [&](const std::string& bytes, std::size_t least, std::size_t most) {
    const LogRecords log = read_bench(bytes);
    EXPECT_GE(log.records.at(0).size(), least);
    EXPECT_LE(log.records.at(0).size(), most);
    expect_bench(log.records[0]);
    return log.told;
  };
  std::string flipped = whole;
  flipped[whole.find("\"y\":0.05555")] ^= 1;  // in the sixth chunk
  EXPECT_THAT(told_of(flipped, 500, 500), ElementsAre(AllOf(StartsWith("byte "), HasSubstr("wrong checksum"))));
  const std::string cut = whole.substr(0, whole.find("\"y\":0.05555"));
  EXPECT_THAT(told_of(cut, 550, 560), ElementsAre(AllOf(StartsWith("byte "), HasSubstr("cut inside"))));
  std::string changed = whole;
  changed[whole.find("another tool")] = 'A';  // in no chunk
  EXPECT_THAT(told_of(changed, 1000, 1000),
              ElementsAre(AllOf(StartsWith("byte "), HasSubstr("another checksum than the one at their end"))));
}

TEST(ForeignChannels, AFileWithNothingBeforeItsDamageSaysSo) {
  std::string bytes = bench_bytes();
  bytes[bytes.find("\"y\":0.0505")] ^= 1;  // in the first chunk
  EXPECT_THAT(bench_complaint(bytes), AllOf(HasSubstr("fewer than two messages"), HasSubstr("wrong checksum")));
}

TEST(ForeignChannels, TheProgramTellsDamageAndGoesOn) {
  const test::Folder folder;
  const std::string whole = bench_bytes();
  std::ofstream(folder / "cut.mcap", std::ios::binary) << whole.substr(0, whole.size() * 3 / 5);
  std::string arguments = "identify --log cut.mcap --no-figures --out o";
  for (const std::string& column : bench_columns) arguments += " --column " + column;
  EXPECT_THAT(test::run_program(folder, arguments).err, HasSubstr("solenoid: cut.mcap: byte "));
}

TEST(ForeignChannels, TwoPublishersOfATopicAreNotMixed) {
  const std::string two = bench_bytes([](int k) {
    BenchRow row = bench_row(k);
    row.emplace_back("/slide", k % 2 == 0 ? R"({"y":0.01})" : R"({"tare":0.01})");
    return row;
  });
  EXPECT_THAT(bench_complaint(two),
              HasSubstr("x.mcap: --column 'position_m=/slide.y': could mean 'y' of '/slide', channel 3, or 'y' of "
                        "'/slide', channel 4 (allowed: TOPIC.FIELD of one channel alone)"));
  // One that has other fields is none to be mistaken.
  const std::string other = bench_bytes([](int k) {
    BenchRow row = bench_row(k);
    row.emplace_back("/slide", R"({"tare":0.01})");
    return row;
  });
  const LogRecords log = read_bench(other);
  ASSERT_EQ(log.records.at(0).size(), 1000u);
  expect_bench(log.records[0]);
}

TEST(ForeignChannels, TopicAndFieldThatReadAlikeAreNotMixed) {
  const std::string dotted = bench_bytes([](int k) {
    BenchRow row = bench_row(k);
    row.emplace_back("/slide", R"({"rail":{"y":0.06}})");
    row.emplace_back("/slide.rail", R"({"y":0.07})");
    return row;
  });
  EXPECT_THAT(bench_complaint(dotted, with_column(0, "position_m=/slide.rail.y")),
              HasSubstr("could mean 'rail.y' of '/slide', channel 4, or 'y' of '/slide.rail', channel 5"));
}

TEST(ForeignChannels, AFieldTwiceInAMessageIsRefused) {
  const std::string twice = bench_bytes([](int k) {
    BenchRow row = bench_row(k);
    row[2].second = R"({"y":0.05,"y":0.06})";
    return row;
  });
  EXPECT_THAT(bench_complaint(twice), HasSubstr("'/slide.y' twice (allowed: once a message)"));
}

TEST(ForeignChannels, WhatNoActuatorHasIsRefusedWithItsTime) {
  const std::string bytes = bench_bytes();
  EXPECT_THAT(bench_complaint(bytes, with_column(0, "position_m=/slide.y*1000")),
              HasSubstr("x.mcap: '/slide.y*1000' at 0 s: position_m 50 m (allowed: -0.254 to 0.254 m; "));
  EXPECT_THAT(bench_complaint(bytes, with_column(1, "pressure_a_pa=/air.a*1e30")), HasSubstr("1.5e+35 Pa"));
  EXPECT_THAT(bench_complaint(bytes, with_column(1, "pressure_a_pa=/air.a*1e308")), HasSubstr("'/air.a' is no number"));
  EXPECT_THAT(bench_complaint(bytes, with_column(3, "motor_n=/valves.force*1e6")),
              HasSubstr("at 0.001 s: motor_n 1000 N (allowed: -40 to 40 N"));
}

}  // namespace
}  // namespace solenoid
