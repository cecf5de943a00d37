#include "experiments/base/result.hpp"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>

namespace solenoid {
namespace {

using testing::HasSubstr;
using testing::Not;
using Column = Table::Column;
using Data = Table::Data;

TEST(Table, ShortNumbersKeepThreeDigits) {
  EXPECT_EQ(short_number(0), "0");
  EXPECT_EQ(short_number(1.0 / 3), "0.333");
  EXPECT_EQ(short_number(12.345), "12.3");
  EXPECT_EQ(short_number(8091.2), "8091");
  EXPECT_EQ(short_number(-0.00123456), "-0.00123");
  EXPECT_EQ(short_number(1.5e-6), "1.50e-06");
}

TEST(Table, MarksReadWithoutColourAndKeepAPlace) {
  Table table{.columns = {Column("", "name", "<"), Column("", "mm")}};
  table.add({"a", {1, true}});
  table.add({"bb", 22});
  EXPECT_EQ(table.text(false), "name  mm\na      1*\nbb    22\n");
  EXPECT_THAT(table.text(true), HasSubstr("\033[1;32m"));
}

TEST(Table, NumbersReadByTheirColumnsFormatAndMissingOnesAsADash) {
  Table table{.title = "title",
              .columns = {Column("", "three", ".3f"), Column("", "share %", ".1f%"), Column("", "short"),
                          Column("", "whole"), Column("", "yes"), Column("", "list", "<")},
              .notes = {"note"}};
  table.add({2.0, 0.25, 1234.5678, 1234567, true, std::vector<std::string>{"a", "b"}});
  table.add({std::nan(""), nullptr, std::optional<double>{}, 0, false, std::vector<int>{1, 2}});
  EXPECT_EQ(table.text(false),
            "title\n"
            "three  share %  short    whole  yes  list\n"
            "2.000     25.0   1235  1234567  yes  a; b\n"
            "    -        -      -        0   no  1 2\n"
            "note\n");
}

TEST(Table, CsvQuotesWhatWouldEndACellAndLeavesMissingOnesEmpty) {
  Table table{.columns = {Column("name", "shown"), Column("a.b"), Column("flag?"), Column("", "only shown"),
                          Column("object", "", "", Data::json), Column("list_at_0.5", "", "", Data::csv)}};
  table.add({"a, \"b\"", 0.1 + 0.2, true, 1, Json::object(), std::vector<int>{1, 2}});
  table.add({"line\nend", std::nan(""), nullptr, 1, nullptr, nullptr});
  table.add({"plain", std::numeric_limits<double>::infinity(), false, 1, nullptr, nullptr});
  EXPECT_EQ(table.csv(),
            "name,a_b,flag,list_at_0.5\n"
            "\"a, \"\"b\"\"\",0.30000000000000004,1,1 2\n"
            "\"line\nend\",,,\n"
            "plain,inf,0,\n");
}

TEST(Table, JsonNestsByDotsAndHasNullForWhatIsNoNumber) {
  Table table{.columns = {Column("name"), Column("cold", "", "", Data::json), Column("cold.us?"), Column("number"),
                          Column("bound?"), Column("line", "", "", Data::csv)}};
  table.add({"\"quoted\"", nullptr, 2.5, std::nan(""), "<", 1});
  table.add({"b", nullptr, nullptr, 3, nullptr, 1});
  EXPECT_EQ(table.json().dump(), R"([{"name":"\"quoted\"","cold":{"us":2.5},"number":null,"bound":"<"},)"
                                 R"({"name":"b","cold":null,"number":3}])");
}

TEST(Table, HtmlHoldsNoMarkupOfItsCells) {
  Table table{.columns = {Column("a", "<b>", "<"), Column("hidden")}};
  table.add({{"x < y & \"z\"", true}, "not shown"});
  const std::string html = table.html();
  EXPECT_THAT(html, HasSubstr("<th class=\"left\">&lt;b&gt;</th>"));
  EXPECT_THAT(html, HasSubstr("<strong>x &lt; y &amp; &quot;z&quot;</strong>"));
  EXPECT_THAT(html, Not(HasSubstr("not shown")));
}

TEST(Result, TablesOfOneNameAreSideBySideInDataAndBelowEachOtherInText) {
  Table left{.name = "rows", .title = "left", .columns = {Column("a", "A")}};
  Table right{.name = "rows", .title = "right", .columns = {Column("b", "B")}};
  left.add({1});
  right.add({2});
  Result result{.title = "head", .facts = {{"key", "value"}}, .tables = {left, right}, .notes = {"end"}};
  EXPECT_EQ(result.text(false), "head\n\nleft\nA\n1\n\nright\nB\n2\n\nend\n");
  EXPECT_EQ(Json::parse(result.json()).dump(), R"({"key":"value","rows":[{"a":1,"b":2}]})");
  EXPECT_EQ(result.csv(), "a,b\n1,2\n");
  result.flat = Table{.columns = {Column("c")}};
  EXPECT_EQ(result.csv(), "c\n");
  EXPECT_THAT(result.html("<?xml?><svg>drawn</svg>"), HasSubstr("<svg>drawn</svg>"));
}

}  // namespace
}  // namespace solenoid
