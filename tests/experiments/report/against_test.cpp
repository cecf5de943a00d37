#include "experiments/report/against.hpp"

#include "controllers/systems.hpp"
#include "core/config/reader.hpp"

#include <cmath>
#include <string>
#include <vector>

#include <gmock/gmock.h>

namespace solenoid {
namespace {

RunRecord judged_run(const std::string& variant, const std::string& scenario, std::uint64_t seed, double error) {
  const SystemDescription& system = systems().front()->description();
  RunRecord r;
  r.variant = variant;
  r.scenario = scenario;
  r.seed = seed;
  r.status = error > 0 ? "ok" : "failed: made up";
  if (error <= 0) return r;
  r.metrics.emplace();
  for (const MetricColumn& metric : system.metrics) r.metrics->set(metric.key, 1.0);
  r.metrics->set(system.judged.metric, error);
  return r;
}

std::vector<double> numbers_of(const Table::Row& row) {
  std::vector<double> numbers;
  for (std::size_t i = 1; i < row.size(); ++i) numbers.push_back(row[i].value.get<double>());
  return numbers;
}

TEST(Against, RatiosAreOfTheSameScenarioAndSeed) {
  const std::vector<RunRecord> records = {judged_run("base", "a", 1, 1.0),   judged_run("base", "a", 2, 10.0),
                                          judged_run("base", "b", 1, 100.0), judged_run("base", "b", 2, -1.0),
                                          judged_run("mine", "a", 1, 2.0),   judged_run("mine", "a", 2, 4.0),
                                          judged_run("mine", "b", 1, 200.0), judged_run("mine", "b", 2, 7.0)};
  const auto table = against(records, "base");
  ASSERT_TRUE(table.has_value());
  ASSERT_EQ(table->rows.size(), 1u);
  const double twice = std::log(2.0), less = std::log(0.4), mean = (2 * twice + less) / 3;
  const double squares = 2 * (twice - mean) * (twice - mean) + (less - mean) * (less - mean);
  const double margin = 1.96 * std::sqrt(squares / 2 / 3);
  EXPECT_THAT(numbers_of(table->rows[0]),
              testing::Pointwise(testing::DoubleNear(1e-12),
                                 {std::exp(mean), std::exp(mean - margin), std::exp(mean + margin), 1.0, 3.0}));
  EXPECT_THAT(table->title, testing::HasSubstr("base"));
  EXPECT_THAT(against(records, "")->title, testing::HasSubstr("mine"));  // the better one
}

TEST(Against, OneRunHasNoIntervalAndNoneIsNoTable) {
  const std::vector<RunRecord> one = {judged_run("base", "a", 1, 1.0), judged_run("mine", "a", 1, 2.0),
                                      judged_run("never", "a", 1, -1.0)};
  const auto table = against(one, "base");
  ASSERT_TRUE(table.has_value());
  ASSERT_EQ(table->rows.size(), 2u);
  EXPECT_EQ(table->rows[0][1].value.get<double>(), 2.0);
  EXPECT_TRUE(table->rows[0][2].value.is_null());
  EXPECT_TRUE(table->rows[1][1].value.is_null());
  EXPECT_FALSE(against(std::vector<RunRecord>{one[0]}, "base").has_value());
  EXPECT_FALSE(against(std::vector<RunRecord>{one[0], one[2]}, "base").has_value());
  EXPECT_THROW(against(one, "nobody"), ConfigError);
}

}  // namespace
}  // namespace solenoid
