#include "experiments/systems/actuator/thesis/reproduce.hpp"

#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/reader.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/base/result.hpp"
#include "experiments/systems/actuator/thesis/cases.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <cmath>
#include <map>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using testing::HasSubstr;

const std::string continuous_flow = "consistent+no_rod_atmosphere";
const std::string printed_flow = "printed+inferred+no_rod_atmosphere";

std::vector<ReproducedCase> only(std::vector<ReproducedCase> cases, const std::vector<std::string>& parameters) {
  std::erase_if(cases, [&](const ReproducedCase& c) {
    return std::find(parameters.begin(), parameters.end(), c.parameters) == parameters.end();
  });
  return cases;
}

const Cell& find(const std::vector<Cell>& cells, const std::string& parameters, const std::string& name,
                 const std::string& metric) {
  for (const Cell& cell : cells)
    if (cell.parameters == parameters && cell.case_name == name && cell.metric == metric) return cell;
  throw std::out_of_range(parameters + ", " + name + ", " + metric);
}

Cell chapter_6_cell(const std::string& metric, double thesis, double ours) {
  return {"table-6-1", "consistent", "a case", metric, PrintedNumber{thesis, false}, ours, 0.0, 1};
}

TEST(Reproduce, ChapterSixComesWithin35PercentOnAverageForBothSets) {
  std::vector<ReproducedCase> cases = only(simulation_table("table-6-1"), {continuous_flow, printed_flow});
  for (ReproducedCase& c : only(simulation_table("table-6-2"), {continuous_flow, printed_flow}))
    cases.push_back(std::move(c));
  const std::vector<Agreement> all = agreements(reproduce(cases, 2));
  ASSERT_EQ(all.size(), 4u);
  for (const Agreement& a : all) {
    EXPECT_EQ(a.cells, 15) << a.parameters << ' ' << a.metric;
    EXPECT_LE(a.mean_abs_ln, 0.35) << a.parameters << ' ' << a.metric;
  }
}

TEST(Reproduce, OnlyThePrintedFlowShowsTheLimitCycleOfTheUnloadedCylinder) {
  const std::vector<Cell> cells = reproduce(only(simulation_table("table-6-1"), {continuous_flow, printed_flow}), 2);
  EXPECT_GT(find(cells, printed_flow, "thesis_cylinder, 0 kg", "ssa_mm").ours, 1.0);
  EXPECT_LT(find(cells, continuous_flow, "thesis_cylinder, 0 kg", "ssa_mm").ours, 0.1);
}

TEST(Reproduce, SteadyStateErrorsOfLongHorizonsComeWithin20PercentOfTheRig) {
  const std::vector<Cell> cells = reproduce(only(hardware_table("table-5-2"), {"inferred"}), 2);
  for (const int steps : {120, 140, 160, 180, 200, 220}) {
    const std::string name = "N_p = " + std::to_string(steps);
    for (const char* metric : {"sse_max_abs_measured_mm", "sse_mean_abs_measured_mm", "sse_max_abs_mm"}) {
      const Cell& cell = find(cells, "inferred", name, metric);
      EXPECT_NEAR(cell.ours, cell.thesis->value, 0.2 * cell.thesis->value) << name << ' ' << metric;
      EXPECT_EQ(cell.runs, 10);
      EXPECT_GT(cell.ours_spread, 0.0);
      EXPECT_LT(cell.ours_spread, 0.1 * cell.ours) << name << ' ' << metric;
    }
  }
}

TEST(Reproduce, IntegralActionRemovesTheStepErrorThatThePayloadLeaves) {
  const std::string payload = "payload 0.15 kg", metric = "sse_mean_abs_measured_mm";
  const double without =
      find(reproduce(only(hardware_table("table-5-3"), {"inferred"}), 2), "inferred", payload, metric).ours;
  const double with =
      find(reproduce(only(hardware_table("table-5-4"), {"inferred"}), 2), "inferred", payload, metric).ours;
  EXPECT_GT(without, 2.0);
  EXPECT_LT(with, 0.4);  // the rig's mean of five tests
}

TEST(Reproduce, OnTheMotionsOfChapterSevenTheTwinIsNearerThanTheModel) {
  std::vector<Cell> cells;
  for (StandIn rig : stand_ins()) {
    rig.motion_seeds = 1;
    std::ranges::move(reproduce(motion_cases(rig), 2), std::back_inserter(cells));
  }
  std::map<std::string, double> rmse;
  for (const Agreement& a : agreements(cells)) {
    EXPECT_EQ(a.tables, "chapter 7");
    EXPECT_EQ(a.cells, a.metric == "sse_measured_mm" || a.metric == "ssa_measured_mm" ? 4 : 9);
    if (a.metric == "rmse_measured_mm") rmse[a.parameters] = a.mean_abs_ln;
  }
  EXPECT_LT(rmse.at("twin"), rmse.at("inferred"));
  EXPECT_LT(rmse.at("twin+integral_per_period"), rmse.at("twin"));
}

