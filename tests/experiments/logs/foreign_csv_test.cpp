#include "core/config/reader.hpp"
#include "experiments/logs/column_source.hpp"
#include "experiments/logs/csv_layout.hpp"
#include "experiments/systems/actuator/identify/log_source.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

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

constexpr int csv_rows = 400;
const std::vector<std::string> csv_headings = {"time_s",        "position_m", "pressure_a_pa",
                                               "pressure_b_pa", "motor_n",    "coils"};

/// How a test's log is written, and what is done to its rows.
struct Written {
  std::vector<std::string> headings = csv_headings;
  std::string separator = ",", end = "\n", before;
  std::array<double, 6> scale = {1, 1, 1, 1, 1, 1}, offset = {0, 0, 0, 0, 0, 0};
  bool quoted = false, decimal_comma = false;
  std::function<bool(int row)> there = [](int) { return true; };
};

std::string cell_text(double value, const Written& w) {
  std::string text = fmt::format("{}", value);
  if (w.decimal_comma) std::replace(text.begin(), text.end(), '.', ',');
  return w.quoted ? "\"" + text + "\"" : text;
}

std::string csv_of(const Written& w) {
  std::string text = w.before;
  for (std::size_t i = 0; i < w.headings.size(); ++i)
    text += (i > 0 ? w.separator : "") + (w.quoted ? "\"" + w.headings[i] + "\"" : w.headings[i]);
  text += w.end;
  for (int k = 0; k < csv_rows; ++k) {
    if (!w.there(k)) continue;
    const std::array<double, 6> row = {k / 1024.0,        0.05 + k / 65536.0, 150000.0 + 16 * k,
                                       140000.0 - 16 * k, 1.5 + k / 64.0,     (k / 40) % 16 * 1.0};
    for (std::size_t i = 0; i < row.size(); ++i)
      text += (i > 0 ? w.separator : "") + cell_text((row[i] - w.offset[i]) / w.scale[i], w);
    text += w.end;
  }
  return text;
}

LogRecords read(const Written& w, const LogSettings& settings = {}) {
  return records_from_csv(csv_of(w), "x.csv", settings);
}

std::string csv_complaint(const std::string& text, const LogSettings& settings = {}) {
  try {
    records_from_csv(text, "x.csv", settings);
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("(allowed: "), Not(HasSubstr("\n"))));
    return error.what();
  }
  return "accepted";
}

void expect_plain(const LogRecords& log) {
  static const Record plain = read({}).records.at(0);
  ASSERT_EQ(log.records.size(), 1u);
  const Record& r = log.records[0];
  ASSERT_EQ(r.size(), plain.size());
  EXPECT_EQ(r.coils, plain.coils);
  for (std::size_t t = 0; t < r.size(); ++t) {
    EXPECT_NEAR(r.position_m[t], plain.position_m[t], 1e-9) << t;
    EXPECT_NEAR(r.pressure_a_pa[t], plain.pressure_a_pa[t], 1e-3) << t;
    EXPECT_NEAR(r.motor_n[t], plain.motor_n[t], 1e-9) << t;
  }
}

TEST(ForeignCsv, IsReadToTheSameNumbersHoweverItIsWritten) {
  EXPECT_THAT(read({}).told, IsEmpty());
  EXPECT_DOUBLE_EQ(read({}).records.at(0).period_s, 1.0 / 1024);  // not the 977 us that it is nearly
  Written w;
  w.end = "\r\n";
  expect_plain(read(w));
  w = {};
  w.before = "\xef\xbb\xbf";
  expect_plain(read(w));
  w = {};
  w.quoted = true;
  expect_plain(read(w));
  w = {};
  w.separator = ", ";
  expect_plain(read(w));
  EXPECT_THAT(read(w).told, IsEmpty());
  w = {};
  w.separator = "\t";
  expect_plain(read(w));
  EXPECT_THAT(read(w).told, ElementsAre(HasSubstr("tabs between cells")));
  w = {};
  w.separator = ";";
  w.decimal_comma = true;
  expect_plain(read(w));
  EXPECT_THAT(read(w).told,
              ElementsAre(AllOf(HasSubstr("semicolons"), HasSubstr("decimal commas"), HasSubstr("--decimal"))));
  w = {};
  w.quoted = w.decimal_comma = true;  // commas between cells and in them
  expect_plain(read(w));
  w = {};
  w.before = "bench 3; logger 2.1, \"operator\" away\n\n# a comment\n";
  expect_plain(read(w));
  EXPECT_THAT(read(w).told, ElementsAre(HasSubstr("the heading in line 4, a line before it passed over")));
}

