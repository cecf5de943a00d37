#include "experiments/campaign/run_file.hpp"
#include "experiments/report/page.hpp"
#include "experiments/report/report_data.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"
#include "experiments/systems/actuator/simulation/thesis_cell.hpp"
#include "tests/experiments/needs_uplot.hpp"
#include "tests/experiments/program_under_test.hpp"
#include "tests/experiments/report/older_folder.hpp"

#include <limits>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using nlohmann::ordered_json;
using testing::HasSubstr;

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

/// The data of a page, as its script reads them.
ordered_json data_of(const std::string& html) {
  const std::string begin = "<script type=\"application/json\" id=\"data\">";
  const std::size_t from = html.find(begin) + begin.size();
  return ordered_json::parse(html.substr(from, html.find("</script>", from) - from));
}

/// The small campaign's results, made once.
const test::Folder& small_results() {
  static const test::Folder folder;
  static const int exit_code = [] {
    folder.write("c.toml", test::small_campaign);
    const test::ProgramRun run = test::run_program(folder, "compare c.toml --out results --format json");
    folder.write("results.json", run.out);
    return run.exit_code;
  }();
  EXPECT_EQ(exit_code, 0);
  return folder;
}

/// The same as the version before would have left them, a file a run.
const test::Folder& older_results() {
  static const test::Folder folder;
  static const bool made = [] {
    std::filesystem::copy(small_results().file("results"), folder.file("results"),
                          std::filesystem::copy_options::recursive);
    test::make_older(folder.file("results"));
    return true;
  }();
  EXPECT_TRUE(made);
  return folder;
}

TEST(Report, IsOneFileWithEveryRunOfTheCampaign) {
  NEEDS_UPLOT();
  const test::Folder& folder = small_results();
  const test::ProgramRun run = test::run_program(folder, "report results");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.out, "results/report.html\n");
  const std::string html = test::text_of(folder / "results/report.html");
  const ordered_json data = data_of(html);
  EXPECT_EQ(data.at("format"), 1);
  EXPECT_EQ(data.at("status"), "finished");
  EXPECT_EQ(data.at("live"), false);
  EXPECT_EQ(data.at("deadline_us"), 5000.0);
  EXPECT_EQ(data.at("resolved_toml"), test::text_of(folder / "results/resolved.toml"));
  EXPECT_EQ(data.at("manifest").at("counts").at("ok"), 8);
  const ordered_json compared = ordered_json::parse(test::text_of(folder / "results.json")).at("runs");
  ASSERT_EQ(data.at("runs").size(), compared.size());
  for (std::size_t i = 0; i < compared.size(); ++i) {
    const ordered_json& shown = data.at("runs")[i];
    for (const auto& [key, value] : compared[i].items()) EXPECT_EQ(shown.at(key), value) << i << " " << key;
    EXPECT_EQ(shown.at("trace"), "full");
    EXPECT_GT(shown.at("solves").at("counts").size(), 0u);
    EXPECT_EQ(count(html, fmt::format("id=\"full-{}\"", i)), 1u);
  }
}

TEST(Report, DescribesItsSystem) {
  NEEDS_UPLOT();
  const ordered_json data = data_of(report_of_folder(small_results().file("results"), false));
  const ordered_json& system = data.at("system");
  EXPECT_EQ(system.at("name"), "actuator");
  EXPECT_EQ(system.at("judged"), "rmse_mm");
  EXPECT_EQ(system.at("label"), "RMSE");
  EXPECT_EQ(system.at("unit"), "mm");
  EXPECT_EQ(system.at("error"), "true position error");
  EXPECT_EQ(system.at("timing").at("period_s"), 0.005);
  ASSERT_EQ(system.at("efforts").size(), 2u);
  EXPECT_EQ(system["efforts"][0].at("key"), "switches_per_s");
  EXPECT_EQ(system["efforts"][1].at("label"), "air");
  EXPECT_EQ(system["efforts"][1].at("unit"), "g");
  EXPECT_EQ(system.at("conditions"),
            ordered_json::parse(R"([{"key": "payload_kg", "label": "payload", "unit": "kg"}])"));
  const ordered_json& best = data.at("rankings")[0].at("variants")[0];
  for (const char* key : {"rmse_mm", "rmse_margin", "p95_rmse_mm", "worst_rmse_mm", "switches_per_s", "air_g",
                          "solve_p50_us", "solve_p99_us"})
    EXPECT_TRUE(best.at(key).is_number()) << key;
  for (const char* key : {"judged", "margin", "p95", "worst"})
    EXPECT_TRUE(best.contains(system.at(key).get<std::string>())) << key;
  for (const ordered_json& variant : data.at("variants"))
    for (const char* key : {"name", "summary", "solver", "valves", "estimator"})
      EXPECT_TRUE(variant.at(key).is_string()) << key;
}

