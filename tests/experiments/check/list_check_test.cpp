#include "experiments/check/checks.hpp"
#include "experiments/rig/plants.hpp"
#include "experiments/rig/udp_io.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <map>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

TEST(List, VariantsAsJson) {
  Folder folder;
  const ProgramRun ended = run_program(folder, "list variants --format json");
  ASSERT_EQ(ended.exit_code, 0);
  EXPECT_EQ(ended.err, "");
  const json all = json::parse(ended.out);
  ASSERT_EQ(all.size(), 1u);
  bool seen = false;
  for (const json& variant : all.at("variants")) {
    EXPECT_EQ(variant.size(), 6u);
    for (const char* key : {"name", "system", "modes", "solver", "estimator", "summary"})
      EXPECT_FALSE(variant.at(key).get<std::string>().empty()) << variant;
    if (variant.at("name") == "thesis_pd") {
      seen = true;
      EXPECT_EQ(variant.at("system"), "actuator");
      EXPECT_EQ(variant.at("modes"), "three_way");
    }
  }
  EXPECT_TRUE(seen);
}

TEST(List, EverySectionAsTableAndJson) {
  Folder folder;
  const json all = json::parse(run_program(folder, "list --format json").out);
  for (const char* section : {"systems", "variants", "scenarios", "solvers", "laws", "estimators", "keys", "parameters",
                              "modes", "trajectories", "wires"}) {
    EXPECT_FALSE(all.at(section).empty()) << section;
    const ProgramRun table = run_program(folder, std::string("list ") + section);
    EXPECT_EQ(table.exit_code, 0);
    EXPECT_GT(split(table.out, '\n').size(), all.at(section).size()) << "a heading and a line each";
  }
  EXPECT_EQ(all.at("modes")[1].at("modes"), 9);
  int of_the_rig = 0;
  for (const json& wire : all.at("wires"))
    if (wire.at("system") == "actuator" && wire.at("modes") == "two_way") {
      ++of_the_rig;
      EXPECT_EQ(wire.at("switches"), 4);
      VariantConfig variant = new_variant();
      variant.modes = "two_way";
      EXPECT_EQ(wire.at("wire"), node_wire(variant).text);
    }
  EXPECT_EQ(of_the_rig, 1);
}

TEST(List, TheDocumentationsTablesAreWhatIsListed) {
  Folder folder;
  const std::string page = text_of(SOLENOID_SOURCE_DIR "/docs/reference/configuration.md");
  for (const char* section : {"keys", "solvers", "laws", "estimators"}) {
    const ProgramRun listed = run_program(folder, std::string("list --format markdown ") + section);
    EXPECT_EQ(listed.exit_code, 0);
    EXPECT_THAT(page, HasSubstr(listed.out)) << "docs/reference/configuration.md: ./solenoid list " << section;
  }
}

TEST(Check, ModelAgreesWithTheThesis) {
  for (const Check& check : check_model()) EXPECT_EQ(check.result, "ok") << check.name << ": " << check.detail;
}

TEST(Check, ReportsInstallationMachineAndFiles) {
  Folder folder;
  folder.write("c.toml", small_campaign);
  const ProgramRun ended = run_program(folder, "check c.toml default --format json");
  EXPECT_EQ(ended.exit_code, 0) << ended.out << ended.err;
  std::vector<std::string> names;
  const json report = json::parse(ended.out);
  for (const json& check : report.at("checks")) names.push_back(check.at("name"));
  for (const char* name : {"c.toml", "default", "Eigen", "gnuplot", "Ipopt", "cores", "SCHED_FIFO 80", "mlockall"})
    EXPECT_THAT(names, testing::Contains(name));
}

TEST(Check, MissingPartsAreNamedWithTheirPackage) {
  Folder folder;
  const ProgramRun ended = run_program(folder, "check", "PATH=/nonexistent");
  EXPECT_EQ(ended.exit_code, 0) << "optional parts may be missing";
  EXPECT_THAT(ended.out, HasSubstr("apt-get install gnuplot-nox"));
  EXPECT_THAT(ended.out, testing::Not(HasSubstr("apt-get install libnlopt-dev"))) << "it is linked";
}

TEST(Check, LooksAtAPlantWithSafeOutputs) {
  Folder folder;
  const ProgramRun ended = run_program(folder, "check --plant sim --format json");
  EXPECT_EQ(ended.exit_code, 0) << ended.out << ended.err;
  std::map<std::string, std::string> found;
  const json report = json::parse(ended.out);
  for (const json& check : report.at("checks"))
    if (check.at("group") == "plant") found[check.at("name")] = check.at("detail");
  EXPECT_THAT(found.at("I/O latency"), HasSubstr("0 of 100 missed"));
  EXPECT_THAT(found.at("sensors"), HasSubstr("plausible"));
  EXPECT_THAT(found.at("position"), HasSubstr("19.70 mm"));
  const ProgramRun none = run_program(folder, "check --plant emulator --node 127.0.0.1:9");
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("no answer"));
  folder.write("rig.toml", "[limits]\nlongest_gap_ms = 0\n");
  EXPECT_THAT(run_program(folder, "check --plant sim --rig rig.toml").err, HasSubstr("longest_gap_ms"));
}

TEST(Check, LooksAtEveryFileBeforeItRefuses) {
  Folder folder;
  folder.write("a.toml", "x = 1\n");
  folder.write("b.toml", "y = 1\n");
  const ProgramRun ended = run_program(folder, "check a.toml b.toml");
  EXPECT_EQ(ended.exit_code, 2);
  EXPECT_EQ(ended.out, "");
  EXPECT_THAT(ended.err, HasSubstr("a.toml:1"));
  EXPECT_THAT(ended.err, HasSubstr("b.toml:1"));
}

TEST(Program, WithoutArgumentsPrintsHelp) {
  Folder folder;
  const ProgramRun ended = run_program(folder, "");
  EXPECT_EQ(ended.exit_code, 0);
  EXPECT_THAT(ended.out, HasSubstr("compare"));
}

}  // namespace
}  // namespace solenoid::test