TEST(ForeignCsv, OptionsStandAboveWhatIsFound) {
  LogSettings settings;
  settings.dialect = {';', ',', 2};
  Written w;
  w.before = "time_s,position_m,pressure_a_pa,pressure_b_pa,motor_n,coils\nof another log\n";
  w.separator = ";";
  w.decimal_comma = true;
  EXPECT_THAT(read(w, settings).told, IsEmpty());
  expect_plain(read(w, settings));
  settings.dialect.decimal = '.';
  EXPECT_THAT(csv_complaint(csv_of(w), settings), HasSubstr("x.csv:4: column 'position_m': '0,05' is no number"));
  EXPECT_THROW(delimiter_of("dash"), ConfigError);
  EXPECT_EQ(delimiter_of("tab"), '\t');
}

TEST(ForeignCsv, UnitsOfHeadingsAreConvertedAndTold) {
  Written w;
  w.headings = {"time [ms]", "position (mm)", "pressure_a_kpa", "pressure_b [barg]", "motor_n", "coils"};
  w.scale = {1e-3, 1e-3, 1e3, 1e5, 1, 1};
  w.offset = {0, 0, 0, 101325, 0, 0};
  expect_plain(read(w));
  EXPECT_THAT(read(w).told, ElementsAre(HasSubstr("time_s = 'time [ms]' * 0.001"), HasSubstr("position_m"),
                                        HasSubstr("pressure_a_pa"),
                                        HasSubstr("pressure_b_pa = 'pressure_b [barg]' * 100000 + 101325")));
  w.headings[1] = "position [furlong]";
  EXPECT_THAT(csv_complaint(csv_of(w)), HasSubstr("unit 'furlong' (allowed: m, cm, mm, um, in;"));
}

TEST(ForeignCsv, AColumnHasAFactorAndAnOffset) {
  Written w;
  w.headings = {"t", "y-1", "pA", "pB", "F*", "u"};
  w.scale = {1, 1, 1e5, 1e5, -1, 1};
  w.offset = {0, 0.25, 101325, 101325, 0, 0};
  LogSettings settings;
  settings.columns = {"time_s=t",
                      "position_m=y-1+0.25",
                      "pressure_a_pa=pA*1e5+101325",
                      "pressure_b_pa = pB * 1e5 + 101325",
                      "motor_n=F**-1",
                      "coils=u"};
  expect_plain(read(w, settings));
  const auto scaled = [](const std::string& text) { return ColumnSource{"time_s", text}.scaled(); };
  EXPECT_EQ(scaled("x*-2e-3-1e+1").factor, -2e-3);
  EXPECT_EQ(scaled("x*-2e-3-1e+1").offset, -10.0);
  EXPECT_EQ(scaled("x-273.15").offset, -273.15);
  EXPECT_EQ(scaled("x-273.15").heading, "x");
  EXPECT_FALSE(scaled("x-y").said);
  for (const char* wrong : {"x*", "x*fast", "x*2+", "x*2 3", "x*nan", "x*1e999", "x*2+3+4"})
    EXPECT_THROW(scaled(wrong), ConfigError) << wrong;
}

TEST(ForeignCsv, GaugePressureIsNotTakenForAbsolute) {
  Written w;
  w.offset = {0, 0, 101325, 101325, 0, 0};
  EXPECT_THAT(csv_complaint(csv_of(w)), AllOf(HasSubstr("x.csv: pressure_a_pa"), HasSubstr("+101325")));
}

