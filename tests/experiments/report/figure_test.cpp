#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/gnuplot.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/report/run_figure.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <cmath>

#include <gmock/gmock.h>

namespace solenoid {
namespace {

using testing::HasSubstr;
using testing::Not;

ScenarioConfig sine() {
  ScenarioConfig s;
  s.name = "sine";
  s.trajectory = thesis_sine(0.0197);
  return s;
}

TEST(Figure, IsASmallSvgWithFiveLabelledPlots) {
  const test::Folder folder;
  draw_figure(shipped_variant("thesis_pd"), sine(), 1, folder / "run.svg", FigureFormat::svg);
  const std::string svg = test::text_of(folder / "run.svg");
  EXPECT_THAT(svg, HasSubstr("<svg"));
  EXPECT_THAT(svg, HasSubstr("</svg>"));
  for (const char* label : {"position [mm]", "error [mm]", "valve mode", "cylinder force [N]", "motor force [N]",
                            "time [s]", "thesis_pd", "sine", "RMSE", "desired", "actual"})
    EXPECT_THAT(svg, HasSubstr(label));
  EXPECT_THAT(svg, HasSubstr("exhaust A, fill B"));
  EXPECT_LT(svg.size(), 300'000u);
}

TEST(Figure, NamesAllNineModesOfFourTwoWayValves) {
  const test::Folder folder;
  draw_figure(shipped_variant("nine_pd"), sine(), 1, folder / "run.svg", FigureFormat::svg);
  const std::string svg = test::text_of(folder / "run.svg");
  for (const char* mode : {"hold A, hold B", "hold A, fill B", "fill A, fill B", "exhaust A, exhaust B"})
    EXPECT_THAT(svg, HasSubstr(mode));
}

TEST(Figure, IsAPngWhenAskedFor) {
  const test::Folder folder;
  ScenarioConfig brief = sine();
  brief.duration_s = 0.1;
  draw_figure(shipped_variant("thesis_cylinder"), brief, 1, folder / "run.png", FigureFormat::png);
  EXPECT_EQ(test::text_of(folder / "run.png").substr(0, 8), "\x89PNG\r\n\x1a\n");
}

/// 40 ms of a made-up system: two axes in one unit, ticks of 25 us, nothing continuous.
Trace brief_trace() {
  Trace trace;
  trace.tick_s = 25e-6;
  trace.modes = {"both off", "first on"};
  for (const char* name : {"first", "second", "mode"}) trace.signals.push_back({name, "A", 1e-3, {}});
  for (int i = 0; i < 1600; ++i) {
    trace.ticks.push_back(i);
    for (std::size_t k = 0; k < 2; ++k) trace.signals[k].values.push_back(std::sin(0.01 * i + static_cast<double>(k)));
    trace.signals[2].values.push_back(i / 100 % 2);
  }
  trace.derived = {{"sum", "A", 1e-3, 0.5, {{"first", 1.0}, {"second", 1.0}}}};
  trace.panels = {{.label = "currents", .unit = "A", .curves = {{"first", "phase one"}, {"second", "phase two"}}},
                  {.label = "gate mode", .curves = {{"mode", "mode"}}, .modes = true},
                  {.label = "sum", .unit = "mA", .scale = 1e3, .curves = {{"sum", "sum"}}, .choice = "last"},
                  {.label = "hidden", .unit = "A", .curves = {{"first", "first"}}, .choice = "last"}};
  return trace;
}

TEST(Figure, OfATraceHasThePanelsOfItsLayoutAndTimesInMilliseconds) {
  const test::Folder folder;
  draw_figure(brief_trace(), "made up", folder / "run.svg", FigureFormat::svg);
  const std::string svg = test::text_of(folder / "run.svg");
  for (const char* label : {"made up", "currents [A]", "phase one", "phase two", "gate mode", "first on", "sum [mA]",
                            "time [ms]", ">40<", "viewBox=\"0 0 1280 480\""})
    EXPECT_THAT(svg, HasSubstr(label));
  EXPECT_THAT(svg, Not(HasSubstr("hidden")));  // the second of a choice
}

TEST(Figure, ANameIsTextAndNothingElse) {
  const test::Folder folder;
  const std::string trap = (folder / "trap").string();
  VariantConfig variant = shipped_variant("thesis_cylinder");
  variant.name = "a'; system('touch " + trap + "'); b=' `touch " + trap + "` @x \"q\"\nset output";
  ScenarioConfig brief = sine();
  brief.duration_s = 0.1;
  draw_figure(variant, brief, 1, folder / "name ' with `touch x`.svg", FigureFormat::svg);
  EXPECT_FALSE(std::filesystem::exists(trap));
  EXPECT_THAT(test::text_of(folder / "name ' with `touch x`.svg"), HasSubstr("system("));
}

TEST(Figure, ALabelMayBeAnyText) {
  const test::Folder folder;
  const std::string trap = (folder / "trap").string();
  for (const std::string& label : {std::string("'"), std::string("''a'''b"), std::string("\\n \\"),
                                   std::string("%s %d %n 50% %"), "\"`touch '" + trap + "'` @GPVAL_TERM"}) {
    Trace trace = brief_trace();
    trace.modes = {label, label};
    for (TraceLayout::Panel& panel : trace.panels) {
      panel.label = panel.unit = label;
      for (TraceLayout::Curve& curve : panel.curves) curve.label = label;
    }
    draw_figure(trace, label, folder / "run.svg", FigureFormat::svg);
    const std::string svg = test::text_of(folder / "run.svg");
    EXPECT_THAT(svg, HasSubstr(">" + label + "<"));
  }
  EXPECT_FALSE(std::filesystem::exists(trap));
}

TEST(Figure, DrawsTheLargestNumbersThatATraceMayHave) {
  const test::Folder folder;
  for (const double size : {1e12, 1e-12}) {
    Trace trace = brief_trace();
    trace.tick_s = size > 1 ? 3600.0 : 1e-9;
    if (size > 1) trace.ticks.back() = std::int64_t{1} << 46;
    for (Trace::Signal& signal : trace.signals) {
      for (double& value : signal.values) value *= size / signal.resolution;
      signal.resolution = size;
    }
    for (TraceLayout::Derived& derived : trace.derived) {
      derived.resolution = derived.constant = size;
      for (auto& [name, factor] : derived.terms) factor = size;
    }
    for (TraceLayout::Panel& panel : trace.panels) panel.scale = panel.limit = size;
    draw_figure(decode_trace(encode_trace(trace)), "made up", folder / "run.svg", FigureFormat::svg);
    EXPECT_THAT(test::text_of(folder / "run.svg"), HasSubstr("</svg>"));
  }
}

TEST(Figure, LeavesNothingWhereItCannotBeWritten) {
  const test::Folder folder;
  ScenarioConfig brief = sine();
  brief.duration_s = 0.1;
  const VariantConfig variant = shipped_variant("thesis_cylinder");
  EXPECT_THROW(draw_figure(variant, brief, 1, folder / "no/run.svg", FigureFormat::svg), OutputError);
  EXPECT_TRUE(folder.empty());
  std::filesystem::create_directory(folder / "run.svg");
  EXPECT_THROW(draw_figure(variant, brief, 1, folder / "run.svg", FigureFormat::svg), OutputError);
  EXPECT_FALSE(std::filesystem::exists(folder / "run.svg.tmp"));
}

TEST(Gnuplot, SaysWhatItComplainedAbout) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "script") << "plot 'no such file'\n";
  try {
    run_gnuplot(folder.path(), "script");
    FAIL() << "no complaint";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("gnuplot failed"));
    EXPECT_THAT(error.what(), Not(HasSubstr("no message")));
  }
}

