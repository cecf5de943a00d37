// A long run under load: the command itself, for a short time.
#include "tests/experiments/program_under_test.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using test::Folder;
using test::ProgramRun;
using test::run_program;

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool measured = false;  // a sanitizer keeps what was freed, and counts what was done
#else
constexpr bool measured = true;
#endif

TEST(Soak, AccountsForEveryTickInConstantMemory) {
  const Folder folder;
  const ProgramRun run = run_program(folder, "soak --duration 10 --format json");
  ASSERT_TRUE(run.exit_code == 0 || run.exit_code == 1) << run.err << run.out;
  const auto found = nlohmann::json::parse(run.out);
  for (const std::string what : found.at("findings"))
    if (measured || !what.starts_with("memory grew")) ADD_FAILURE() << what;
  EXPECT_EQ(found.at("ticks").get<int>() + found.at("skipped").get<int>(), found.at("due").get<int>());
  EXPECT_NEAR(found.at("due").get<double>(), 10'027, 3);
  EXPECT_GE(found.at("looks").size(), 10u);
}

}  // namespace
}  // namespace solenoid
