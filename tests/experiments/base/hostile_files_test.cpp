// Files from anywhere: each of tests/data/hostile, and those too large to be kept, is refused in one line of our own
// words, at little cost. A file joins with one line in hostile_cases().
#include "experiments/base/bytes.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/stat.h>

namespace solenoid::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr double most_cpu_s = 5.0;
constexpr long most_kilobytes = 500'000;

struct HostileFile {
  const char* name;       ///< of the case
  const char* arguments;  ///< of the program, in a folder with all of tests/data/hostile
  std::vector<const char*> said;
  void (*make)(const Folder&) = [](const Folder&) {};  ///< writes what is too large to be kept
};

std::string times(const std::string& text, std::size_t count) {
  std::string all;
  all.reserve(text.size() * count);
  for (std::size_t i = 0; i < count; ++i) all += text;
  return all;
}

/// A campaign whose trajectory, and whatever else, is that.
void write_campaign(const Folder& folder, const std::string& trajectory, const std::string& above = "") {
  folder.write("made.toml", "variants = [\"thesis_pd\"]\n" + above + "[[scenario]]\nname = \"s\"\ntrajectory = { " +
                                trajectory + " }\n");
}

const std::string deep_json = times("[", 200'000) + times("]", 200'000);

/// An MCAP file of chunks in chunks.
std::string nested_chunks(int levels) {
  std::string heads;
  constexpr std::size_t head = 9 + 40;
  for (int level = 0; level < levels; ++level) {
    const std::size_t below = head * static_cast<std::size_t>(levels - 1 - level);
    heads += '\x06';
    append_little_endian(heads, std::uint64_t{40 + below});
    for (const std::uint64_t number : {std::uint64_t{0}, std::uint64_t{0}, std::uint64_t{below}})
      append_little_endian(heads, number);
    append_little_endian(heads, std::uint64_t{0});  // no checksum, no compression
    append_little_endian(heads, std::uint64_t{below});
  }
  return "\x89MCAP0\r\n" + heads;
}

