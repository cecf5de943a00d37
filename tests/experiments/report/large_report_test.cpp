// Campaigns of more runs than a report lists: here with the limit lowered.

#include "experiments/report/merge.hpp"
#include "experiments/report/page.hpp"
#include "experiments/report/ranking.hpp"
#include "experiments/report/report_data.hpp"
#include "experiments/report/sample.hpp"
#include "tests/experiments/needs_uplot.hpp"
#include "tests/experiments/program_under_test.hpp"
#include "tests/experiments/synthetic_runs.hpp"

#include <cmath>
#include <map>
#include <random>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using testing::HasSubstr;
using Json = nlohmann::ordered_json;

constexpr Listing few{.most = 100, .sample = 60};

/// Records of three variants in 500 scenarios, made once.
const test::Folder& many_runs() {
  static const test::Folder folder;
  static const bool written = [] {
    const Campaign campaign = test::synthetic_campaign({"thesis_pd", "nine_state", "thesis_cylinder"}, 500);
    test::write_synthetic(campaign, folder.file("r"), 6);
    return true;
  }();
  EXPECT_TRUE(written);
  return folder;
}

/// Errors of each variant's runs that ended well, sorted.
std::map<std::string, std::vector<double>> sorted_errors(const Results& all) {
  std::map<std::string, std::vector<double>> errors;
  for (const StoredRun& run : all.runs)
    if (run.record.ok()) errors[run.record.variant].push_back(run.record.metrics->number("rmse_mm"));
  for (auto& [variant, list] : errors) std::ranges::sort(list);
  return errors;
}