TEST(Report, AsksTheNetworkForNothing) {
  NEEDS_UPLOT();
  const test::Folder& folder = small_results();
  const std::string html = report_of_folder(folder.file("results"), true);
  for (const char* remote : {"src=\"", "<link rel=\"stylesheet", "@import", "url(http", "src='"})
    EXPECT_EQ(count(html, remote), 0u) << remote;
  EXPECT_THAT(html, HasSubstr("default-src 'none'"));
}

TEST(Report, RanksOverEachScenarioToo) {
  NEEDS_UPLOT();
  const ordered_json data = data_of(report_of_folder(small_results().file("results"), false));
  ASSERT_EQ(data.at("rankings").size(), 3u);
  EXPECT_EQ(data["rankings"][0].at("name"), "all scenarios");
  EXPECT_EQ(data["rankings"][0].at("common"), 2);
  EXPECT_EQ(data["rankings"][1].at("name"), "step");
  EXPECT_EQ(data["rankings"][2].at("scenarios"), ordered_json::array({"loaded"}));
  for (const ordered_json& ranking : data["rankings"]) {
    ASSERT_EQ(ranking.at("variants").size(), 2u);
    EXPECT_LE(ranking["variants"][0].at("rmse_mm").get<double>(), ranking["variants"][1].at("rmse_mm").get<double>());
  }
  EXPECT_EQ(data["runs"][0].at("trace"), "overview");
}

TEST(Report, TextOfTheDataIsNeverMarkup) {
  NEEDS_UPLOT();
  const std::string trap = "</script><script>alert(1)</script><!--<script>\xff\xe2\x80\xa8";
  const auto page = [](const std::string& text) {
    return report_page({{"campaign", text}, {"runs", {{{"status", "failed: " + text}}}}}, {{text, "", ""}});
  };
  const std::string plain = page("plain"), trapped = page(trap);
  EXPECT_EQ(count(trapped, "<script"), count(plain, "<script"));
  EXPECT_EQ(count(trapped, "</script"), count(plain, "</script"));
  EXPECT_EQ(count(trapped, "<!--"), count(plain, "<!--"));
  EXPECT_THAT(data_of(trapped).at("campaign").get<std::string>(), testing::StartsWith("</script><script>alert(1)"));
}

TEST(Report, Base64IsRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64(std::string("\xfb\xff\x00", 3)), "+/8A");
}

TEST(Report, AThousandRunsStaySmall) {
  NEEDS_UPLOT();
  const test::Folder folder;
  std::filesystem::copy(older_results().file("results"), folder.file("r"), std::filesystem::copy_options::recursive);
  std::string seeds;
  for (int seed = 3; seed < 253; ++seed) {
    seeds += fmt::format("{}{}", seed > 3 ? ", " : "", seed);
    for (const char* cell : {"step--thesis_cylinder", "step--nine_pd", "loaded--thesis_cylinder", "loaded--nine_pd"}) {
      const auto file = [&](int s, const char* kind) {
        return folder.file(fmt::format("r/runs/{}--s{}.{}", cell, s, kind));
      };
      if (seed <= 4) continue;
      RunFile kept = read_run_file(file(3, "json")).value();
      kept.record.seed = static_cast<std::uint64_t>(seed);
      std::ofstream(file(seed, "json")) << test::older_run_text(kept.configuration, kept.record,
                                                                test::text_of(file(3, "trace")));
      std::filesystem::copy(file(3, "trace"), file(seed, "trace"));
    }
  }
  ordered_json manifest = ordered_json::parse(test::text_of(folder / "r/manifest.json"));
  manifest["seeds"] = ordered_json::parse("[" + seeds + "]");
  std::ofstream(folder / "r/manifest.json") << manifest;
  const std::string html = report_of_folder(folder.file("r"), true);
  const ordered_json data = data_of(html);
  EXPECT_EQ(data.at("runs").size(), 1000u);
  EXPECT_EQ(data["runs"][999].at("seed"), 252);
  EXPECT_LT(data.dump().size(), 1'500'000u);
  EXPECT_EQ(count(html, "id=\"full-"), 1000u);
  // The curves are the folder's, byte for byte after the rounding that they had.
  const std::string begin = "id=\"full-999\">";
  const std::size_t from = html.find(begin) + begin.size();
  EXPECT_EQ(html.substr(from, html.find('<', from) - from),
            base64(test::text_of(folder / "r/runs/loaded--nine_pd--s3.trace")));
}

