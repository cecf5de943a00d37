#include "experiments/base/printed_table.hpp"

#include <stdexcept>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

TEST(PrintedNumber, KeepsTheBound) {
  EXPECT_EQ(PrintedNumber::parse("2.85").value, 2.85);
  EXPECT_FALSE(PrintedNumber::parse("2.85").upper_bound);
  EXPECT_EQ(PrintedNumber::parse("<0.01").value, 0.01);
  EXPECT_TRUE(PrintedNumber::parse("<0.01").upper_bound);
}

TEST(PrintedNumber, RefusesWhatIsNotANumber) {
  for (const char* text : {"", "<", "none", "1.2mm", ">0.01", "nan", "inf"})
    EXPECT_THROW(PrintedNumber::parse(text), std::invalid_argument) << text;
}

TEST(PrintedTable, ShipsTheFiguresOfTheThesis) {
  const PrintedTable steps = PrintedTable::shipped("table_5-2_step_np");
  ASSERT_EQ(steps.rows(), 10u);
  EXPECT_EQ(steps.number(4, "np").value, 120);
  EXPECT_EQ(steps.number(4, "max_abs_steady_state_error_mm").value, 2.06);
  const PrintedTable cycloidal = PrintedTable::shipped("table_6-1_sim_vertical_cycloidal");
  ASSERT_EQ(cycloidal.rows(), 9u);
  EXPECT_EQ(cycloidal.text(1, "motor"), "id");
  EXPECT_TRUE(cycloidal.number(1, "ssa_mm").upper_bound);
  EXPECT_EQ(cycloidal.number(0, "ssa_mm").value, 2.85);
  EXPECT_EQ(PrintedTable::shipped("table_6-2_sim_vertical_sine").rows(), 6u);
  EXPECT_EQ(PrintedTable::shipped("tables_7-1_to_7-9_experiments").rows(), 26u);
}

TEST(PrintedTable, RefusesUnknownTablesColumnsAndRaggedRows) {
  EXPECT_THROW(PrintedTable::shipped("table_9-9"), std::invalid_argument);
  const PrintedTable table = PrintedTable::parse("a,b\r\n1,2\r\n\n3,\n", "t");
  ASSERT_EQ(table.rows(), 2u);
  EXPECT_EQ(table.text(0, "b"), "2");
  EXPECT_EQ(table.text(1, "b"), "");
  EXPECT_THROW(table.text(0, "c"), std::invalid_argument);
  EXPECT_THROW(table.text(2, "a"), std::out_of_range);
  EXPECT_THROW(PrintedTable::parse("a,b\n1\n", "t"), std::invalid_argument);
}

}  // namespace
}  // namespace solenoid