TEST(Quantiles, AreThoseOfASort) {
  std::mt19937 random(3);
  for (const std::size_t count :
       {std::size_t{1}, std::size_t{200}, std::size_t{201}, std::size_t{202}, std::size_t{999}, std::size_t{100'003}}) {
    std::vector<double> values(count);
    for (double& value : values) value = std::lognormal_distribution<double>()(random);
    const std::vector<double> found = quantiles(values, 201);
    std::ranges::sort(values);
    if (count <= 201) {
      EXPECT_EQ(found, values);
      continue;
    }
    ASSERT_EQ(found.size(), 201u);
    for (std::size_t k = 0; k <= 200; ++k) {
      // The least value that at least k / 200 of all do not exceed.
      const auto least = std::ranges::find_if(values, [&](const double& value) {
        return 200 * static_cast<std::size_t>(&value - values.data() + 1) >= k * count;
      });
      EXPECT_EQ(found[k], *least) << count << " " << k;
    }
  }
  EXPECT_TRUE(quantiles({}, 201).empty());
}

TEST(Sample, HasTheWorstSomeOfTheOthersAndSomeThatDidNotEndWell) {
  const Results all = read_results(many_runs().file("r"), Listing::everything());
  const RunTable table = *all.table();
  const std::vector<std::size_t> rows = sampled_rows(table, 90);
  EXPECT_EQ(rows, sampled_rows(table, 90));
  EXPECT_TRUE(std::ranges::is_sorted(rows));
  EXPECT_EQ(rows.size(), 90u);
  const auto errors = sorted_errors(all);
  for (std::uint32_t v = 0; v < 3; ++v) {
    std::vector<double> listed;
    std::size_t troubled = 0;
    for (const std::size_t row : rows)
      if (table.variant(row) == v) {
        if (table.ok(row))
          listed.push_back(table.error(row));
        else
          ++troubled;
      }
    std::ranges::sort(listed);
    const std::vector<double>& own = errors.at(table.variants()[v]);
    EXPECT_EQ(listed.size() + troubled, 30u);
    EXPECT_GE(troubled, 1u);
    EXPECT_LE(troubled, 6u);
    EXPECT_TRUE(std::equal(listed.end() - 6, listed.end(), own.end() - 6)) << "the six largest";
    EXPECT_EQ(listed.front(), own.front());
    const double median = own[own.size() / 2];
    const auto below = std::ranges::count_if(listed, [&](double error) { return error <= median; });
    EXPECT_NEAR(static_cast<double>(below), 0.5 * static_cast<double>(listed.size() - 6), 2.0);
  }
  std::vector<std::size_t> every(table.size());
  for (std::size_t row = 0; row < every.size(); ++row) every[row] = row;
  EXPECT_EQ(sampled_rows(table, 100'000), every);
}

TEST(RunTable, AGroupIsRankedAsIfItWereAlone) {
  const Campaign campaign = test::synthetic_campaign({"thesis_pd", "nine_state"}, 40);
  const SystemDescription& system = campaign.system->description();
  RunTable mixed(system);
  std::map<std::string, RunTable> alone;
  for (std::size_t run = 0; run < campaign.runs.size(); ++run) {
    KeptRun kept = test::synthetic_run(campaign, run);
    // Scenarios of three names in turn, as well as in a row.
    const std::string group = run < 40 ? std::string(1, static_cast<char>('a' + run % 3)) : "d";
    kept.record.scenario = group;
    kept.record.seed = run;
    mixed.add(kept.record, kept.solves);
    alone.try_emplace(group, system).first->second.add(kept.record, kept.solves);
  }
  ASSERT_EQ(mixed.groups().size(), 4u);
  for (std::uint32_t group = 0; group < 4; ++group) {
    const RunTable& own = alone.at(mixed.groups()[group]);
    const Ranking a = rank_variants(mixed, group), b = rank_variants(own);
    ASSERT_EQ(a.variants.size(), b.variants.size());
    EXPECT_EQ(a.common_scenarios, b.common_scenarios);
    for (std::size_t v = 0; v < a.variants.size(); ++v) {
      EXPECT_EQ(a.variants[v].variant, b.variants[v].variant);
      EXPECT_EQ(a.variants[v].runs, b.variants[v].runs);
      EXPECT_EQ(a.variants[v].error, b.variants[v].error);
      const auto number = [&](const RunTable& table) {
        return static_cast<std::uint32_t>(std::ranges::find(table.variants(), a.variants[v].variant) -
                                          table.variants().begin());
      };
      EXPECT_EQ(mixed.distribution(number(mixed), group, 201).errors, own.distribution(number(own), {}, 201).errors);
      EXPECT_EQ(mixed.solves(number(mixed), group).times.counts, own.solves(number(own)).times.counts);
      EXPECT_EQ(mixed.solves(number(mixed), group).late, own.solves(number(own)).late);
    }
  }
}

TEST(LargeReport, ListsASampleAndHasNumbersOverAll) {
  const std::string folder = many_runs().file("r");
  const Results all = read_results(folder, Listing::everything()), part = read_results(folder, few);
  ASSERT_TRUE(part.sampled());
  ASSERT_FALSE(all.sampled());
  ASSERT_EQ(all.runs.size(), 1500u);
  EXPECT_EQ(part.runs.size(), 60u);
  EXPECT_TRUE(std::ranges::is_sorted(part.runs, {}, [](const StoredRun& run) { return *run.index; }));
  const Json whole = report_json(all, {}, false), sampled = report_json(part, {}, false);
  EXPECT_EQ(whole.at("sample"), false);
  EXPECT_EQ(sampled.at("sample"), true);
  EXPECT_EQ(sampled.at("counts"), whole.at("counts"));
  EXPECT_EQ(sampled.at("counts").at("runs"), 1500);
  EXPECT_EQ(sampled["counts"]["ok"].get<int>() + sampled["counts"]["unstable"].get<int>() +
                sampled["counts"]["failed"].get<int>(),
            1500);
  ASSERT_EQ(sampled.at("rankings").size(), 1u);
  EXPECT_EQ(sampled["rankings"][0].at("variants"), whole["rankings"][0].at("variants"));
  EXPECT_EQ(sampled["rankings"][0].at("scenario_count"), 500);
  EXPECT_EQ(sampled.at("runs").size(), 60u);
  for (const Json& run : sampled.at("runs"))
    EXPECT_EQ(std::ranges::count(whole.at("runs"), run), 1) << "as it is in the whole list";
  EXPECT_LT(sampled.dump().size(), whole.dump().size() / 5);
}

TEST(LargeReport, ADistributionIsThatOfASortAndSolverTimesAddUp) {
  const Results all = read_results(many_runs().file("r"), Listing::everything());
  const Json data = report_json(read_results(many_runs().file("r"), few), {}, false);
  const auto errors = sorted_errors(all);
  for (const Json& variant : data.at("rankings")[0].at("variants")) {
    const std::string name = variant.at("variant");
    const std::vector<double>& own = errors.at(name);
    const Json& distribution = variant.at("distribution");
    EXPECT_EQ(distribution.at("runs"), 500);
    EXPECT_EQ(distribution.at("ok"), own.size());
    ASSERT_EQ(distribution.at("errors").size(), 201u);
    for (std::size_t k = 1; k <= 200; ++k)
      EXPECT_EQ(distribution["errors"][k], own[(k * own.size() + 199) / 200 - 1]) << name << " " << k;
    EXPECT_EQ(distribution["errors"][0], own.front());
    std::int64_t solves = 0, late = 0;
    for (const StoredRun& run : all.runs)
      if (run.record.variant == name && run.record.ok()) {
        solves += run.solves.total();
        late += run.record.metrics->deadline_misses;
      }
    std::int64_t summed = 0;
    for (const Json& count : variant.at("solves").at("counts")) summed += count.get<std::int64_t>();
    EXPECT_EQ(summed, solves);
    EXPECT_EQ(variant["solves"].at("late"), late);
    EXPECT_GT(late, 0);
  }
}

TEST(LargeReport, AnyRunIsFoundByItsIDListedOrNot) {
  const Results part = read_results(many_runs().file("r"), few);
  std::size_t unlisted = 0;
  for (std::size_t i = 0; i < part.kept->size(); i += 97) {
    const std::string id = part.campaign.runs[i].id;
    unlisted += std::ranges::count(part.runs, id, &StoredRun::id) == 0;
    const StoredRun run = part.run(id);
    EXPECT_EQ(run.id, id);
    EXPECT_EQ(run.index, i);
    EXPECT_EQ(run.record.scenario, part.campaign.scenarios.name(part.campaign.runs[i].scenario));
  }
  EXPECT_GT(unlisted, 0u);
  EXPECT_THROW(part.run("sine-m501--thesis_pd--s1"), std::exception);
  EXPECT_THROW(part.run("nothing"), std::exception);
}

TEST(LargeReport, OfMoreRunsThanTheLimitIsSmallWithoutBeingAsked) {
  NEEDS_UPLOT();
  const test::Folder folder;
  const Campaign campaign = test::synthetic_campaign({"thesis_pd", "nine_state"}, 1001);
  test::write_synthetic(campaign, folder.file("r"), 3);
  const Merged merged = merge(folder.file("r"), true);
  ASSERT_EQ(merged.no_report, "");
  EXPECT_TRUE(merged.results.sampled());
  EXPECT_LE(merged.results.runs.size(), most_sampled_runs);
  EXPECT_GE(merged.results.runs.size(), most_sampled_runs / 2);
  EXPECT_EQ(merged.results.table()->size(), 2002u);
  EXPECT_LT(std::filesystem::file_size(folder / "r/report.html"), 3'000'000u);
  const std::string csv = test::text_of(folder / "r/runs.csv");
  EXPECT_EQ(std::ranges::count(csv, '\n'), 2003);
}

TEST(LargeReport, ARunWithDamagedRecordIsLeftOutByName) {
  const test::Folder folder;
  std::filesystem::copy(many_runs().file("r"), folder.file("r"), std::filesystem::copy_options::recursive);
  const std::string file = fmt::format("r/shards/{}.runs", Shard::of(3, 6).name());
  std::string bytes = test::text_of(folder / file);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] + 1);
  folder.write(file, bytes);
  const Results part = read_results(folder.file("r"), few);
  EXPECT_EQ(part.table()->size(), 1499u);
  ASSERT_EQ(part.left_out.size(), 1u);
  EXPECT_THAT(part.left_out[0].reason, HasSubstr(file));
}

}  // namespace
}  // namespace solenoid