TEST(Report, RunsOfAnotherCampaignInTheFolderAreLeftOut) {
  NEEDS_UPLOT();
  const test::Folder folder;
  folder.write("c.toml", test::small_campaign);
  ASSERT_EQ(test::run_program(folder, "compare c.toml --out r --scenario step").exit_code, 0);
  ASSERT_EQ(test::run_program(folder, "compare c.toml --out r --scenario loaded --variant nine_pd").exit_code, 0);
  EXPECT_EQ(data_of(report_of_folder(folder.file("r"), false)).at("runs").size(), 2u);
}

TEST(Report, ALogOfARunInRealTimeIsDrawnToo) {
  NEEDS_UPLOT();
  const test::Folder folder;
  const test::ProgramRun run = test::run_program(
      folder, "run nine_state --no-realtime --quiet --duration 0.3 --out r; '" SOLENOID_PROGRAM "' report r");
  EXPECT_THAT(run.out, HasSubstr("r/report.html"));
  const ordered_json data = data_of(test::text_of(folder / "r/report.html"));
  ASSERT_EQ(data.at("runs").size(), 1u);
  EXPECT_EQ(data["runs"][0].at("trace"), "full");
}

TEST(Report, DrawsEveryFigureForAPaper) {
  const test::Folder& folder = small_results();
  for (const char* figure : {"pareto", "solve_time", "step--nine_pd--s3"}) {
    const test::ProgramRun run =
        test::run_program(folder, fmt::format("report results --figure {0} --svg {0}.svg", figure));
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.out, fmt::format("{}.svg\n", figure));
    EXPECT_THAT(test::text_of(folder.file(fmt::format("{}.svg", figure))), HasSubstr("</svg>"));
  }
  EXPECT_THAT(test::text_of(folder / "solve_time.svg"), HasSubstr("5 ms"));
}

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

