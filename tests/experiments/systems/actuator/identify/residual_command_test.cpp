// `identify residual` as a program, on short logs of a slide whose friction is known: the file and its figures, --test,
// and every log that it must refuse without leaving a file.
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/reader.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/systems/actuator/identify/log_source.hpp"
#include "tests/experiments/program_under_test.hpp"
#include "tests/experiments/systems/actuator/identify/moved_slide.hpp"

#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using test::Folder;
using test::ProgramRun;
using test::run_program;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// More friction than is believed, or less: `sign` -1.
ForceResidual more_friction(double sign = 1.0) {
  ForceResidual g;
  g.velocity = HatSum(std::vector{-0.4, -0.3, -0.002, 0.0, 0.002, 0.3, 0.4},
                      std::vector{0.0, 2.5 * sign, 1.2 * sign, 0.0, -1.2 * sign, -2.5 * sign, 0.0});
  return g;
}

/// Of a slide that is what nine_robust believes but for `residual`, on the bench.
Record slide_record(const ForceResidual& residual) {
  ActuatorParameters believed = actuator(shipped_variant("nine_robust")).nominal;
  believed.plane = Plane::horizontal;
  return test::moved_slide(believed, residual, 2e-5);
}

/// Every `every`-th sample of the first `samples`.
Record part_of(const Record& whole, std::size_t samples, std::size_t every = 1) {
  Record r = whole;
  r.period_s = whole.period_s * static_cast<double>(every);
  const auto thin = [&](auto& signal) {
    std::size_t kept = 0;
    for (std::size_t t = 0; t < samples; t += every) signal[kept++] = signal[t];
    signal.resize(kept);
  };
  thin(r.position_m), thin(r.pressure_a_pa), thin(r.pressure_b_pa), thin(r.motor_n), thin(r.coils);
  return r;
}

std::string written(const Folder& folder, const std::string& name, const Record& record) {
  folder.write(name, record_csv(record));
  return "'" + name + "'";
}

/// What the program says to logs that it must refuse; no file is left.
std::string refusal(const Folder& folder, const std::string& arguments, const std::string& out = "found.toml") {
  const std::string said =
      test::refusal_of(folder, "identify residual " + arguments + " --plane horizontal --out " + out);
  EXPECT_FALSE(std::filesystem::exists(folder / out)) << arguments;
  return said;
}

nlohmann::json figures(const Folder& folder, const std::string& arguments) {
  const ProgramRun run =
      run_program(folder, "identify residual " + arguments + " --plane horizontal --out found.toml --format json");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return run.exit_code == 0 ? nlohmann::json::parse(run.out) : nlohmann::json();
}

/// The row of the output's table that begins so.
nlohmann::json row_of(const nlohmann::json& output, const std::string& quantity) {
  for (const nlohmann::json& row : output.at("residual"))
    if (row.at("quantity").get<std::string>().starts_with(quantity)) return row;
  return {};
}

TEST(IdentifyResidual, WritesTheFrictionThatIsThereAndAVariantTakesIt) {
  const Folder folder;
  const std::string log = written(folder, "a\"b.csv", slide_record(more_friction()));
  const nlohmann::json found = figures(folder, log);
  const nlohmann::json held = row_of(found, "force left"), ahead = row_of(found, "position after");
  EXPECT_LT(held.at("with"), 0.5 * held.at("without").get<double>());
  EXPECT_LT(ahead.at("with"), ahead.at("without"));
  EXPECT_GT(found.at("predictions"), 1000);
  EXPECT_GT(found.at("held_out_inside_95"), 0.8);
  const std::string text = test::text_of(folder / "found.toml");
  TableReader table = TableReader::from_text(text, "found.toml");
  EXPECT_EQ(table.table("identified").text("logs"), "a\"b.csv");
  const ForceResidual read = read_force_residual(table);
  for (const double v : {-0.05, -0.03, 0.03, 0.05})
    EXPECT_NEAR(read.force(0.05, v), more_friction().force(0.05, v), 0.4);
  // The same log gives the same file, and a variant of a campaign takes it.
  figures(folder, log);
  EXPECT_EQ(test::text_of(folder / "found.toml"), text);
  folder.write(
      "mine.toml",
      "variants = [\"mine\"]\n[[scenario]]\nname = \"c\"\nplant = \"twin\"\ntrajectory = { kind = \"cycloidal\" }\n"
      "[variant.mine]\nvalves = \"two_way\"\nsolver = \"branch_and_bound\"\nestimator = \"payload_ekf\"\n"
      "use_estimate = \"payload_and_disturbance\"\nresidual = \"found.toml\"\n");
  EXPECT_EQ(run_program(folder, "check mine.toml").exit_code, 0);
}

