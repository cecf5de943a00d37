#include "experiments/report/performance_profile.hpp"

#include "core/config/reader.hpp"
#include "tests/experiments/judged_runs.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <gmock/gmock.h>

namespace solenoid {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// Share of the tasks within a factor.
double rho(const PerformanceProfile& profile, double tau) {
  const auto within = std::ranges::count_if(profile.ratios, [&](double ratio) { return ratio <= tau; });
  return static_cast<double>(within) / static_cast<double>(profile.runs);
}

TEST(PerformanceProfile, IsTheShareOfTasksWithinAFactorOfTheBest) {
  // Dolan and More by hand: errors of three variants in four tasks; the last is solved by nobody.
  const RunTable runs =
      tables_of(test::judged_runs({{1.0, 4.0, 3.0, -1}, {2.0, 1.0, 3.0, -1}, {1.5, -1, 12.0, -1}})).front();
  const TaskErrors errors(runs);
  EXPECT_EQ(errors.tasks(), 4u);
  const std::vector<PerformanceProfile> profiles = performance_profiles(errors, 100);
  ASSERT_EQ(profiles.size(), 3u);
  EXPECT_THAT(profiles[0].ratios, ElementsAre(1.0, 1.0, 4.0));
  EXPECT_THAT(profiles[1].ratios, ElementsAre(1.0, 1.0, 2.0));
  EXPECT_THAT(profiles[2].ratios, ElementsAre(1.5, 4.0));
  for (const PerformanceProfile& profile : profiles) EXPECT_EQ(profile.runs, 4u);
  EXPECT_EQ(profiles[2].ok, 2u);
  EXPECT_EQ(rho(profiles[0], 1.0), 0.5);
  EXPECT_EQ(rho(profiles[1], 1.99), 0.5);
  EXPECT_EQ(rho(profiles[1], 2.0), 0.75);
  EXPECT_EQ(rho(profiles[2], 1e9), 0.5) << "a run that did not end well counts as never";
}

TEST(PerformanceProfile, OfProportionalErrorsIsAStep) {
  std::vector<std::vector<double>> errors(3);
  for (int s = 0; s < 1000; ++s)
    for (std::size_t v = 0; v < 3; ++v) errors[v].push_back((1.0 + static_cast<double>(v)) * (1.0 + s));
  const std::vector<PerformanceProfile> profiles =
      performance_profiles(TaskErrors(tables_of(test::judged_runs(errors)).front()), 201);
  for (std::size_t v = 0; v < 3; ++v) {
    EXPECT_EQ(profiles[v].ok, 1000u);
    ASSERT_EQ(profiles[v].ratios.size(), 201u) << "a bounded number of points";
    EXPECT_NEAR(profiles[v].ratios.front(), 1.0 + static_cast<double>(v), 1e-12);
    EXPECT_NEAR(profiles[v].ratios.back(), 1.0 + static_cast<double>(v), 1e-12);
  }
}

TEST(PerformanceProfile, IsDrawnWithEveryVariantAndRefusedWithoutAny) {
  const test::Folder folder;
  draw_profiles(tables_of(test::judged_runs({{1.0, 4.0}, {2.0, 1.0}})).front(), folder.file("p.svg"),
                FigureFormat::svg);
  const std::string svg = test::text_of(folder / "p.svg");
  for (const char* text : {"v0", "v1", "share of tasks", "2 tasks", "tau, log2 scale"})
    EXPECT_THAT(svg, HasSubstr(text));
  EXPECT_THROW(
      draw_profiles(tables_of(test::judged_runs({{-1.0}, {-1.0}})).front(), folder.file("n.svg"), FigureFormat::svg),
      ConfigError);
}

TEST(TaskErrors, AreOfAGroupAsOfATableThatHasNoOthers) {
  std::vector<RunRecord> both, alone;
  for (const char* scenario : {"a", "b", "a", "b"})
    for (const char* variant : {"x", "y"}) {
      const std::uint64_t seed = 1 + both.size() / 4;
      both.push_back(test::judged_run(variant, scenario, seed, 1.0 + static_cast<double>(both.size())));
      if (std::string(scenario) == "b") alone.push_back(both.back());
    }
  const RunTable table = tables_of(both).front(), own = tables_of(alone).front();
  const TaskErrors group(table, 1), whole(own);
  ASSERT_EQ(group.tasks(), 2u);
  ASSERT_EQ(whole.tasks(), 2u);
  EXPECT_EQ(group.scenarios(), 1u);
  for (std::size_t task = 0; task < 2; ++task)
    for (std::size_t v = 0; v < 2; ++v) EXPECT_EQ(group.error(task, v), whole.error(task, v));
}

}  // namespace
}  // namespace solenoid
