#include "experiments/campaign/run_file.hpp"
#include "tests/experiments/needs_uplot.hpp"
#include "tests/experiments/report/small_results.hpp"

#include <limits>

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace solenoid {
namespace {

using nlohmann::ordered_json;
using test::copy_results;
using test::data_of;
using test::older_results;
using testing::HasSubstr;

TEST(Report, BadFoldersAreRefusedByName) {
  const test::Folder folder;
  const auto refused = [&](const std::string& arguments, const std::string& named) {
    const std::string told = test::refusal_of(folder, "report " + arguments);
    EXPECT_THAT(told, HasSubstr(named));
    EXPECT_THAT(told, HasSubstr("allowed"));
  };
  const auto fresh = [&] {
    std::filesystem::remove_all(folder.file("r"));
    std::filesystem::copy(older_results().file("results"), folder.file("r"), std::filesystem::copy_options::recursive);
  };
  refused("nowhere", "nowhere: no folder");
  folder.write("file", "x");
  refused("file", "file: no folder");
  std::filesystem::create_directory(folder.file("empty"));
  refused("empty --figure pareto --svg a.svg", "empty/manifest.json: cannot be read");
  fresh();
  folder.write("r/manifest.json", "{ nonsense");
  refused("r --svg a.svg", "r/manifest.json");
  folder.write("r/manifest.json", "[]");
  refused("r --svg a.svg", "r/manifest.json: key 'campaign'");
  fresh();
  std::filesystem::remove(folder.file("r/resolved.toml"));
  refused("r --svg a.svg", "r/resolved.toml: is missing");
  fresh();
  folder.write("r/runs/step--nine_pd--s3.json", "{\"run\": {\"variant\": 3}}");
  refused("r --figure step--nine_pd--s3 --svg a.svg", "r/runs/step--nine_pd--s3.json");
  fresh();
  folder.write("r/runs/step--nine_pd--s3.trace", "SLT2 and then rubbish");
  refused("r --figure step--nine_pd--s3 --svg a.svg", "r/runs/step--nine_pd--s3.trace: is damaged");
  fresh();
  refused("r --figure nothing --svg a.svg", "no run 'nothing'");
  refused("r --figure pareto", "--figure: nothing to draw it into");
}

TEST(Report, DamagedRunsAreLeftOutNamedAndShownAsMissing) {
  NEEDS_UPLOT();
  const test::Folder folder;
  const auto fresh = [&] {
    std::filesystem::remove_all(folder.file("r"));
    std::filesystem::copy(older_results().file("results"), folder.file("r"), std::filesystem::copy_options::recursive);
  };
  const auto left_out = [&](const std::string& file) {
    const test::ProgramRun report = test::run_program(folder, "report r");
    EXPECT_EQ(report.exit_code, 1) << file;
    EXPECT_EQ(report.out, "r/report.html\n");
    EXPECT_THAT(report.err, HasSubstr("solenoid: left out: r/runs/" + file));
    const ordered_json data = data_of(test::text_of(folder / "r/report.html"));
    ASSERT_EQ(data.at("left_out").size(), 1u);
    EXPECT_EQ(data["left_out"][0].at("id"), "step--nine_pd--s3");
    for (const auto& run : data.at("runs")) EXPECT_NE(run.at("id"), "step--nine_pd--s3");
    EXPECT_FALSE(data.at("runs").empty());
  };
  fresh();
  folder.write("r/runs/step--nine_pd--s3.json", std::string(200'000, '['));
  left_out("step--nine_pd--s3.json");
  fresh();
  folder.write("r/runs/step--nine_pd--s3.json", "{}");
  left_out("step--nine_pd--s3.json");
  fresh();
  folder.write("r/runs/step--nine_pd--s3.trace", "");
  left_out("step--nine_pd--s3.trace");
  fresh();
  std::filesystem::remove(folder.file("r/runs/step--nine_pd--s3.trace"));
  left_out("step--nine_pd--s3.trace");
  fresh();  // with checksums that are right
  const RunFile kept = read_run_file(folder.file("r/runs/step--nine_pd--s3.json")).value();
  folder.write("r/runs/step--nine_pd--s3.trace", "SLT2 and then rubbish");
  folder.write("r/runs/step--nine_pd--s3.json",
               test::older_run_text(kept.configuration, kept.record, "SLT2 and then rubbish"));
  left_out("step--nine_pd--s3.trace: a trace's");
}

TEST(Report, ACopiedRunIsNotCountedTwice) {
  NEEDS_UPLOT();
  const test::Folder folder;
  copy_results(folder, older_results());
  for (const char* kind : {"json", "trace"})
    std::filesystem::copy(folder.file(fmt::format("r/runs/step--nine_pd--s3.{}", kind)),
                          folder.file(fmt::format("r/runs/copy.{}", kind)));
  const test::ProgramRun report = test::run_program(folder, "report r");
  EXPECT_EQ(report.exit_code, 1);
  EXPECT_EQ(report.err,
            "solenoid: left out: r/runs/copy.json: is of the run 'step--nine_pd--s3' (allowed: a file named as its "
            "run)\n");
  const ordered_json data = data_of(test::text_of(folder / "r/report.html"));
  EXPECT_EQ(data.at("runs").size(), 8u);
  for (const ordered_json& variant : data["rankings"][0]["variants"]) EXPECT_EQ(variant.at("runs"), 4);
  ASSERT_EQ(data.at("left_out").size(), 1u);
  EXPECT_EQ(data["left_out"][0].at("id"), "copy");
}

TEST(Report, AFolderThatTheVersionBeforeWroteIsRead) {
  const std::string folder = SOLENOID_SOURCE_DIR "/tests/data/older_results";
  Results results = read_results(folder);
  EXPECT_TRUE(results.left_out.empty());
  ASSERT_EQ(results.runs.size(), 2u);
  for (const StoredRun& run : results.runs) {
    const ordered_json file = ordered_json::parse(test::text_of(folder + "/runs/" + run.id + ".json"));
    EXPECT_EQ(to_json(run.record), file.at("run"));
    EXPECT_EQ(encode_trace(read_trace(results, run).value()), test::text_of(folder + "/runs/" + run.id + ".trace"));
  }
  const test::Folder here;
  EXPECT_THAT(test::refusal_of(here, "merge '" + folder + "'"),
              HasSubstr("there is nothing to merge, a version before wrote it"));
  EXPECT_THAT(test::refusal_of(here, "status '" + folder + "'"), HasSubstr("a version before wrote it, a file a run"));
}

TEST(Report, AManifestOfWrongTypesIsRefusedByItsKey) {
  const test::Folder folder;
  copy_results(folder);
  const auto refused = [&](const std::string& key, const std::string& value) {
    const std::string others = key == "campaign" ? "" : R"("campaign": "c", )";
    folder.write("r/manifest.json", "{" + others + "\"" + key + "\": " + value + "}");
    const std::string told = test::refusal_of(folder, "report r --svg a.svg");
    EXPECT_THAT(told, testing::StartsWith("solenoid: r/manifest.json: key '" + key + "'")) << value;
    EXPECT_THAT(told, HasSubstr("(allowed: ")) << value;
  };
  for (const char* key : {"campaign", "status", "started", "ended"})
    for (const char* value : {"3", "null", "[]"}) refused(key, value);
  for (const char* value : {"3", R"("1")", "null", R"({"a": 1})", "[1.5]", "[-1]", R"([3, "4"])"})
    refused("seeds", value);
  folder.write("r/manifest.json", R"({"campaign": "c", "seeds": [3, 4]})");
  EXPECT_EQ(test::run_program(folder, "report r --svg a.svg").exit_code, 0);
}

TEST(Report, ARunsFileOfWrongTypesIsToldInItsOwnWords) {
  NEEDS_UPLOT();
  const test::Folder folder;
  copy_results(folder, older_results());
  const ordered_json whole = ordered_json::parse(test::text_of(folder / "r/runs/step--nine_pd--s3.json"));
  const auto told = [&](const std::string& key, const ordered_json& value) {
    ordered_json changed = whole;
    changed[ordered_json::json_pointer(key)] = value;
    folder.write("r/runs/step--nine_pd--s3.json", changed.dump());
    return test::run_program(folder, "report r").err;
  };
  for (const ordered_json& value : {ordered_json(3), ordered_json::array(), ordered_json::object()})
    EXPECT_THAT(
        told("/checksums", value),
        testing::StartsWith("solenoid: left out: r/runs/step--nine_pd--s3.json: key 'checksums.run' is missing"));
  EXPECT_THAT(told("/checksums/run", 3), HasSubstr("key 'checksums.run' is no text"));
  EXPECT_THAT(told("/checksums/trace", nullptr), HasSubstr("key 'checksums.trace' is no text"));
  EXPECT_THAT(told("/configuration", 3), HasSubstr("key 'configuration' is no text"));
  EXPECT_THAT(told("/run", 3), HasSubstr("key 'run.variant'"));
}

TEST(Report, ATraceWithoutItsChecksumIsNotBelieved) {
  NEEDS_UPLOT();
  const test::Folder folder;
  copy_results(folder, older_results());
  ordered_json record = ordered_json::parse(test::text_of(folder / "r/runs/step--nine_pd--s3.json"));
  record.at("checksums").erase("trace");
  folder.write("r/runs/step--nine_pd--s3.json", record.dump());
  EXPECT_THAT(test::run_program(folder, "report r").err,
              HasSubstr("left out: r/runs/step--nine_pd--s3.trace: has no checksum"));
}

TEST(Report, ATraceThatCannotBeDrawnIsRefusedByName) {
  const test::Folder folder;
  copy_results(folder, older_results());
  const std::string id = "step--nine_pd--s3";
  const RunFile kept = read_run_file(folder.file("r/runs/" + id + ".json")).value();
  const Trace whole = decode_trace(test::text_of(folder / ("r/runs/" + id + ".trace")));
  const auto refused = [&](const std::string& figure, const Trace& trace, const std::string& words) {
    const std::string bytes = encode_trace(trace);
    folder.write("r/runs/" + id + ".trace", bytes);
    folder.write("r/runs/" + id + ".json", test::older_run_text(kept.configuration, kept.record, bytes));
    const std::string told = test::refusal_of(folder, "report r --figure " + figure + " --svg a.svg");
    EXPECT_THAT(told, HasSubstr(words));
    EXPECT_THAT(told, HasSubstr("(allowed: "));
  };
  Trace trace = whole;
  for (TraceLayout::Panel& panel : trace.panels) panel.curves.clear();
  refused(id, trace, "r/runs/step--nine_pd--s3.trace: a trace's panel has no curve");
  trace = whole;
  trace.panels.clear();
  refused(id, trace, "run step--nine_pd--s3 has no curves to draw");
  trace = whole;
  trace.solves.counts.assign(3, std::numeric_limits<std::int64_t>::max());
  refused("solve_time", trace, "r/runs/step--nine_pd--s3.trace: a trace's solves");
}

}  // namespace
}  // namespace solenoid
