#include "core/config/one_line.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

TEST(OneLine, ShowsWhatATerminalWouldObey) {
  EXPECT_EQ(one_line("a\nb\t\x1b[2J\x7f"), "a\\x0ab\\x09\\x1b[2J\\x7f");
  EXPECT_EQ(one_line("\xc2\x9b\x32J \xc2\xb5s"), "\\xc2\\x9b2J \xc2\xb5s");  // a control of two bytes; a letter
  EXPECT_EQ(one_line("\xc2"), "\xc2");
}

TEST(OneLine, LeavesOutTheMiddleOfWhatIsTooLong) {
  const std::string begin(5000, 'b'), end(5000, 'e');
  const std::string line = one_line(begin + end + "(allowed: less)");
  EXPECT_LT(line.size(), 2000u);
  EXPECT_TRUE(line.starts_with("bbb"));
  EXPECT_NE(line.find("b ... e"), std::string::npos);
  EXPECT_TRUE(line.ends_with("e(allowed: less)"));
  EXPECT_EQ(one_line(line), line);
  EXPECT_EQ(one_line(std::string(1900, 'x')), std::string(1900, 'x'));
}

}  // namespace
}  // namespace solenoid