TEST(ForeignCsv, AMissingColumnIsShownWithWhatCannotBeSeen) {
  Written w;
  w.headings[1] = "position\xc2\xa0m";
  EXPECT_THAT(
      csv_complaint(csv_of(w)),
      HasSubstr("x.csv:1: no column 'position_m', nearest is 'position\\xc2\\xa0m' (allowed: --column position_m="));
  w = {};
  w.headings[1] = "time_s";
  EXPECT_THAT(csv_complaint(csv_of(w)), HasSubstr("column 'time_s' twice, as columns 1 and 2"));
}

TEST(ForeignCsv, AGapDividesTheLog) {
  Written w;
  w.there = [](int k) { return k != 50 && (k < 210 || k >= 230); };  // 209 rows, 20 lost, 170 rows: too few
  const LogRecords one = read(w);
  ASSERT_EQ(one.records.size(), 1u);
  EXPECT_EQ(one.records[0].filled, 1u);  // a single lost row is bridged, and counted
  EXPECT_EQ(one.records[0].size(), 210u);
  EXPECT_THAT(one.told, ElementsAre(HasSubstr("divided there"), HasSubstr("170 samples between gaps left out")));
  w.there = [](int k) { return k % 100 != 99 && k % 100 != 98 && k % 100 != 97; };
  EXPECT_THAT(csv_complaint(csv_of(w)), HasSubstr("3 gaps, and nowhere 200 samples"));
}

TEST(ForeignCsv, BothSidesOfAGapKeepTheirNumbersAndNothingIsPutBetween) {
  LogSamples s;
  for (int k = 0; k < 900; ++k)
    if (k < 400 || k >= 430) s.add(1e-3 * k, 1e-4 * k, 1.5e5, 1.5e5, k < 400 ? 1.0 : 2.0, k < 400 ? 1 : 2);
  const LogRecords log = even_records(s, "x", {});
  ASSERT_EQ(log.records.size(), 2u);
  EXPECT_EQ(log.records[0].size(), 400u);
  EXPECT_EQ(log.records[1].size(), 470u);
  EXPECT_EQ(log.records[1].part, 2);
  EXPECT_EQ(log.records[0].part_name() + "_2", log.records[1].part_name());
  EXPECT_DOUBLE_EQ(log.records[1].position_m[0], 0.043);
  EXPECT_THAT(log.records[0].motor_n, testing::Each(1.0));
  EXPECT_THAT(log.records[1].motor_n, testing::Each(2.0));
}

/// A slide at 50 mm/s whose coils are switched each 41 rows, at these steps one after the other.
LogSamples samples_at(const std::function<double(std::size_t row)>& step_s, std::size_t rows) {
  LogSamples s;
  double t = 0.5;
  for (std::size_t k = 0; k < rows; t += step_s(k++)) {
    const auto pattern = static_cast<SwitchPattern>(k / 41 % 2);
    s.add(t, 0.01 + 0.05 * (t - 0.5), 1.5e5, 1.4e5, 1.0 * pattern, pattern);
    s.labels.push_back(fmt::format("held#{}", k / 41));
  }
  return s;
}

TEST(ForeignCsv, StepsThatChangeAreBroughtToEvenOnesAndTold) {
  for (const double first : {1.2e-3, 1.02e-3}) {
    const double second = 2e-3 - first;
    const LogSamples s = samples_at([&](std::size_t k) { return k < 600 ? first : second; }, 1201);
    const LogRecords log = even_records(s, "x", {});
    ASSERT_EQ(log.records.size(), 1u);
    EXPECT_THAT(log.told, ElementsAre(HasSubstr("steps vary: brought to even ones of 1 ms")));
    const Record& r = log.records[0];
    EXPECT_DOUBLE_EQ(r.period_s, 1e-3);
    for (std::size_t k = 0; k < r.size(); ++k)
      ASSERT_NEAR(r.position_m[k], 0.01 + 0.05 * 1e-3 * static_cast<double>(k), 1e-6) << k;
    EXPECT_EQ(r.filled, 0u);
  }
}

