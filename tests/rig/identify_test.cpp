#include "tests/experiments/program_under_test.hpp"

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using test::Folder;
using test::ProgramRun;
using test::run_program;
using testing::HasSubstr;

double value_of(const nlohmann::json& result, const std::string& name) {
  for (const auto& e : result.at("estimates"))
    if (e.at("name") == name) return e.at("value");
  ADD_FAILURE() << "no " << name;
  return 0;
}

const char* const short_experiments = R"(
[[experiment]]
name    = "charge"
cycles  = 4
[[experiment.step]]
hold_m  = 0.055
seconds = 0.4
[[experiment.step]]
a       = "fill"
b       = "fill"
hold_m  = 0.055
seconds = 0.3
[[experiment]]
name    = "edges"
[[experiment.step]]
a       = "random"
b       = "random"
hold_m  = 0.055
seconds = 3.0
)";

/// Through packets, in real time, on a plant in another process. A busy machine is late; then again.
TEST(Identify, OnTheEmulatorInRealTime) {
  const Folder folder;
  folder.write("experiments.toml", short_experiments);
  ProgramRun run;
  for (int attempt = 0; attempt < 5; ++attempt) {
    std::filesystem::remove_all(folder / "out");
    const std::string port = std::to_string(20000 + (getpid() + 131 * attempt) % 20000);
    const std::string emulator = "{ '" SOLENOID_PROGRAM "' emulator --campaign identify --scenario bench --port " +
                                 port + " --idle-exit 2 --report node.json 2>/dev/null & }; sleep 0.5;";
    run = run_program(folder,
                      "identify --plant emulator --node 127.0.0.1:" + port +
                          " --experiments experiments.toml --out out --no-figures --format json",
                      emulator);
    if (run.exit_code == 0) break;
  }
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("charge"));
  // The nominal twin cools its air and droops its supply, so the model's coefficients are near its own, not equal.
  const auto result = nlohmann::json::parse(run.out);
  EXPECT_NEAR(value_of(result, "fill_coefficient") / 1.5e-6, 1.0, 0.25);
  EXPECT_NEAR(value_of(result, "supply_pressure_pa") / 251325, 1.0, 0.05);
  EXPECT_NEAR(value_of(result, "energise_delay_s"), 0.004, 0.002);
  EXPECT_TRUE(std::filesystem::exists(folder / "out/records/edges.csv"));
  EXPECT_TRUE(std::filesystem::exists(folder / "out/parameters.toml"));
}

TEST(Identify, FromTheLogOfARunInRealTime) {
  const Folder folder;
  ProgramRun run;
  for (int attempt = 0; attempt < 5; ++attempt) {
    std::filesystem::remove_all(folder / "out");
    run = run_program(folder, "run nine_pd --plant sim --scenario sine --duration 4 --quiet --out out");
    if (run.exit_code == 0) break;
  }
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const ProgramRun found =
      run_program(folder, "identify --log out/sine--nine_pd--s1.mcap --out found --no-figures --format json");
  ASSERT_EQ(found.exit_code, 0) << found.err;
  const auto result = nlohmann::json::parse(found.out);
  EXPECT_NEAR(value_of(result, "fill_coefficient") / 1.5e-6, 1.0, 0.25);
  EXPECT_NEAR(value_of(result, "inferred_equivalent_mass_kg") / 11.0, 1.0, 0.25);
}

TEST(Identify, NothingIsCommandedWithoutANode) {
  const Folder folder;
  const ProgramRun run = run_program(folder, "identify --plant emulator --node 127.0.0.1:9 --out out");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("no answer"));
  EXPECT_FALSE(std::filesystem::exists(folder / "out"));
}

}  // namespace
}  // namespace solenoid