const std::vector<HostileFile>& hostile_cases() {
  static const std::vector<HostileFile> all = {
      {"deadline", "check deadline_1e13.toml", {"deadline_1e13.toml:9", "deadline_ms", "1000000"}},
      {"move", "check hang_move_s_1e308.toml", {"hang_move_s_1e308.toml:", "move_s", "3600"}},
      {"move_compared", "compare hang_move_s_1e308.toml", {"move_s", "3600"}},
      {"sine", "check hang_sine_frequency.toml", {"hang_sine_frequency.toml:4", "frequency_hz", "3600"}},
      {"last_time", "check hang_trajectory_last_time.toml", {"hang_trajectory_last_time.csv:", "3600"}},
      {"long_csv", "check longt.toml", {"longt.csv:", "3600"}},
      {"blocks", "check manyblocks.toml", {"manyblocks.toml:7", "horizon.blocks", "at most 32"}},
      {"periods",
       "check made.toml",
       {"made.toml:4", "periods", "3600"},
       [](const Folder& f) { write_campaign(f, "kind = \"sine\", periods = 2000000000"); }},
      {"long_move",
       "check made.toml",
       {"made.toml:4", "move_s", "3600"},
       [](const Folder& f) { write_campaign(f, "kind = \"cycloidal\", move_s = 1e9"); }},
      {"long_hold",
       "check made.toml",
       {"made.toml:4", "hold_s", "3600"},
       [](const Folder& f) { write_campaign(f, "kind = \"step\", hold_s = 1e12"); }},
      {"sum_of_moves",
       "check made.toml",
       {"made.toml:4", "to_m", "3600"},
       [](const Folder& f) { write_campaign(f, "kind = \"multi_cycloid\", move_s = 3600, to_m = [0.1, 0.0, 0.1]"); }},
      {"seeds",
       "check made.toml",
       {"made.toml:2", "seeds", "10000"},
       [](const Folder& f) {
         std::string seeds;
         for (int seed = 0; seed < 200'000; ++seed) seeds += std::to_string(seed) + ",";
         write_campaign(f, "kind = \"sine\"", "seeds = [" + seeds + "]\n");
       }},
      {"dotted_key",
       "check made.toml",
       {"made.toml"},
       [](const Folder& f) { f.write("made.toml", "a" + times(".a", 200'000) + " = 1\n"); }},
      {"dotted_heading",
       "check made.toml",
       {"made.toml"},
       [](const Folder& f) { f.write("made.toml", "[a" + times(".a", 200'000) + "]\n"); }},
      {"dotted_key_behind_a_fourth_quote",
       "check made.toml",
       {"made.toml:1", "at most 32"},
       [](const Folder& f) {
         f.write("made.toml", "x = { a = \"\"\"b\"\"\"\", c" + times(".c", 200'000) + " = 1 }\n");
       }},
      {"files_in_files",
       "check 0.toml",
       {"32.toml", "key 'include'", "deep"},
       [](const Folder& f) {
         for (int i = 0; i < 40; ++i)
           f.write(std::to_string(i) + ".toml", "include = [\"" + std::to_string(i + 1) + ".toml\"]\n");
       }},
      {"included_together",
       "check made.toml",
       {"3.toml", "key 'include'", "at most 4000000"},
       [](const Folder& f) {
         for (const char* name : {"1.toml", "2.toml", "3.toml"}) f.write(name, times("# comment\n", 150'000));
         f.write("made.toml", "include = [\"1.toml\", \"2.toml\", \"3.toml\"]\n");
       }},
      {"long_key",
       "check made.toml",
       {"made.toml:1", "a key of 1000000 characters", "at most 200"},
       [](const Folder& f) { f.write("made.toml", "[" + times("k", 1'000'000) + "]\na = 1\n"); }},
      {"long_paths",
       "check made.toml",
       {"made.toml:", "too many keys", "allowed"},
       [](const Folder& f) {
         std::string path = "a";
         for (int level = 0; level < 20; ++level) path += "." + times("k", 190);
         std::string text = "[" + path + "]\n";
         for (int key = 0; key < 200'000; ++key) text += "k" + std::to_string(key) + "=1\n";
         f.write("made.toml", text);
       }},
      {"long_name",
       "check made.toml",
       {"made.toml:2", "nnn ... nnn", "names no folder"},
       [](const Folder& f) { f.write("made.toml", "variants = []\nname = \"/" + times("n", 1'000'000) + "\"\n"); }},
      {"nested_lists",
       "check made.toml",
       {"made.toml"},
       [](const Folder& f) { f.write("made.toml", "a = " + times("[", 200'000) + times("]", 200'000)); }},
      {"large_toml",
       "check made.toml",
       {"made.toml", "at most 4 MB"},
       [](const Folder& f) {
         f.write("made.toml", "");
         std::filesystem::resize_file(f.file("made.toml"), 40'000'000'000);
       }},
      {"zeros", "check /dev/zero", {"/dev/zero", "a device", "a regular file"}},
      {"zeros_compared", "compare /dev/zero", {"/dev/zero", "a device"}},
      {"zeros_as_trajectory",
       "check made.toml",
       {"/dev/zero", "a device"},
       [](const Folder& f) { write_campaign(f, "kind = \"csv\", path = \"/dev/zero\""); }},
      {"zeros_as_instances", "profile --instances /dev/zero", {"/dev/zero", "a device"}},
      {"zeros_as_profile", "profile --against /dev/zero", {"/dev/zero", "a device"}},
      {"zeros_as_task", "size /dev/zero", {"/dev/zero", "a device"}},
      {"pipe",
       "check made.toml",
       {"made.toml", "a pipe"},
       [](const Folder& f) { ::mkfifo(f.file("made.toml").c_str(), 0600); }},
      {"pipe_as_instances",
       "profile --instances pipe",
       {"pipe", "a pipe"},
       [](const Folder& f) { ::mkfifo(f.file("pipe").c_str(), 0600); }},
      {"deep_profile",
       "profile --against deep.json",
       {"deep.json", "64"},
       [](const Folder& f) { f.write("deep.json", deep_json); }},
      {"deep_manifest",
       "report .",
       {"manifest.json", "64"},
       [](const Folder& f) { f.write("manifest.json", deep_json); }},
      {"deep_manifest_of_objects",
       "report .",
       {"manifest.json", "64"},
       [](const Folder& f) { f.write("manifest.json", times("{\"a\":", 200'000)); }},
      {"no_json",
       "report .",
       {"manifest.json:2", "column"},
       [](const Folder& f) { f.write("manifest.json", "{\n  oops"); }},
      {"many_values",
       "profile --against made.json",
       {"made.json", "values"},
       [](const Folder& f) { f.write("made.json", "[" + times("0,", 20'000'000) + "0]"); }},
      {"negative_pattern",
       "replay coils_minus_1.mcap",
       {"coils_minus_1.mcap: tick 248 ", "key 'coils': -1", "0 to 4294967295"}},
      {"negative_pattern_profiled", "profile coils_minus_1.mcap", {"coils_minus_1.mcap: tick 248 ", "key 'coils': -1"}},
      {"tick_of_no_json", "export tick_json_no_file_name.mcap", {"tick_json_no_file_name.mcap: tick 253 ", "no JSON"}},
      {"time_replayed", "replay time_huge.mcap", {"time_huge.mcap: tick 248 ", "key 'time_s'", "0 to 100000"}},
      {"time_profiled", "profile time_huge.mcap", {"time_huge.mcap: tick 248 ", "key 'time_s'"}},
      {"chunks_in_chunks",
       "export made.mcap",
       {"made.mcap: byte 0 of the chunk at byte 8: a chunk in a chunk"},
       [](const Folder& f) { f.write("made.mcap", nested_chunks(40'000)); }},
      {"zeros_as_log", "export /dev/zero", {"/dev/zero", "a device"}},
      {"zeros_identified", "identify --log /dev/zero", {"/dev/zero", "a device"}},
      {"pipe_as_csv",
       "identify --log pipe.csv",
       {"pipe.csv", "a pipe"},
       [](const Folder& f) { ::mkfifo(f.file("pipe.csv").c_str(), 0600); }},
      {"open_quote",
       "identify --log made.csv",
       {"made.csv", "quote"},
       [](const Folder& f) {
         f.write("made.csv",
                 "time_s,position_m,pressure_a_pa,pressure_b_pa,motor_n,coils\n\"" + times("x\n", 50'000'000));
       }},
      {"one_line",
       "identify --log made.csv",
       {"made.csv", "no column 'time_s'"},
       [](const Folder& f) { f.write("made.csv", times("x,", 50'000'000)); }},
  };
  return all;
}

struct Cost {
  ProgramRun run;
  double cpu_s = 0.0;
  long kilobytes = 0;
};

/// Runs the program through a shell, and what it cost.
Cost cost_of(const Folder& folder, const std::string& arguments) {
  const pid_t child = ::fork();
  if (child == 0) {
    const rlimit cpu{60, 60};  // what never ends does
    ::setrlimit(RLIMIT_CPU, &cpu);
    const std::string command =
        "cd '" + folder.path() + "' && exec '" SOLENOID_PROGRAM "' " + arguments + " >.out 2>.err </dev/null";
    ::execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    ::_exit(127);
  }
  int status = 0;
  rusage used{};
  ::wait4(child, &status, 0, &used);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return {{WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status), text_of(folder.file(".out")),
           text_of(folder.file(".err"))},
          seconds(used.ru_utime) + seconds(used.ru_stime),
          used.ru_maxrss};
}

void copy_hostile_files(const Folder& folder) {
  for (const auto& entry : std::filesystem::directory_iterator(SOLENOID_SOURCE_DIR "/tests/data/hostile"))
    std::filesystem::copy(entry.path(), folder / entry.path().filename().string());
}

class HostileFileTest : public testing::TestWithParam<HostileFile> {};

TEST_P(HostileFileTest, IsRefusedInOneLineAtLittleCost) {
  const Folder folder;
  copy_hostile_files(folder);
  GetParam().make(folder);
  const Cost cost = cost_of(folder, GetParam().arguments);
  const std::string& said = cost.run.err;
  EXPECT_EQ(cost.run.exit_code, 2) << said;
  EXPECT_EQ(cost.run.out, "");
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
  EXPECT_THAT(said, testing::StartsWith("solenoid: "));
  EXPECT_THAT(said, HasSubstr("(allowed: "));
  EXPECT_LT(said.size(), 2000u);
  for (const char* foreign : {"json.exception", "bad_alloc", "stod", "std::"})
    EXPECT_THAT(said, Not(HasSubstr(foreign)));
  for (const char* words : GetParam().said) EXPECT_THAT(said, HasSubstr(words));
  RecordProperty("cpu_ms", static_cast<int>(1e3 * cost.cpu_s));
  RecordProperty("kilobytes", static_cast<int>(cost.kilobytes));
  if (sanitized) return;
  EXPECT_LT(cost.cpu_s, most_cpu_s);
  EXPECT_LT(cost.kilobytes, most_kilobytes);
}

INSTANTIATE_TEST_SUITE_P(All, HostileFileTest, testing::ValuesIn(hostile_cases()),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(HostileFiles, EachIsTried) {
  for (const auto& entry : std::filesystem::directory_iterator(SOLENOID_SOURCE_DIR "/tests/data/hostile")) {
    const std::string stem = entry.path().stem().string();  // a CSV goes with the TOML of its name
    EXPECT_TRUE(std::ranges::any_of(hostile_cases(), [&](const HostileFile& h) {
      return std::string(h.arguments).find(stem) != std::string::npos;
    })) << entry.path();
  }
}

}  // namespace
}  // namespace solenoid::test
