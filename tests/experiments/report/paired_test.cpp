// Paired comparisons against closed forms and by what they promise: coverage and false verdicts over made-up families.

#include "experiments/report/paired.hpp"

#include "tests/experiments/judged_runs.hpp"
#include "tests/experiments/normal_values.hpp"

#include <cmath>
#include <map>
#include <random>

#include <gmock/gmock.h>

namespace solenoid {
namespace {

using test::judged_run;
using test::judged_runs;
using test::normal_values;
using Values = std::vector<double>;

PairedVariants pairs_of(const std::vector<RunRecord>& records) { return PairedVariants(tables_of(records).front()); }

/// The only comparison of two variants, of the first against the second.
Paired first_pair(const std::vector<RunRecord>& records) { return pairs_of(records).against(1).rows.at(0); }

/// Log-normal errors of variants in scenarios: what a scenario does to all of them, and what is a variant's own.
std::vector<Values> log_normal_errors(std::mt19937_64& random, std::size_t variants, std::size_t scenarios,
                                      double own_spread) {
  const Values common = normal_values(random, scenarios);
  std::vector<Values> errors;
  for (std::size_t v = 0; v < variants; ++v) {
    errors.push_back(normal_values(random, scenarios));
    for (std::size_t s = 0; s < scenarios; ++s) errors[v][s] = std::exp(common[s] + own_spread * errors[v][s]);
  }
  return errors;
}

TEST(Paired, IntervalsOfLogNormalPairsCoverTheTruth) {
  constexpr int draws = 400;
  const double truth = std::exp(-0.1);
  for (const std::size_t scenarios : {8u, 20u, 60u}) {
    int covered = 0;
    for (int draw = 0; draw < draws; ++draw) {
      std::mt19937_64 random(1000 * scenarios + static_cast<std::size_t>(draw));
      std::vector<Values> errors = log_normal_errors(random, 2, scenarios, 0.3);
      for (double& error : errors[0]) error *= truth;
      const Paired pair = first_pair(judged_runs(errors));
      ASSERT_TRUE(pair.own && pair.corrected);
      EXPECT_EQ(pair.own->low, pair.corrected->low) << "one comparison needs no correction";
      covered += pair.own->low <= truth && truth <= pair.own->high;
    }
    EXPECT_GE(covered, 92 * draws / 100) << scenarios;
    EXPECT_LE(covered, 98 * draws / 100) << scenarios;
  }
}

TEST(Paired, OfSeedsThatAgreeWithinAScenarioTheScenariosCount) {
  // Ten seeds that repeat their scenario say no more than one: by seeds the interval would be three times as short.
  constexpr int draws = 200;
  int covered = 0;
  for (int draw = 0; draw < draws; ++draw) {
    std::mt19937_64 random(static_cast<std::size_t>(draw));
    const std::vector<Values> errors = log_normal_errors(random, 2, 12, 0.3);
    std::vector<RunRecord> records;
    for (RunRecord& record : judged_runs(errors))
      for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        record.seed = seed;
        records.push_back(record);
      }
    const Paired pair = first_pair(records);
    EXPECT_EQ(pair.tasks, 120u);
    covered += pair.own->low <= 1 && 1 <= pair.own->high;
  }
  EXPECT_GE(covered, 91 * draws / 100);
}

bool shows_one(const PairedFamily& family) {
  return std::ranges::any_of(family.rows, [](const Paired& pair) {
    return pair.verdict && *pair.verdict != Paired::Verdict::no_difference_shown;
  });
}

constexpr int families = 200, most_false = 19;  // 5 %, and three standard deviations

TEST(Paired, AllPairsWithoutADifferenceRarelyShowOne) {
  int shown = 0, uncorrected = 0;
  for (int draw = 0; draw < families; ++draw) {
    std::mt19937_64 random(77 + static_cast<std::size_t>(draw));
    const PairedFamily all = pairs_of(judged_runs(log_normal_errors(random, 6, 25, 0.3))).all();
    EXPECT_EQ(all.comparisons, 15u);
    shown += shows_one(all);
    uncorrected +=
        std::ranges::any_of(all.rows, [](const Paired& pair) { return pair.own->high < 1 || pair.own->low > 1; });
  }
  EXPECT_LE(shown, most_false);
  EXPECT_GT(uncorrected, 40) << "what the correction is for";
}

TEST(Paired, FifteenVariantsAsGoodAsANamedOneRarelyShowADifference) {
  int shown = 0;
  for (int draw = 0; draw < families; ++draw) {
    std::mt19937_64 random(770 + static_cast<std::size_t>(draw));
    const PairedFamily named = pairs_of(judged_runs(log_normal_errors(random, 16, 25, 0.3))).against(0);
    EXPECT_EQ(named.comparisons, 15u);
    shown += shows_one(named);
  }
  EXPECT_LE(shown, most_false);
}

TEST(Paired, ADifferenceThatIsThereIsShownWithItsSign) {
  std::mt19937_64 random(8);
  std::vector<Values> errors = log_normal_errors(random, 4, 40, 0.1);
  for (double& error : errors[2]) error *= 0.7;
  for (const Paired& pair : pairs_of(judged_runs(errors)).all().rows) {
    const auto expected = pair.variant == 2    ? Paired::Verdict::better
                          : pair.baseline == 2 ? Paired::Verdict::worse
                                               : Paired::Verdict::no_difference_shown;
    EXPECT_EQ(pair.verdict, expected) << pair.variant << " " << pair.baseline;
    if (pair.variant == 2) {
      EXPECT_NEAR(pair.ratio, 0.7, 0.05);
      EXPECT_GT(pair.better, 0.9);
      EXPECT_LE(*pair.p, 0.05);
    }
  }
}

TEST(Paired, TurnedRoundItIsTheMirrorImage) {
  std::mt19937_64 random(9);
  std::vector<Values> errors = log_normal_errors(random, 3, 30, 0.4);
  errors[0][3] = errors[1][3];
  errors[0][5] = -1;  // it failed
  const PairedFamily all = pairs_of(judged_runs(errors)).all();
  for (const Paired& pair : all.rows) {
    const auto other = std::ranges::find_if(
        all.rows, [&](const Paired& o) { return o.variant == pair.baseline && o.baseline == pair.variant; });
    ASSERT_NE(other, all.rows.end());
    EXPECT_NEAR(pair.ratio * other->ratio, 1, 1e-12);
    EXPECT_NEAR(pair.better + other->better, 1, 1e-12);
    EXPECT_NEAR(pair.own->low * other->own->high, 1, 1e-12);
    EXPECT_NEAR(pair.corrected->high * other->corrected->low, 1, 1e-12);
    EXPECT_EQ(pair.p, other->p);
    EXPECT_EQ(pair.lost, other->baseline_lost);
    EXPECT_LE(pair.corrected->low, pair.own->low);
    EXPECT_GE(pair.corrected->high, pair.own->high);
  }
}

TEST(Paired, ARatioIsThatOfGeometricMeansAndTiesAreHalves) {
  // Two of three tasks of the first scenario, one of the second: each task counts the same.
  const Paired pair = first_pair({judged_run("a", "s", 1, 2.0), judged_run("b", "s", 1, 1.0),   //
                                  judged_run("a", "s", 2, 4.0), judged_run("b", "s", 2, 10.0),  //
                                  judged_run("a", "s", 3, -1.), judged_run("b", "s", 3, 1.0),   //
                                  judged_run("a", "t", 1, 3.0), judged_run("b", "t", 1, 3.0)});
  EXPECT_EQ(pair.tasks, 3u);
  EXPECT_EQ(pair.lost, 1u);
  EXPECT_EQ(pair.baseline_lost, 0u);
  EXPECT_NEAR(pair.ratio, std::cbrt(2.0 * 4.0 * 3.0 / (1.0 * 10.0 * 3.0)), 1e-14);
  EXPECT_NEAR(pair.better, 0.5, 1e-15);
}

TEST(Paired, RunsThatDidNotEndWellAreCountedOnTheirSide) {
  std::vector<RunRecord> records;
  for (int s = 0; s < 10; ++s) {
    const std::string scenario = "s" + std::to_string(s);
    records.push_back(judged_run("a", scenario, 1, s < 2 || s == 4 ? -1 : 1.0 + 0.1 * s));
    records.push_back(judged_run("b", scenario, 1, s == 4 || s == 5 ? -1 : 1.5));
    if (s == 9) records.back().status = "unstable";
    if (s < 8) records.push_back(judged_run("never", scenario, 1, -1));
  }
  const PairedFamily found = pairs_of(records).against(1);
  ASSERT_EQ(found.rows.size(), 2u);
  const Paired &a = found.rows[0], &never = found.rows[1];
  EXPECT_EQ(a.tasks, 5u);  // 2, 3, 6, 7, 8
  EXPECT_EQ(a.lost, 3u);
  EXPECT_EQ(a.baseline_lost, 3u);
  EXPECT_EQ(never.tasks, 0u);
  EXPECT_EQ(never.lost, 8u);  // of the tasks that both ran
  EXPECT_EQ(never.baseline_lost, 2u);
  EXPECT_TRUE(std::isnan(never.ratio));
  EXPECT_FALSE(never.own || never.corrected || never.p || never.verdict);
  EXPECT_EQ(found.comparisons, 1u);
}

TEST(Paired, FromFewScenariosOrWithoutSpreadNothingIsConcluded) {
  std::mt19937_64 random(10);
  for (const std::size_t scenarios : {1u, 4u}) {
    std::vector<Values> errors = log_normal_errors(random, 2, scenarios, 0.01);
    for (double& error : errors[0]) error *= 0.1;
    const Paired pair = first_pair(judged_runs(errors));
    EXPECT_EQ(pair.tasks, scenarios);
    EXPECT_LT(pair.ratio, 0.2);
    EXPECT_EQ(pair.better, 1.0);
    EXPECT_FALSE(pair.own || pair.corrected || pair.p || pair.verdict) << scenarios;
  }
  const Paired same = first_pair(judged_runs({Values(30, 0.5), Values(30, 1.0)}));
  EXPECT_NEAR(same.ratio, 0.5, 1e-12);
  EXPECT_FALSE(same.own || same.verdict) << "thirty times the same is one observation";
}

/// Of three variants the second is the first, but in one scenario.
std::vector<Values> nearly_tied_errors(std::mt19937_64& random, std::size_t scenarios) {
  std::vector<Values> errors = log_normal_errors(random, 3, scenarios, 0.3);
  errors[1] = errors[0];
  errors[1][2] *= 1.1;
  return errors;
}

TEST(Paired, APairThatIsNearlyTiedTakesNoVerdictFromTheOthers) {
  std::mt19937_64 random(15);
  for (const std::size_t scenarios : {10u, 40u}) {
    std::vector<Values> errors = nearly_tied_errors(random, scenarios);
    for (double& error : errors[2]) error *= 0.1;
    const PairedVariants pairs = pairs_of(judged_runs(errors));
    for (const PairedFamily& family : {pairs.all(), pairs.against(0)})
      for (const Paired& pair : family.rows) {
        EXPECT_EQ(family.comparisons, family.rows.size() == 2 ? 1u : 2u);
        if (pair.variant == 2 || pair.baseline == 2) {
          EXPECT_EQ(pair.verdict, pair.variant == 2 ? Paired::Verdict::better : Paired::Verdict::worse);
          EXPECT_TRUE(pair.own && pair.corrected && pair.p);
        } else {
          EXPECT_FALSE(pair.own || pair.corrected || pair.p || pair.verdict);
          EXPECT_NEAR(std::abs(std::log(pair.ratio)), std::log(1.1) / static_cast<double>(scenarios), 1e-12);
          EXPECT_NEAR(std::abs(pair.better - 0.5), 0.5 / static_cast<double>(scenarios), 1e-12);
        }
      }
  }
}

TEST(Paired, BesideANearlyTiedPairNothingIsShownMoreOften) {
  int shown = 0;
  for (int draw = 0; draw < families; ++draw) {
    std::mt19937_64 random(7700 + static_cast<std::size_t>(draw));
    const PairedFamily all = pairs_of(judged_runs(nearly_tied_errors(random, 25))).all();
    EXPECT_EQ(all.comparisons, 2u);
    shown += shows_one(all);
  }
  EXPECT_LE(shown, most_false);
}

TEST(Paired, OfVeryManyVariantsTheNamedComparisonsAlone) {
  constexpr std::size_t variants = PairedVariants::most_variants + 1;
  std::mt19937_64 random(16);
  const std::vector<RunRecord> records = judged_runs(log_normal_errors(random, variants, 8, 0.3));
  const RunTable table = tables_of(records).front();
  const PairedVariants pairs(table, {}, 3);
  EXPECT_FALSE(pairs.every_pair());
  const PairedFamily named = pairs.against(3), all = pairs.all();
  EXPECT_EQ(named.comparisons, variants - 1);
  EXPECT_EQ(named.rows.size(), variants - 1);
  for (const Paired& pair : named.rows) EXPECT_TRUE(pair.own && pair.corrected && pair.p && pair.verdict);
  EXPECT_EQ(all.comparisons, 0u);
  EXPECT_EQ(all.rows.size(), 2 * (variants - 1));
  for (const Paired& pair : all.rows) {
    EXPECT_TRUE(pair.variant == 3 || pair.baseline == 3);
    EXPECT_TRUE(pair.own.has_value());
    EXPECT_FALSE(pair.corrected || pair.p || pair.verdict) << "a baseline that the errors may have chosen";
  }
  EXPECT_TRUE(PairedVariants(table).all().rows.empty());
}

TEST(Paired, OfASingleScenarioItsSeedsAreResampled) {
  std::mt19937_64 random(11);
  const std::vector<Values> errors = log_normal_errors(random, 2, 30, 0.3);
  std::vector<RunRecord> scenarios = judged_runs(errors), seeds = scenarios;
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    seeds[i].scenario = "one";
    seeds[i].seed = 1 + i / 2;
  }
  const PairedVariants one = pairs_of(seeds);
  EXPECT_TRUE(one.of_seeds());
  EXPECT_EQ(one.units(), 30u);
  const Paired a = one.against(1).rows.at(0), b = first_pair(scenarios);
  EXPECT_NEAR(a.ratio, b.ratio, 1e-12);
  EXPECT_NEAR(std::log(a.own->high / a.own->low), std::log(b.own->high / b.own->low), 0.05);  // drawn in another order
}

