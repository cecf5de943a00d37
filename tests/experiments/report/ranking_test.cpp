// Rankings and tables are made from the system's description: nothing here but names of metrics knows a system.

#include "experiments/report/ranking.hpp"

#include "controllers/systems.hpp"
#include "experiments/report/comparison.hpp"
#include "experiments/report/headings.hpp"
#include "experiments/report/pareto.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <cmath>
#include <stdexcept>

#include <gmock/gmock.h>

namespace solenoid {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// A run of a system that ended well: every metric is `number`, the judged one `error`.
RunRecord ended_well(const System& system, const std::string& variant, const std::string& scenario, double error,
                     double number = 1.0) {
  RunRecord r;
  r.system = system.name();
  r.variant = variant;
  r.scenario = scenario;
  r.trajectory = "made up";
  r.status = "ok";
  r.conditions.assign(system.description().conditions.size(), 0.5);
  r.metrics.emplace();
  for (const MetricColumn& metric : system.description().metrics) r.metrics->set(metric.key, number);
  r.metrics->set(system.description().judged.metric, error);
  return r;
}

std::vector<std::string> headings(const Table& table) {
  std::vector<std::string> shown;
  for (const Table::Column& column : table.columns)
    if (!column.heading.empty()) shown.push_back(column.heading);
  return shown;
}

TEST(Headings, AUnitIsWhatTheKeyEndsWith) {
  const auto parts = [](const char* key, const char* heading) {
    const MetricHeading h = metric_heading({.key = key, .heading = heading});
    return h.label + "|" + h.unit;
  };
  EXPECT_EQ(parts("rmse_mm", "RMSE mm"), "RMSE|mm");
  EXPECT_EQ(parts("motor_rms_n", "motor N"), "motor|N");
  EXPECT_EQ(parts("distortion_percent", "distortion %"), "distortion|%");
  EXPECT_EQ(parts("rmse_measured_mm", "measured RMSE"), "measured RMSE|");
  EXPECT_EQ(parts("switches_per_s", "switches/s"), "switches/s|");
  EXPECT_EQ(parts("mae_measured_mm", ""), "mae measured mm|");
  EXPECT_EQ(enumeration({}), "");
  EXPECT_EQ(enumeration({"a"}), "a");
  EXPECT_EQ(enumeration({"a", "b", "c"}), "a, b and c");
}

TEST(Headings, OfEverySystemHaveAJudgedMetric) {
  for (const System* system : systems()) {
    EXPECT_FALSE(judged_metric(system->description()).heading.empty()) << system->name();
    EXPECT_FALSE(metric_heading(judged_metric(system->description())).unit.empty()) << system->name();
  }
  SystemDescription none;
  EXPECT_THROW(judged_metric(none), std::logic_error);
}

TEST(Ranking, IsByTheJudgedMetricWithTheMeanOfEachEffort) {
  for (const System* system : systems()) {
    std::vector<RunRecord> runs;
    for (const auto& [scenario, number] : {std::pair{"one", 1.0}, {"two", 3.0}}) {
      runs.push_back(ended_well(*system, "coarse", scenario, 20.0 * number, number));
      runs.push_back(ended_well(*system, "fine", scenario, 2.0 * number, number));
    }
    const Ranking ranking = rank_variants(runs);
    EXPECT_EQ(ranking.system, &system->description());
    ASSERT_EQ(ranking.variants.size(), 2u);
    const RankedVariant& best = ranking.variants.front();
    EXPECT_EQ(best.variant, "fine");
    EXPECT_NEAR(best.error, std::sqrt(12.0), 1e-12);
    EXPECT_EQ(best.worst, 6.0);
    EXPECT_EQ(best.p95, 6.0);
    EXPECT_EQ(best.efforts, std::vector<double>(effort_metrics(system->description()).size(), 2.0)) << system->name();
  }
}

TEST(Ranking, RecordsOfDifferentSystemsNeverMix) {
  if (systems().size() < 2) GTEST_SKIP() << "one system alone";
  const System &first = *systems()[0], &second = *systems()[1];
  const std::vector<RunRecord> runs = {ended_well(second, "v", "s", 1.0), ended_well(first, "v", "s", 100.0),
                                       ended_well(second, "w", "s", 2.0)};
  const Ranking ranking = rank_variants(runs);
  EXPECT_EQ(ranking.system, &second.description());
  ASSERT_EQ(ranking.variants.size(), 2u);
  EXPECT_EQ(ranking.variants[0].error, 1.0);
  EXPECT_EQ(ranking.variants[0].runs, 1);
  const std::vector<RunTable> parts = tables_of(runs);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].size(), 2u);
  EXPECT_EQ(&parts[1].system(), &first.description());
  const std::string text = result_of(runs, true).text(false);
  EXPECT_THAT(text, HasSubstr(first.description().judged.error));
  EXPECT_THAT(text, HasSubstr(second.description().judged.error));
}