TEST(IdentifyResidual, JudgesPredictionsOnTheTestLog) {
  const Folder folder;
  const Record record = slide_record(more_friction());
  const std::string log = written(folder, "learned.csv", record),
                    other = written(folder, "other.csv", part_of(slide_record(more_friction(-1.0)), 3000));
  const nlohmann::json same = figures(folder, log);
  const std::string file = test::text_of(folder / "found.toml");
  const nlohmann::json tested = figures(folder, log + " --test " + other);
  EXPECT_EQ(test::text_of(folder / "found.toml"), file);  // nothing is learned from it
  EXPECT_LT(tested.at("predictions"), 300);
  EXPECT_GT(row_of(tested, "position after").at("with"), row_of(tested, "position after").at("without"));
  EXPECT_NE(row_of(tested, "position after").at("with"), row_of(same, "position after").at("with"));
  EXPECT_EQ(row_of(tested, "force left"), row_of(same, "force left"));
}

TEST(IdentifyResidual, SaysNoHeldOutFiguresOfAShortLog) {
  const Folder folder;
  const std::string log = written(folder, "short.csv", part_of(slide_record(more_friction()), 3500));
  const nlohmann::json found = figures(folder, log);
  EXPECT_TRUE(found.at("held_out_inside_95").is_null());
  EXPECT_TRUE(row_of(found, "force left").is_null());
  EXPECT_THAT(test::text_of(folder / "found.toml"), AllOf(HasSubstr("log_likelihood"), Not(HasSubstr("held_out"))));
}

TEST(IdentifyResidual, RefusesLogsOfAnotherTickWithoutAFile) {
  const Folder folder;
  const Record record = slide_record(more_friction());
  const std::string slow = written(folder, "slow.csv", part_of(record, record.size(), 2)),
                    log = written(folder, "log.csv", record);
  const auto wanted = AllOf(HasSubstr("slow.csv"), HasSubstr("at 2 ms"), HasSubstr("allowed: logs at the tick of"),
                            HasSubstr("'nine_robust', 1 ms"));
  EXPECT_THAT(refusal(folder, slow), wanted);
  EXPECT_THAT(refusal(folder, log + " --test " + slow), wanted);
  // Beside a log of the right tick it is learned from, and that nothing is predicted in it is said.
  const ProgramRun both =
      run_program(folder, "identify residual " + log + " " + slow + " --plane horizontal --out both.toml");
  EXPECT_EQ(both.exit_code, 0) << both.err;
  EXPECT_THAT(both.out, HasSubstr("1 of 2 records"));
}

TEST(IdentifyResidual, RefusesWhatPredictsWorse) {
  // The long log, in which nothing can be predicted, has the friction; the one that is predicted in has the opposite.
  const Folder folder;
  const Record record = slide_record(more_friction());
  const std::string slow = written(folder, "slow.csv", part_of(record, record.size(), 2)),
                    opposite = written(folder, "opposite.csv", part_of(slide_record(more_friction(-1.0)), 1500));
  EXPECT_THAT(refusal(folder, slow + " " + opposite),
              AllOf(HasSubstr("predicted no better"), HasSubstr("no file is written")));
}

TEST(IdentifyResidual, RefusesByName) {
  const Folder folder;
  const std::string log = written(folder, "log.csv", slide_record(more_friction()));
  EXPECT_THAT(refusal(folder, log + " --test none.csv"), HasSubstr("none.csv"));
  EXPECT_THAT(refusal(folder, "none.csv"), HasSubstr("none.csv"));
  EXPECT_THAT(refusal(folder, log, "found.txt"), AllOf(HasSubstr("found.txt"), HasSubstr("allowed: a file in .toml")));
  EXPECT_THAT(refusal(folder, log + " --variant nine_state"), HasSubstr("nine_state"));
  EXPECT_THAT(refusal(folder, written(folder, "brief.csv", part_of(slide_record(more_friction()), 1000))),
              AllOf(HasSubstr("brief.csv"), HasSubstr("allowed: 1.2 s")));
}

}  // namespace
}  // namespace solenoid
