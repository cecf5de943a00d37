#include "experiments/profile/record.hpp"

#include "controllers/systems/actuator/actuator_variant.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <filesystem>

#include <gmock/gmock.h>

namespace solenoid {
namespace {

using testing::HasSubstr;

/// A text is a text, whatever it ends with and whatever lies beside the campaign.
TEST(Recording, OnlyWhatNamesAFileTakesItsContent) {
  const test::Folder folder;
  folder.write("own.toml", "block_mass_kg = 1.3\n");
  for (const std::string summary : {"made with foo.toml", "own.toml"}) {
    const InstanceSet set = record_instances(read_campaign(folder.write("c.toml", R"(
variants = ["own"]
[variant.own]
summary = ")" + summary + R"("
model = "own.toml"
valves = "two_way"
solver = "branch_and_bound"
[[scenario]]
name = "quick"
trajectory = { kind = "cycloidal", move_s = 0.2, dwell_s = 0.1 }
)")),
                                             10);
    const VariantInstances again = parse_instances(instance_bytes(set), "again").variants.front();
    EXPECT_TRUE(again.config.summary.ends_with(".toml")) << "a campaign that carries the file names it in its own way";
    EXPECT_EQ(actuator(again.config).nominal.block_mass_kg, 1.3);
  }
}

TEST(Recording, AFileIsNotWrittenOfAVariantWhoseNetworkIsAFile) {
  const test::Folder folder;
  folder.write("mine.toml",
               test::text_of(SOLENOID_SOURCE_DIR "/experiments/systems/actuator/data/networks/nine_policy.toml"));
  folder.write("c.toml", R"(
variants = ["own"]
[variant.own]
valves = "two_way"
motor = "in_prediction"
solver = "policy"
learned = { network = "mine.toml" }
horizon = { steps = 40, blocks = [1, 1, 2, 4] }
[[scenario]]
name = "quick"
trajectory = { kind = "cycloidal", move_s = 0.2, dwell_s = 0.1 }
)");
  const std::string refused = test::refusal_of(folder, "profile c.toml --per-variant 5 --record b.sol");
  EXPECT_THAT(refused, HasSubstr("--record: variant 'own' has learned.network = "));
  EXPECT_FALSE(std::filesystem::exists(folder / "b.sol"));
  const test::ProgramRun replayed = test::run_program(folder, "profile c.toml --per-variant 5 --passes 1");
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err;  // in memory it is there
}

}  // namespace
}  // namespace solenoid