TEST(Paired, GroupsOfManyScenariosHaveTheirSpread) {
  std::mt19937_64 random(12);
  const std::size_t scenarios = 5000;
  const std::vector<Values> errors = log_normal_errors(random, 2, scenarios, 0.3);
  const PairedVariants pairs = pairs_of(judged_runs(errors));
  EXPECT_TRUE(pairs.grouped());
  EXPECT_EQ(pairs.units(), PairedVariants::most_units);
  double sum = 0, squares = 0;
  for (std::size_t s = 0; s < scenarios; ++s) sum += std::log(errors[0][s] / errors[1][s]);
  const double n = static_cast<double>(scenarios), mean = sum / n;
  for (std::size_t s = 0; s < scenarios; ++s) squares += std::pow(std::log(errors[0][s] / errors[1][s]) - mean, 2);
  const double margin = 1.96 * std::sqrt(squares / (n - 1) / n);
  const Paired pair = pairs.against(1).rows.at(0);
  EXPECT_NEAR(pair.ratio, std::exp(mean), 1e-12);
  EXPECT_NEAR(0.5 * std::log(pair.own->high / pair.own->low), margin, 0.15 * margin);
}

TEST(Paired, TheOrderOfRunsChangesNoDigit) {
  std::mt19937_64 random(13);
  std::vector<Values> errors = log_normal_errors(random, 5, 700, 0.3);
  errors[1][100] = errors[3][200] = errors[3][201] = -1;
  std::vector<RunRecord> records = judged_runs(errors);
  const auto digest = [](const std::vector<RunRecord>& list) {
    const RunTable table = tables_of(list).front();
    std::map<std::pair<std::string, std::string>, Values> numbers;
    for (const Paired& p : PairedVariants(table).all().rows)
      numbers[{table.variants()[p.variant], table.variants()[p.baseline]}] = {
          p.ratio, p.better, p.own->low, p.own->high, p.corrected->low, p.corrected->high, *p.p};
    return numbers;
  };
  const auto before = digest(records);
  std::ranges::shuffle(records, random);
  EXPECT_EQ(digest(records), before);
}

}  // namespace
}  // namespace solenoid