TEST(Reproduce, DoesNotDependOnTheNumberOfJobs) {
  const std::vector<ReproducedCase> cases = only(simulation_table("table-6-2"), {continuous_flow});
  const std::vector<Cell> one = reproduce(cases, 1), three = reproduce(cases, 3);
  ASSERT_EQ(one.size(), 12u);
  ASSERT_EQ(one.size(), three.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].ours, three[i].ours);
    EXPECT_EQ(one[i].case_name, three[i].case_name);
  }
}

TEST(Reproduce, CountsEveryRunOnceAndMeansOverTheSeeds) {
  ReproducedCase c = hardware_table("table-5-2").front();
  c.scenario.duration_s = 0.01;
  c.seeds = {1, 2, 3, 4};
  c.compared = {{"start_m", std::nullopt, [](const RunResult& run, const ScenarioConfig&) {
                   return run.ticks.front().sensors.value[position_channel];
                 }}};
  std::vector<std::size_t> progress;
  const std::vector<Cell> cells = reproduce({c}, 2, [&](std::size_t done, std::size_t) { progress.push_back(done); });
  EXPECT_THAT(progress, testing::ElementsAre(1, 2, 3, 4));
  double sum = 0, squares = 0;
  for (const std::uint64_t seed : c.seeds) {
    const double y = simulate(c.variant, c.scenario, seed).ticks.front().sensors.value[position_channel];
    sum += y;
    squares += y * y;
  }
  EXPECT_DOUBLE_EQ(cells.front().ours, sum / 4);
  EXPECT_NEAR(cells.front().ours_spread, std::sqrt((squares - sum * sum / 4) / 3), 1e-9);
  EXPECT_FALSE(cells.front().thesis);
}

TEST(Reproduce, AFailureInARunReachesTheCaller) {
  std::vector<ReproducedCase> cases = only(simulation_table("table-6-2"), {continuous_flow});
  for (ReproducedCase& c : cases) c.scenario.duration_s = 0.01;
  cases[2].compared[0].ours = [](const RunResult&, const ScenarioConfig&) -> double { throw std::domain_error("no"); };
  EXPECT_THROW(reproduce(cases, 2), std::domain_error);
}

TEST(Reproduce, EveryCellOfThePrintedTablesIsCompared) {
  std::map<std::string, std::size_t> cells;
  for (const ReproducibleTable& table : reproducible_tables())
    for (const ReproducedCase& c : table.cases(table.name)) cells[c.table + " " + c.parameters] += c.compared.size();
  EXPECT_EQ(cells.at("table-6-1 " + continuous_flow), 9u * 5);  // SSE twice, once a reading
  EXPECT_EQ(cells.at("table-6-2 " + printed_flow), 6u * 2);
  EXPECT_EQ(cells.at("table-5-2 inferred"), 10u * 5);
  EXPECT_EQ(cells.at("table-5-3 inferred"), 3u * 3);
  EXPECT_EQ(cells.at("table-5-4 inferred"), 3u * 3);
  EXPECT_FALSE(cells.contains("table-5-3 twin+integral_per_period"));  // there is no integral in it
  for (const char* rig : {"inferred", "twin", "inferred+integral_per_period", "twin+integral_per_period"}) {
    EXPECT_EQ(cells.at(std::string("table-5-4 ") + rig), 3u * 3);
    EXPECT_EQ(cells.at(std::string("table-7-4 ") + rig), 5u);  // the true RMSE beside them
    EXPECT_EQ(cells.at(std::string("table-7-9 ") + rig), 3u);
  }
}

TEST(Reproduce, TheControllerIsNeverToldThePayload) {
  for (const ReproducibleTable& table : reproducible_tables())
    for (const ReproducedCase& c : table.cases(table.name))
      EXPECT_EQ(actuator(c.variant).nominal.payload_mass_kg, 0.0) << c.name;
}

TEST(Agreement, IsTheMeanAbsoluteLogarithmOfTheRatio) {
  const std::vector<Cell> cells = {chapter_6_cell("rmse_mm", 2.0, 2.0 * std::exp(0.5)),
                                   chapter_6_cell("rmse_mm", 3.0, 3.0 * std::exp(-0.1)),
                                   chapter_6_cell("mae_mm", 1.0, 1.0), chapter_6_cell("ssa_mm", 1.0, 9.0)};
  const std::vector<Agreement> all = agreements(cells);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_NEAR(all[0].mean_abs_ln, 0.3, 1e-12);
  EXPECT_EQ(all[0].cells, 2);
  EXPECT_EQ(all[1].mean_abs_ln, 0.0);
}

TEST(SelectTables, KeepsTheThesisOrderOnceEach) {
  const auto names = [](const std::vector<std::string>& asked) {
    std::vector<std::string> found;
    for (const ReproducibleTable& table : select_tables(asked)) found.push_back(table.name);
    return found;
  };
  EXPECT_THAT(names({"table-6-2", "table-5-2", "table-6-2"}), testing::ElementsAre("table-5-2", "table-6-2"));
  EXPECT_EQ(names({}), names({"all"}));
  EXPECT_GE(names({"all"}).size(), 5u);
}