TEST(Comparison, HasTheActuatorsHeadings) {
  const std::vector<RunRecord> runs = {ended_well(*systems().front(), "a", "sine", 1.0),
                                       ended_well(*systems().front(), "b", "sine", 2.0)};
  const Result result = result_of(runs, true);
  ASSERT_EQ(result.tables.size(), 2u);
  EXPECT_THAT(headings(result.tables[0]), ElementsAre("rank", "variant", "RMSE mm", "worst mm", "switches/s", "air g",
                                                      "solve p50 us", "p99 us", "failed"));
  EXPECT_EQ(result.tables[1].title, "sine: made up, payload 0.5 kg");
  EXPECT_THAT(headings(result.tables[1]), ElementsAre("  variant", "seed", "RMSE mm", "MAE mm", "measured RMSE",
                                                      "switches", "air g", "motor N", "p99 us", "status"));
  EXPECT_THAT(result.notes, ElementsAre("* best. RMSE: geometric mean of the true position error over 1 of 1 scenarios "
                                        "(those all ranked variants finished); switches/s and air: means; p50: median, "
                                        "p99: worst run."));
  const Table::Row &best = result.tables[1].rows[0], &other = result.tables[1].rows[1];
  EXPECT_TRUE(best[2].marked);
  EXPECT_FALSE(other[2].marked);
  EXPECT_FALSE(best[7].marked) << "a motor that does less is not better";
}

TEST(Comparison, HasEachSystemsHeadings) {
  for (const System* system : systems()) {
    const SystemDescription& description = system->description();
    const std::string text = result_of(std::vector{ended_well(*system, "a", "task", 1.0)}, true).text(false);
    for (const MetricColumn& metric : description.metrics)
      if (metric.detail || metric.effort) {
        EXPECT_THAT(text, HasSubstr(metric.heading));  // none is in any text
      }
    EXPECT_THAT(text, HasSubstr("worst " + metric_heading(judged_metric(description)).unit));
    EXPECT_THAT(text, HasSubstr("geometric mean of the " + description.judged.error));
    for (const Signal& condition : description.conditions)
      EXPECT_THAT(text, HasSubstr(condition.label + " " + value_text(0.5, condition.unit)));
  }
}

TEST(Comparison, OfNothingHasHeadingsAlone) {
  const Result result = result_of({}, true);
  ASSERT_EQ(result.tables.size(), 1u);
  EXPECT_TRUE(result.tables[0].rows.empty());
}

TEST(Pareto, HasAPanelForEachEffort) {
  for (const System* system : systems()) {
    const std::vector<MetricColumn> efforts = effort_metrics(system->description());
    if (efforts.empty()) continue;
    const test::Folder folder;
    draw_pareto(std::vector{ended_well(*system, "only one", "task", 1.0)}, folder.file("p.svg"));
    const std::string svg = test::text_of(folder / "p.svg");
    for (const MetricColumn& effort : efforts) EXPECT_THAT(svg, HasSubstr(metric_heading(effort).with_unit()));
    EXPECT_THAT(svg, HasSubstr("only one"));
    EXPECT_THAT(svg, Not(HasSubstr("inf")));
  }
}

}  // namespace
}  // namespace solenoid
