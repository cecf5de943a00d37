#include "tests/experiments/program_under_test.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace solenoid::test {
namespace {

struct BadInput {
  const char* name;
  const char* variant;   ///< lines of [variant.mine]
  const char* scenario;  ///< lines of the [[scenario]]
  const char* rest;      ///< lines above them; the campaign's own keys
  std::vector<const char*> said;
};

constexpr const char* lists = "variants = [\"mine\"]\n";
constexpr const char* sine = "name = \"s\"\ntrajectory = { kind = \"sine\" }\n";

const std::vector<BadInput>& cases() {
  static const std::vector<BadInput> all = {
      {"unknown_key_of_a_variant",
       "horizont = 3\n",
       sine,
       lists,
       {"c.toml:3", "variant.mine.horizont", "not known", "horizon"}},
      {"unknown_key_of_a_scenario",
       "",
       "name = \"s\"\npaylod_kg = 1\ntrajectory = { kind = \"sine\" }\n",
       lists,
       {"c.toml:5", "paylod_kg", "payload_kg"}},
      {"unknown_key_of_the_campaign", "", sine, "variants = [\"mine\"]\nseed = 3\n", {"c.toml:2", "seed", "seeds"}},
      {"wrong_type", "valves = 3\n", sine, lists, {"c.toml:3", "variant.mine.valves", "wrong type", "three_way"}},
      {"wrong_type_of_a_number",
       "",
       "name = \"s\"\npayload_kg = \"heavy\"\ntrajectory = { kind = \"sine\" }\n",
       lists,
       {"c.toml:5", "payload_kg", "wrong type"}},
      {"unknown_value", "solver = \"magic\"\n", sine, lists, {"c.toml:3", "'magic'", "exhaustive"}},
      {"joint_motor_that_nothing_chooses", "motor = \"joint\"\n", sine, lists, {"c.toml:3", "joint", "cia"}},
      {"negative_mass", "model = { block_mass_kg = -1 }\n", sine, lists, {"c.toml:3", "block_mass_kg", "> 0"}},
      {"negative_payload",
       "",
       "name = \"s\"\npayload_kg = -0.3\ntrajectory = { kind = \"sine\" }\n",
       lists,
       {"c.toml:5", "payload_kg", "from 0"}},
      {"no_steps", "horizon = { steps = 0 }\n", sine, lists, {"c.toml:3", "horizon.steps", "from 1"}},
      {"period_of_no_whole_ticks",
       "timing = { tick_ms = 1.0, period_ms = 2.5 }\n",
       sine,
       lists,
       {"c.toml:3", "timing", "2.5 ms", "whole multiples of the tick"}},
      {"period_of_no_whole_ticks_in_a_scenario",
       "",
       "name = \"s\"\ntiming = { period_ms = 0.5 }\ntrajectory = { kind = \"sine\" }\n",
       lists,
       {"c.toml:5", "timing", "0.5 ms", "whole multiples of the tick"}},
      {"unknown_key_of_timing",
       "",
       "name = \"s\"\ntiming = { period = 5 }\ntrajectory = { kind = \"sine\" }\n",
       lists,
       {"c.toml:5", "timing.period", "period_ms, tick_ms"}},
      {"blocks_that_do_not_fit_the_scenarios_period",
       "horizon = { steps = 100, blocks = [5, 15] }\n",
       "name = \"s\"\ntiming = { period_ms = 10 }\ntrajectory = { kind = \"sine\" }\n",
       lists,
       {"c.toml:6", "timing", "'mine'", "steps / 10"}},
      {"latency_beyond_the_period",
       "timing = { period_ms = 3 }\nlatency_ticks = 4\n",
       sine,
       lists,
       {"c.toml:4", "latency_ticks", "0 to 3"}},
      {"tick_between_the_twins_samples",
       "",
       "name = \"s\"\nplant = \"twin\"\ntiming = { tick_ms = 0.25, period_ms = 5 }\ntrajectory = { kind = \"sine\" }\n",
       lists,
       {"c.toml:6", "timing", "0.25 ms", "multiples of 0.1 ms"}},
      {"no_equilibrium",
       "model = { block_mass_kg = 5 }\n",
       sine,
       lists,
       {"c.toml:", "payload_kg", "no equilibrium", "mine"}},
      {"missing_trajectory_file",
       "",
       "name = \"s\"\ntrajectory = { kind = \"csv\", path = \"none.csv\" }\n",
       lists,
       {"none.csv", "cannot be read"}},
      {"malformed_trajectory_file",
       "",
       "name = \"s\"\ntrajectory = { kind = \"csv\", path = \"bad.csv\" }\n",
       lists,
       {"bad.csv:3", "time_s,position_m"}},
      {"trajectory_beyond_the_stroke",
       "",
       "name = \"s\"\ntrajectory = { kind = \"step\", height_m = 0.2 }\n",
       lists,
       {"c.toml:5", "stroke"}},
      {"not_toml", "", sine, "variants = [\"mine\"\n", {"c.toml:", "not valid TOML"}},
      {"unknown_variant", "", sine, "variants = [\"yours\"]\n", {"c.toml:1", "'yours'", "mine", "thesis_pd"}},
      {"variant_twice", "", sine, "variants = [\"mine\", \"mine\"]\n", {"c.toml:1", "mine", "twice"}},
      {"scenario_twice",
       "",
       "name = \"s\"\ntrajectory = { kind = \"sine\" }\n[[scenario]]\nname = \"s\"\ntrajectory = { kind = \"sine\" }\n",
       lists,
       {"c.toml:7", "'s'", "twice"}},
      {"seed_twice", "", sine, "variants = [\"mine\"]\nseeds = [1, 1]\n", {"c.toml:2", "seeds", "twice"}},
      {"no_seed", "", sine, "variants = [\"mine\"]\nseeds = []\n", {"c.toml:2", "seeds", "at least one"}},
      {"no_variant", "", sine, "variants = []\n", {"c.toml:1", "variants", "empty"}},
      {"bad_scenario_name",
       "",
       "name = \"a/b\"\ntrajectory = { kind = \"sine\" }\n",
       lists,
       {"c.toml:4", "'a/b'", "letters"}},
      {"name_with_a_slash", "", sine, "name = \"a/b\"\nvariants = [\"mine\"]\n", {"c.toml:1", "'a/b'", "without /"}},
      {"missing_include",
       "",
       sine,
       "include = [\"none.toml\"]\nvariants = [\"mine\"]\n",
       {"none.toml", "cannot be read"}},
      {"include_of_itself", "", sine, "include = [\"c.toml\"]\nvariants = [\"mine\"]\n", {"c.toml", "includes itself"}},
  };
  return all;
}

void expect_refused(const ProgramRun& ended, const std::vector<const char*>& said) {
  EXPECT_EQ(ended.exit_code, 2) << ended.err;
  EXPECT_EQ(ended.out, "");
  for (const char* text : said) EXPECT_THAT(ended.err, testing::HasSubstr(text));
  EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
  EXPECT_THAT(ended.err, testing::Not(testing::HasSubstr("terminate")));
}

class BadCampaign : public testing::TestWithParam<BadInput> {};

TEST_P(BadCampaign, IsOneLineWithFileLineKeyAndWhatIsAllowed) {
  const BadInput& bad = GetParam();
  Folder folder;
  folder.write("bad.csv", "time_s,position_m\n0,0.02\n0.1,abc\n");
  std::string text = bad.rest;
  text += std::string("[variant.mine]\n") + bad.variant + "[[scenario]]\n" + bad.scenario;
  folder.write("c.toml", text);
  for (const char* command : {"compare c.toml --out o --format json", "check c.toml"})
    expect_refused(run_program(folder, command), bad.said);
  EXPECT_FALSE(std::filesystem::exists(folder.file("o"))) << "refused before anything is written";
}

INSTANTIATE_TEST_SUITE_P(All, BadCampaign, testing::ValuesIn(cases()),
                         [](const auto& info) { return std::string(info.param.name); });

struct BadCommand {
  const char* name;
  const char* arguments;
  std::vector<const char*> said;
};

class BadCommandLine : public testing::TestWithParam<BadCommand> {};

TEST_P(BadCommandLine, IsRefused) {
  Folder folder;
  folder.write("c.toml", small_campaign);
  folder.write("no_scenario.toml", "variants = [\"thesis_pd\"]\n");
  folder.write("a_file", "");
  expect_refused(run_program(folder, GetParam().arguments), GetParam().said);
}

INSTANTIATE_TEST_SUITE_P(
    All, BadCommandLine,
    testing::Values(BadCommand{"missing_file", "compare none.toml", {"none.toml", "cannot be read"}},
                    BadCommand{"below_a_file", "compare a_file/c.toml", {"a_file/c.toml", "cannot be read"}},
                    BadCommand{"a_folder_as_file", "compare .", {"cannot be read"}},
                    BadCommand{"no_scenario", "compare no_scenario.toml", {"no_scenario.toml", "[[scenario]]"}},
                    BadCommand{
                        "unknown_variant", "compare c.toml --variant yours", {"--variant", "'yours'", "thesis_pd"}},
                    BadCommand{"unknown_scenario", "compare c.toml --scenario s", {"--scenario", "'s'", "loaded"}},
                    BadCommand{"unknown_format", "compare c.toml --format xml", {"--format", "json"}},
                    BadCommand{"no_jobs", "compare c.toml --jobs 0", {"--jobs"}},
                    BadCommand{"unknown_option", "compare c.toml --fast", {"--fast"}},
                    BadCommand{"unknown_command", "compere", {"compere"}},
                    BadCommand{"unknown_list", "list things", {"things", "variants"}},
                    BadCommand{"unwritable_folder", "compare c.toml --out /proc/solenoid", {"/proc/solenoid"}},
                    BadCommand{"a_file_as_folder", "compare c.toml --out a_file", {"a_file"}}),
    [](const auto& info) { return std::string(info.param.name); });

/// Every kind of numeric option of every command: what is no number is refused before its range is looked at.
TEST(BadNumber, IsRefusedByEveryNumericOption) {
  const Folder folder;
  folder.write("c.toml", small_campaign);
  struct Option {
    const char *command, *option;
    bool whole, negative;
  };
  const std::vector<Option> options = {
      {"compare c.toml", "--jobs", true, true},
      {"plot c.toml --variant nine_pd --scenario loaded --svg a.svg", "--seed", true, false},
      {"profile", "--threshold", false, true},
      {"profile", "--limit-ms", false, true},
      {"profile", "--budget", false, true},
      {"profile", "--core", true, true},
      {"profile", "--passes", true, true},
      {"profile", "--per-variant", true, false},
      {"ledger", "--bonmin-limit-s", false, true},
      {"ledger", "--states", true, true},
      {"scaling", "--instances", true, true},
      {"certify thesis_pd", "--states", true, false},
      {"certify thesis_pd", "--deadline-ms", false, true},
      {"tune nine_pd", "--evaluations", true, true},
      {"run nine_pd", "--duration", false, true},
      {"run nine_pd", "--rearm-wait", false, true},
      {"run nine_pd", "--lowering", false, true},
      {"run nine_pd", "--seed", true, false},
      {"run nine_pd", "--repeat", true, true},
      {"run nine_pd", "--udp", true, true},
      {"emulator", "--idle-exit", false, true},
      {"emulator", "--port", true, true},
      {"emulator", "--seed", true, false},
      {"identify", "--payload", false, true},
      {"identify", "--seed", true, false}};
  for (const Option& o : options) {
    std::vector<std::string> bad = {"nan", "NaN", "-nan", "inf", "-inf", "1e999", "1x", "0x", "\"1 \"", "\"\"", "+1"};
    if (o.whole) bad.insert(bad.end(), {"1.5", "18446744073709551616", "99999999999999999999999"});
    if (!o.negative) bad.push_back("-1");
    for (const std::string& value : bad) {
      const std::string arguments = fmt::format("{} {}={}", o.command, o.option, value);
      const ProgramRun run = run_program(folder, arguments);
      EXPECT_EQ(run.exit_code, 2) << arguments;
      EXPECT_EQ(run.out, "") << arguments;
      EXPECT_THAT(run.err, testing::HasSubstr(o.option)) << arguments;
    }
  }
}

TEST(EmptyValue, IsNotTakenForOneThatIsLeftOut) {
  const Folder folder;
  folder.write("c.toml", small_campaign);
  for (const char* arguments :
       {"compare ''", "compare c.toml --out ''", "size ''", "profile --instances ''", "profile --against ''",
        "list --html ''", "run nine_pd --rig ''", "tune nine_pd --free ''", "check c.toml ''"}) {
    const ProgramRun run = run_program(folder, arguments);
    EXPECT_EQ(run.exit_code, 2) << arguments;
    EXPECT_EQ(run.out, "") << arguments;
    EXPECT_THAT(run.err, testing::HasSubstr("'' is refused (allowed: what is not empty)")) << arguments;
  }
}

TEST(LineEnd, OnTheCommandLineEndsNoLineOfItsError) {
  const Folder folder;
  folder.write("c.toml", small_campaign);
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"a\nb"},
                                                    {"compare", "--bo\ngus"},
                                                    {"compare", "c.toml", "--jobs", "1\n2"},
                                                    {"compare", "a\nb.toml"},
                                                    {"list", "a\nb"},
                                                    {"list", "--html", "/proc/a\nb"}}) {
    const ProgramRun run = run_program(arguments);
    EXPECT_EQ(run.exit_code, 2) << run.err;
    EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
    EXPECT_THAT(run.err, testing::HasSubstr("\\x0a"));
  }
}

TEST(BadNumber, AZeroInFrontDoesNotMakeANumberOctal) {
  const Folder folder;
  folder.write("c.toml", small_campaign);
  EXPECT_EQ(run_program(folder, "compare c.toml --out o --jobs 010").exit_code, 0);
  EXPECT_THAT(text_of(folder.file("o/manifest.json")), testing::HasSubstr("\"jobs\": 10"));
}

}  // namespace
}  // namespace solenoid::test