TEST(PlotCommand, DrawsAShippedVariantOnAScenarioOfACampaign) {
  const test::Folder folder;
  std::ofstream(folder / "campaign.toml") << "[variant.mine]\nmotor = \"pd\"\n"
                                             "[[scenario]]\nname = \"short\"\ntrajectory = { kind = \"sine\" }\n"
                                             "duration_s = 0.2\nnoise = true\n";
  const std::string campaign = folder / "campaign.toml", out = folder / "run.svg";
  for (const char* variant : {"mine", "thesis_id"}) {
    const test::ProgramRun run =
        test::run_program({"plot", campaign, "--variant", variant, "--scenario", "short", "--seed", "7", "--svg", out});
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(test::text_of(out), testing::AllOf(HasSubstr(variant), HasSubstr("seed 7")));
  }
}

TEST(PlotCommand, RefusesUnknownNamesAndNeedsOneOutput) {
  const test::Folder folder;
  const std::string out = folder / "run.svg";
  const test::ProgramRun variant = test::run_program({"plot", "--variant", "x", "--scenario", "sine_0", "--svg", out});
  EXPECT_EQ(variant.exit_code, 2);
  EXPECT_THAT(variant.err, testing::AllOf(HasSubstr("'x'"), HasSubstr("thesis_pd")));
  const test::ProgramRun scenario =
      test::run_program({"plot", "--variant", "thesis_pd", "--scenario", "y", "--svg", out});
  EXPECT_EQ(scenario.exit_code, 2);
  EXPECT_THAT(scenario.err, testing::AllOf(HasSubstr("'y'"), HasSubstr("sine_0")));
  EXPECT_EQ(test::run_program({"plot", "--variant", "thesis_pd", "--scenario", "sine_0"}).exit_code, 2);
  EXPECT_TRUE(folder.empty());
}

TEST(PlotCommand, NamesThePackageWhenGnuplotIsMissing) {
  const test::Folder folder;
  const std::string out = folder / "run.svg";
  const test::ProgramRun run =
      test::run_program({"plot", "--variant", "thesis_pd", "--scenario", "sine_0", "--svg", out}, "/nonexistent");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("apt-get install gnuplot-nox"));
  EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1);
  EXPECT_FALSE(std::filesystem::exists(out));
}

}  // namespace
}  // namespace solenoid
