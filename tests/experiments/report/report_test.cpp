#include "experiments/campaign/run_file.hpp"
#include "experiments/report/page.hpp"
#include "experiments/report/report_data.hpp"
#include "tests/experiments/needs_uplot.hpp"
#include "tests/experiments/report/small_results.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace solenoid {
namespace {

using nlohmann::ordered_json;
using test::copy_results;
using test::data_of;
using test::older_results;
using test::small_results;
using testing::HasSubstr;

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
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
  for (const char* figure : {"pareto", "profile", "solve_time", "step--nine_pd--s3"}) {
    const test::ProgramRun run =
        test::run_program(folder, fmt::format("report results --figure {0} --svg {0}.svg", figure));
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.out, fmt::format("{}.svg\n", figure));
    EXPECT_THAT(test::text_of(folder.file(fmt::format("{}.svg", figure))), HasSubstr("</svg>"));
  }
  EXPECT_THAT(test::text_of(folder / "solve_time.svg"), HasSubstr("5 ms"));
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

}  // namespace
}  // namespace solenoid