/// The small campaign's results, a fresh copy of them in "r".
void copy_results(const test::Folder& folder, const test::Folder& from = small_results()) {
  std::filesystem::remove_all(folder.file("r"));
  std::filesystem::copy(from.file("results"), folder.file("r"), std::filesystem::copy_options::recursive);
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

/// A run of `solenoid run`, made once.
const test::Folder& recorded_results() {
  static const test::Folder folder;
  static const int exit_code =
      test::run_program(folder, "run nine_pd --no-realtime --quiet --duration 1 --out r").exit_code;
  EXPECT_LT(exit_code, 2);
  return folder;
}

TEST(Report, ALogThatIsNotWholeIsTold) {
  NEEDS_UPLOT();
  const test::Folder folder;
  const std::string id = "cycloidal--nine_pd--s1", log = "r/" + id + ".mcap";
  std::filesystem::copy(recorded_results().file("r"), folder.file("r"), std::filesystem::copy_options::recursive);
  const auto told = [&](const std::string& words) {
    const test::ProgramRun report = test::run_program(folder, "report r");
    EXPECT_EQ(report.exit_code, 1) << report.err;
    EXPECT_EQ(count(report.err, "\n"), 1u) << report.err;
    EXPECT_THAT(report.err, testing::StartsWith("solenoid: left out: " + log + ": "));
    EXPECT_THAT(report.err, HasSubstr(words));
    return data_of(test::text_of(folder / "r/report.html"));
  };
  EXPECT_EQ(test::run_program(folder, "report r").err, "");
  std::filesystem::resize_file(folder / log, std::filesystem::file_size(folder / log) / 2);
  const std::string figure = "report r --figure " + id + " --svg a.svg";
  ordered_json data = told("shown up to 0.");
  ASSERT_EQ(data.at("runs").size(), 1u);
  EXPECT_EQ(data["runs"][0].at("trace"), "full");
  EXPECT_EQ(data["left_out"][0].at("in_part"), true);
  const test::ProgramRun drawn = test::run_program(folder, figure);
  EXPECT_EQ(drawn.exit_code, 1);
  EXPECT_THAT(drawn.err, HasSubstr("shown up to 0."));
  EXPECT_THAT(test::text_of(folder / "a.svg"), HasSubstr("</svg>"));

  std::filesystem::remove(folder / log);
  data = told("is missing");
  ASSERT_EQ(data.at("runs").size(), 1u);
  EXPECT_EQ(data["runs"][0].at("trace"), "none");
  EXPECT_THAT(test::refusal_of(folder, figure), HasSubstr("no curves to draw"));

  folder.write(log, "rubbish");
  data = told("(allowed: ");
  EXPECT_EQ(data.at("runs").size(), 0u);
  EXPECT_EQ(data["left_out"][0].at("in_part"), false);
}

TEST(Report, ARunInRealTimeHasNoTraceOfAnEarlierOne) {
  NEEDS_UPLOT();
  const test::Folder folder;
  copy_results(folder);
  folder.write("c.toml", test::small_campaign);
  const test::ProgramRun run =
      test::run_program(folder, "run nine_pd --campaign c.toml --scenario step --seed 3 --no-realtime --quiet --out r");
  ASSERT_LT(run.exit_code, 2) << run.err;
  EXPECT_TRUE(std::filesystem::exists(folder / "r/step--nine_pd--s3.mcap"));
  const Results results = read_results(folder.file("r"));
  EXPECT_FALSE(results.kept->traced(results.run("step--nine_pd--s3").index.value()));
  EXPECT_EQ(test::run_program(folder, "report r").err, "");
}

TEST(ThesisCell, IsFoundByTheLawAndTheTaskNotByNames) {
  VariantConfig pd = shipped_variant("thesis_pd");
  pd.name = "mine";
  ScenarioConfig task;
  task.trajectory = thesis_cycloidal(ActuatorParameters{}.equilibrium_position_m());
  const auto simulated = thesis_cell(pd, task);
  ASSERT_TRUE(simulated);
  EXPECT_EQ(simulated->table, "6-1");
  EXPECT_FALSE(simulated->measured);
  EXPECT_EQ(simulated->rmse_mm.value, 0.15);
  EXPECT_EQ(simulated->mae_mm.value, 0.61);
  EXPECT_EQ(simulated->ssa_mm->value, 0.01);
  EXPECT_TRUE(simulated->ssa_mm->upper_bound);
  actuator(task).plant = "twin";
  const auto measured = thesis_cell(pd, task);
  ASSERT_TRUE(measured);
  EXPECT_EQ(measured->table, "7-2");
  EXPECT_TRUE(measured->measured);
  task.trajectory = thesis_sine(0.0197);
  actuator(task).plane = Plane::horizontal;
  EXPECT_EQ(thesis_cell(pd, task)->table, "7-8");
  EXPECT_FALSE(thesis_cell(pd, task)->sse_mm);
}

TEST(ThesisCell, AnotherLawOrTaskHasNone) {
  const VariantConfig pd = shipped_variant("thesis_pd");
  ScenarioConfig task;
  task.trajectory = thesis_sine(0.0197);
  EXPECT_TRUE(thesis_cell(pd, task));
  EXPECT_FALSE(thesis_cell(shipped_variant("nine_pd"), task));
  EXPECT_FALSE(thesis_cell(shipped_variant("thesis_pd_ekf"), task));
  ScenarioConfig other = task;
  actuator(other).payload_kg = 0.2;
  EXPECT_FALSE(thesis_cell(pd, other));
  other = task;
  actuator(other).mismatch.friction = 1.5;
  EXPECT_FALSE(thesis_cell(pd, other));
  other = task;
  other.duration_s = 4.0;
  EXPECT_FALSE(thesis_cell(pd, other));
  other.trajectory = thesis_sine(0.05);
  other.duration_s = other.trajectory.duration_s();
  EXPECT_FALSE(thesis_cell(pd, other));
}

}  // namespace
}  // namespace solenoid