TEST(ForeignCsv, CommandsOfStepsThatChangeBeginAsOftenEarlyAsLateWithTheirLabels) {
  const LogSamples s = samples_at([](std::size_t k) { return k < 600 ? 1.2e-3 : 0.8e-3; }, 1201);
  const Record r = even_records(s, "x", {}).records.at(0);
  ASSERT_EQ(r.spans.size(), 1201u / 41 + 1);
  double sum = 0;
  for (std::size_t i = 0; i < r.spans.size(); ++i) {
    const Span& span = r.spans[i];
    EXPECT_EQ(span.label, "held");
    const double begun = s.time[41 * i] - s.time[0], late = r.period_s * static_cast<double>(span.first) - begun;
    EXPECT_LE(std::abs(late), 0.501 * r.period_s) << i;
    sum += late;
    for (std::size_t k = span.first; k < span.last; ++k) {
      EXPECT_EQ(r.coils[k], i % 2) << k;
      EXPECT_EQ(r.motor_n[k], 1.0 * r.coils[k]) << k;
    }
  }
  EXPECT_LT(std::abs(sum) / static_cast<double>(r.spans.size()), 0.2 * r.period_s);
}

TEST(ForeignCsv, AClocksJitterChangesNothing) {
  const LogSamples s = samples_at([](std::size_t k) { return k % 2 == 0 ? 1.2e-3 : 0.8e-3; }, 1001);
  const LogRecords log = even_records(s, "x", {});
  EXPECT_THAT(log.told, IsEmpty());
  EXPECT_DOUBLE_EQ(log.records.at(0).period_s, 1e-3);
  EXPECT_EQ(log.records.at(0).position_m, s.position);
  EXPECT_EQ(log.records.at(0).coils, s.coils);
  const LogSamples wide = samples_at([](std::size_t k) { return k % 2 == 0 ? 1.4e-3 : 0.6e-3; }, 1001);
  EXPECT_THAT(even_records(wide, "x", {}).told, ElementsAre(HasSubstr("steps vary")));
}

TEST(ForeignCsv, WhatNoActuatorHasIsRefusedWithItsLine) {
  const auto with = [](const std::string& column) {
    LogSettings settings;
    settings.columns = {column};
    return csv_complaint(csv_of({}), settings);
  };
  EXPECT_THAT(with("position_m=position_m*1000"),
              HasSubstr("x.csv:2: position_m 50 m (allowed: -0.254 to 0.254 m; in another unit: --column position_m="));
  EXPECT_THAT(with("position_m=position_m*-1000"), HasSubstr("position_m -50 m"));
  EXPECT_THAT(with("position_m=position_m*1e308+1e308"), HasSubstr("position_m 1.05e+308 m"));
  EXPECT_THAT(with("pressure_a_pa=pressure_a_pa*1e308"), HasSubstr("pressure_a_pa inf Pa (allowed: 0 to"));
  EXPECT_THAT(with("pressure_b_pa=pressure_b_pa*1000"), HasSubstr("pressure_b_pa 1.4e+08 Pa"));
  EXPECT_THAT(with("pressure_b_pa=pressure_b_pa-141000"), HasSubstr("of gauge pressure: --column pressure_b_pa="));
  EXPECT_THAT(with("motor_n=motor_n*1000"), HasSubstr("motor_n 1500 N (allowed: -40 to 40 N"));
  EXPECT_EQ(with("motor_n=motor_n*-2"), "accepted");
  const std::string text = csv_of({}) + "0.390625,1e300,150000,150000,0,0\n";
  EXPECT_THAT(csv_complaint(text), HasSubstr("x.csv:402: position_m 1e+300 m"));
}

TEST(ForeignCsv, APositionThatNeverChangesIsTold) {
  LogSettings settings;
  settings.columns = {"position_m=position_m*0+0.05"};
  EXPECT_THAT(read({}, settings).told, ElementsAre(HasSubstr("position_m is 0.05 in every sample")));
}