TEST(SelectTables, RefusesAnUnknownNameWithTheAllowedOnes) {
  try {
    select_tables({"table-6-1", "table-9-9"});
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("'table-9-9'"));
    for (const ReproducibleTable& table : reproducible_tables()) EXPECT_THAT(error.what(), HasSubstr(table.name));
  }
}

TEST(ReproductionOutput, JsonKeepsNumbersBoundsAndWhatIsNotFinite) {
  Cell bound = chapter_6_cell("ssa_mm", 0.01, std::nan(""));
  bound.thesis->upper_bound = true;
  const std::vector<Cell> cells = {chapter_6_cell("rmse_mm", 0.5, 0.25), bound};
  const auto json = nlohmann::json::parse(result_of(cells).json());
  const auto& first = json.at("cells").at(0);
  EXPECT_EQ(first.at("table"), "table-6-1");
  EXPECT_EQ(first.at("parameters"), "consistent");
  EXPECT_EQ(first.at("case"), "a case");
  EXPECT_EQ(first.at("metric"), "rmse_mm");
  EXPECT_EQ(first.at("thesis"), 0.5);
  EXPECT_EQ(first.at("ours"), 0.25);
  EXPECT_FALSE(first.contains("thesis_bound"));
  EXPECT_EQ(json.at("cells").at(1).at("thesis"), 0.01);
  EXPECT_EQ(json.at("cells").at(1).at("thesis_bound"), "<");
  EXPECT_TRUE(json.at("cells").at(1).at("ours").is_null());
  EXPECT_NEAR(json.at("agreement").at(0).at("mean_abs_ln").get<double>(), std::log(2.0), 1e-12);
}

TEST(ReproductionOutput, CsvQuotesCasesAndHasOneLineACell) {
  Cell cell = chapter_6_cell("rmse_mm", 0.5, 0.25);
  cell.case_name = "thesis_pd, 0 kg";
  EXPECT_EQ(result_of(std::vector<Cell>{cell}).csv(),
            "table,parameters,case,metric,thesis_bound,thesis,ours,ours_spread,runs\n"
            "table-6-1,consistent,\"thesis_pd, 0 kg\",rmse_mm,,0.5,0.25,0,1\n");
}

TEST(ReproductionOutput, TextShowsBoundsAndWhatTheParametersAre) {
  Cell bound = chapter_6_cell("ssa_mm", 0.01, 0.004);
  bound.thesis->upper_bound = true;
  const std::string text = result_of(std::vector<Cell>{bound}).text(false);
  EXPECT_THAT(text, HasSubstr("<0.01"));
  EXPECT_THAT(text, HasSubstr(parameters_in_words("consistent")));
  EXPECT_NE(parameters_in_words("consistent"), parameters_in_words("printed"));
  EXPECT_NE(parameters_in_words("consistent"), parameters_in_words(continuous_flow));
}

TEST(ReproduceCommand, PrintsOneJsonObjectAndNothingElse) {
  const test::ProgramRun run = test::run_program({"reproduce", "table-6-2", "--format", "json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto json = nlohmann::json::parse(run.out);
  ASSERT_EQ(json.at("cells").size(), 4u * 6 * 2);
  for (const auto& cell : json.at("cells")) {
    EXPECT_EQ(cell.at("table"), "table-6-2");
    EXPECT_TRUE(cell.at("thesis").is_number());
    EXPECT_TRUE(cell.at("ours").is_number());
    for (const char* key : {"parameters", "case", "metric"}) EXPECT_TRUE(cell.at(key).is_string());
  }
  EXPECT_THAT(run.err, HasSubstr("24 runs"));
}

TEST(ReproduceCommand, RefusesUnknownNamesFormatsAndJobsInOneLine) {
  const test::ProgramRun table = test::run_program({"reproduce", "table-6-9"});
  EXPECT_EQ(table.exit_code, 2);
  EXPECT_EQ(table.out, "");
  EXPECT_THAT(table.err, HasSubstr("allowed: table-5-2, table-5-3, table-5-4, table-6-1, table-6-2, table-7-1"));
  EXPECT_EQ(std::count(table.err.begin(), table.err.end(), '\n'), 1);
  EXPECT_EQ(test::run_program({"reproduce", "table-6-2", "--format", "xml"}).exit_code, 2);
  EXPECT_EQ(test::run_program({"reproduce", "table-6-2", "--jobs", "0"}).exit_code, 2);
}

TEST(ReproduceCommand, AFullDiskIsAnErrorInOneLine) {
  const test::ProgramRun run = test::run_program({"reproduce", "table-6-2", "--format", "csv"}, "", "/dev/full");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("standard output: cannot be written"));
}

}  // namespace
}  // namespace solenoid