TEST(ForeignCsv, TimesThatDoNotIncreaseAreRefusedOrSaidAgain) {
  const std::string text = csv_of({});
  std::vector<std::string> lines;
  for (std::string_view rest = text; !rest.empty();) lines.emplace_back(take_line(rest));
  const auto with = [&](std::size_t at, const std::string& line) {
    std::string all;
    for (std::size_t i = 0; i < lines.size(); ++i) all += (i == at ? line : "") + lines[i];
    return all;
  };
  const LogRecords again = records_from_csv(with(10, lines[9]), "x.csv", {});
  expect_plain(again);
  EXPECT_THAT(again.told, ElementsAre(HasSubstr("1 rows")));
  std::string other = lines[9];
  other.replace(other.find(",0.05"), 5, ",0.06");
  EXPECT_THAT(csv_complaint(with(10, other)), HasSubstr("x.csv:11: time"));
  EXPECT_THAT(csv_complaint(with(10, lines[5])), HasSubstr("times that increase"));
  EXPECT_THAT(csv_complaint(text + "1e300,0,0,0,0,0\n"), HasSubstr("100000 s in all"));
}

TEST(ForeignCsv, WhatIsNoCsvIsRefusedAtOnce) {
  const std::string heading = "time_s,position_m,pressure_a_pa,pressure_b_pa,motor_n,coils\n";
  EXPECT_THAT(csv_complaint(""), HasSubstr("no heading"));
  EXPECT_THAT(csv_complaint("\xff\xfet"), HasSubstr("UTF-16"));
  EXPECT_THAT(csv_complaint(std::string("a\0b", 3)), HasSubstr("no text"));
  EXPECT_THAT(csv_complaint(heading + "0,\"" + std::string(200000, 'x')), HasSubstr("a quote that is not closed?"));
  EXPECT_THAT(csv_complaint(heading + "0,1\"2\",3,4,5,6\n"), HasSubstr("x.csv:2: a quote in the middle of a cell"));
  EXPECT_THAT(csv_complaint(heading + std::string(100000, ',') + "\n"), HasSubstr("at most 4096"));
  EXPECT_THAT(csv_complaint(heading + "0,1,150000,150000,0,16\n"), HasSubstr("a whole number from 0 to 15"));
  LogSettings three_way;
  three_way.valves = "three_way";
  EXPECT_THAT(csv_complaint(heading + "0,1,150000,150000,0,4\n", three_way), HasSubstr("0 to 3"));
  EXPECT_THAT(csv_complaint("# plane=diagonal\n" + heading), HasSubstr("vertical, horizontal"));
  EXPECT_THAT(csv_complaint("# experiment=../x\n" + heading), HasSubstr("without a slash"));
}

TEST(ForeignCsv, ACutLastLineIsLeftOutAndTold) {
  const LogRecords log = records_from_csv(csv_of({}) + "0.5,0.05,15", "x.csv", {});
  expect_plain(log);
  EXPECT_THAT(log.told, ElementsAre(HasSubstr("line 402, the last, is cut")));
}

TEST(ForeignCsv, QuotedCellsHoldSeparatorsQuotesAndLineEnds) {
  const std::string text = "a,\"b, \"\"c\"\"\nd\",e\n# no row\n\n1,\" 2 \",3\r\n4,5,6";
  CsvRows rows(text, "x.csv", ',', 1);
  ASSERT_TRUE(rows.next());
  EXPECT_THAT(rows.cells(), ElementsAre("a", "b, \"c\"\nd", "e"));
  ASSERT_TRUE(rows.next());
  EXPECT_THAT(rows.cells(), ElementsAre("1", "2", "3"));
  EXPECT_EQ(rows.line(), 5);
  ASSERT_TRUE(rows.next());
  EXPECT_THAT(rows.cells(), ElementsAre("4", "5", "6"));
  EXPECT_TRUE(rows.cut());
  EXPECT_FALSE(rows.next());
  EXPECT_FALSE(rows.next());
}

}  // namespace
}  // namespace solenoid
