#include "core/config/reader.hpp"
#include "core/systems/actuator/prestabilised.hpp"
#include "experiments/profile/profile_report.hpp"
#include "experiments/profile/record.hpp"
#include "experiments/profile/shipped_instances.hpp"
#include "solvers/search/branch_and_bound.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using nlohmann::json;
using test::Folder;
using test::ProgramRun;
using test::run_program;
using testing::HasSubstr;

/// Takes a factor longer than the solver it wraps, by spinning, where the model has the motor in the prediction.
class SlowInPrediction final : public SolverAround {
 public:
  SlowInPrediction(AnySolverPtr inner, double factor) : SolverAround(std::move(inner)), factor_(factor) {}

 private:
  SolveReport do_solve(const AnyProblem& problem, AnyPlan& plan, Deadline deadline) noexcept override {
    const auto begin = Deadline::Clock::now();
    const SolveReport report = inner_->solve(problem, plan, deadline);
    if (problem.model_type() != typeid(PrestabilisedActuator)) return report;
    const auto end =
        begin + std::chrono::duration_cast<Deadline::Clock::duration>(factor_ * (Deadline::Clock::now() - begin));
    while (Deadline::Clock::now() < end) {
    }
    return report;
  }

  double factor_;
};

/// The time of a phase, of a sample or of a variant's mean.
double us(const auto& timed, Phase phase) { return timed.phase_us[static_cast<std::size_t>(phase)]; }

AnySolverPtr slowed_in_prediction(AnySolverPtr solver) {
  return std::make_unique<SlowInPrediction>(std::move(solver), 1.5);
}

/// The shipped instances of three variants, every seventh of them.
InstanceSet some_instances() {
  InstanceSet set = parse_instances(shipped_instance_bytes(), "shipped");
  std::erase_if(set.variants, [](const VariantInstances& v) {
    return v.name != "thesis_pd" && v.name != "nine_pd" && v.name != "nine_state_2";
  });
  for (VariantInstances& v : set.variants) {
    std::vector<InstanceRecord> some;
    for (std::size_t i = 0; i < v.records.size(); i += 7) some.push_back(v.records[i]);
    v.records = some;
  }
  return set;
}

/// Whether the gate, after one run of a build, lets a second run pass and flags the one slowed solver and no other.
bool gate_tells_apart(const InstanceSet& set) {
  const Profile first = profile_instances(set, {}), second = profile_instances(set, {});
  if (compare_profiles(second, first, "first", 1.2).slower()) return false;
  ProfileOptions slowed;
  slowed.decorate = slowed_in_prediction;
  const ProfileChange change = compare_profiles(profile_instances(set, slowed), first, "first", 1.2);
  for (const VariantChange& c : change.variants) {
    EXPECT_LE(c.typical.low, c.typical.ratio);
    EXPECT_LE(c.typical.ratio, c.typical.high);
    if (c.slower != (c.name == "nine_state_2")) return false;
  }
  return true;
}

TEST(Profile, TwoRunsOfOneBuildAreNotFlaggedAndASolverSlowedByHalfIs) {
  const InstanceSet set = some_instances();
  bool told = false;  // a machine busy with other work may really be slower in one run: what counts is a quiet moment
  for (int attempt = 0; attempt < 6 && !told; ++attempt) told = gate_tells_apart(set);
  EXPECT_TRUE(told);
}

TEST(Profile, CountsWhatItReplays) {
  const InstanceSet set = some_instances();
  ProfileOptions options;
  options.passes = 2;
  options.limit_ms = 1e-4;
  const Profile profile = profile_instances(set, options);
  ASSERT_EQ(profile.variants.size(), 3u);
  for (const VariantProfile& v : profile.variants) {
    EXPECT_EQ(v.solve_us.size(), 100u);
    EXPECT_EQ(v.passes, 2);
    EXPECT_EQ(v.plans_as_recorded, 100u);
    EXPECT_EQ(v.proven_fraction, 1.0);
    EXPECT_EQ(v.limit_misses, 100) << "every solve takes more than 0.1 us";
    EXPECT_LE(v.time_us.p50, v.time_us.p90);
    EXPECT_LE(v.time_us.p999, v.time_us.max);
    EXPECT_LE(v.time_us.p50, v.one_pass_us.p50);
    EXPECT_GT(us(v, Phase::rollout), 0.0);
    EXPECT_EQ(us(v, Phase::bound) > 0, v.name == "nine_state_2");
    std::size_t binned = 0;
    for (const std::size_t n : v.histogram) binned += n;
    EXPECT_EQ(binned, 100u);
  }
}

TEST(Profile, PhasesAreWithinTheSolveAndOffLeavesThemAlone) {
  const InstanceSet set = some_instances();
  const VariantInstances& variant = set.variants.back();
  ASSERT_EQ(variant.name, "nine_state_2");
  const auto replay = make_replay(set, variant, measured_us_per_phase_tick());
  std::vector<ReplaySample> samples(variant.records.size());
  replay->pass(true, samples);
  const std::vector<std::int64_t> nodes(replay->nodes().begin(), replay->nodes().end());
  double phases = 0, whole = 0;
  for (const ReplaySample& s : samples) phases += us(s, Phase::rollout) + us(s, Phase::bound), whole += s.time_us;
  EXPECT_GT(phases, 0.2 * whole);
  EXPECT_LT(phases, 1.5 * whole);  // two clocks, and a busy machine may stop the program between their readings
  replay->pass(false, samples);
  for (const ReplaySample& s : samples) EXPECT_EQ(s.phase_us, (std::array<double, phase_count>{}));
  EXPECT_TRUE(std::equal(nodes.begin(), nodes.end(), replay->nodes().begin()));
}

/// Solvers inside of solvers tell where their time goes, through whatever is around them.
TEST(Profile, RelaxedAndRoundedVariantsHavePhasesToo) {
  const Folder folder;
  const Campaign campaign = read_campaign(folder.write("relaxed.toml", R"(
variants = ["relaxed_pwm", "sum_up_rounding", "joint"]
[[scenario]]
name       = "quick"
trajectory = { kind = "cycloidal", move_s = 0.2, dwell_s = 0.1 }
)"));
  const InstanceSet set = record_instances(campaign, 10);
  ProfileOptions options;
  options.passes = 1;
  options.decorate = slowed_in_prediction;
  for (const VariantProfile& v : profile_instances(set, options).variants) {
    EXPECT_TRUE(v.has_phases) << v.name;
    EXPECT_GT(us(v, Phase::rollout), 0.0) << v.name;
    EXPECT_GT(us(v, Phase::derivatives), 0.0) << v.name;
    EXPECT_EQ(us(v, Phase::factorisation) > 0.0, v.name == "relaxed_pwm") << v.name;
    EXPECT_EQ(us(v, Phase::bound), 0.0) << v.name;
  }
}

Profile synthetic(const std::vector<double>& times) {
  Profile p;
  p.variants.emplace_back();
  p.variants[0].name = "v";
  p.variants[0].fingerprint = "f";
  p.variants[0].solve_us = times;
  return p;
}

TEST(Profile, RatiosAreThoseOfTheTimes) {
  std::vector<double> then, now, tail;
  for (int i = 0; i < 1000; ++i) {
    then.push_back(10.0 + 0.01 * i);
    now.push_back(1.3 * then.back() * (i % 2 ? 1.1 : 1 / 1.1));
    tail.push_back(i >= 950 ? 2 * then.back() : then.back());
  }
  const VariantChange even = compare_profiles(synthetic(now), synthetic(then), "x", 1.2).variants[0];
  EXPECT_NEAR(even.typical.ratio, 1.3, 1e-9);
  EXPECT_NEAR(even.typical.low, 1.3 * std::exp(-1.96 * std::log(1.1) / std::sqrt(1000.0)), 0.002);
  EXPECT_NEAR(even.typical.high, 1.3 * std::exp(1.96 * std::log(1.1) / std::sqrt(1000.0)), 0.002);
  EXPECT_TRUE(even.slower);
  EXPECT_FALSE(compare_profiles(synthetic(now), synthetic(then), "x", 1.5).slower());
  const VariantChange rare = compare_profiles(synthetic(tail), synthetic(then), "x", 1.2).variants[0];
  EXPECT_LT(rare.typical.high, 1.1);
  EXPECT_TRUE(rare.slower) << "a tail twice as long";
  EXPECT_FALSE(compare_profiles(synthetic(then), synthetic(tail), "x", 1.2).slower()) << "faster is no regression";
}

TEST(Profile, AProfileOfOtherInstancesIsRefused) {
  Profile other = synthetic({1, 2, 3});
  other.variants[0].fingerprint = "g";
  EXPECT_THROW(compare_profiles(synthetic({1, 2, 3}), other, "x", 1.2), ConfigError);
  other.variants[0].name = "w";
  EXPECT_THROW(compare_profiles(synthetic({1, 2, 3}), other, "x", 1.2), ConfigError);
}

TEST(Profile, JsonCsvAndTheGateOfTheProgram) {
  const Folder folder;
  const std::string some = "profile --variant thesis_pd,nine_pd --passes 80 ";
  const ProgramRun saved = run_program(folder, some + "--save then.json --format json");
  ASSERT_EQ(saved.exit_code, 0) << saved.err;
  const json out = json::parse(saved.out);
  ASSERT_EQ(out.at("variants").size(), 2u);
  for (const char* key : {"p50_us", "p90_us", "p99_us", "p999_us", "max_us", "misses", "estimate_us", "prepare_us",
                          "rollout_us", "bound_us", "other_us", "timing_overhead_percent", "histogram"})
    EXPECT_TRUE(out.at("variants")[0].contains(key)) << key;
  EXPECT_EQ(out.at("variants")[0].at("name"), "thesis_pd");
  EXPECT_EQ(out.at("variants")[0].at("instances"), 700);
  EXPECT_FALSE(out.at("variants")[0].contains("solve_us"));

  // Factors far beyond what a busy machine does to a run: the gate's statistics have tests without a clock.
  EXPECT_EQ(run_program(folder, some + "--against then.json --threshold 8").exit_code, 0);
  json then = json::parse(test::text_of(folder.file("then.json")));
  for (json& t : then.at("variants")[1].at("solve_us")) t = t.get<double>() / 30;
  folder.write("fast.json", then.dump());
  const ProgramRun flagged = run_program(folder, some + "--against fast.json --threshold 8 --format csv");
  EXPECT_EQ(flagged.exit_code, 1);
  EXPECT_THAT(flagged.err, HasSubstr("nine_pd is slower"));
  EXPECT_THAT(flagged.err, testing::Not(HasSubstr("thesis_pd is slower")));
  const auto rows = test::read_csv(flagged.out);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[1].at("name"), "nine_pd");
  EXPECT_EQ(run_program(folder, some + "--against fast.json --threshold 90").exit_code, 0);
  for (const char* text : {"{", "{}", "{\"format\":\"solenoid-profile-1\",\"variants\":[{\"name\":1}]}"}) {
    folder.write("bad.json", text);
    const ProgramRun bad = run_program(folder, some + "--against bad.json");
    EXPECT_EQ(bad.exit_code, 2) << text;
    EXPECT_THAT(bad.err, HasSubstr("what profile --save wrote"));
  }
}

TEST(Profile, RecordsACampaignAndReplaysTheFile) {
  const Folder folder;
  folder.write("c.toml", test::small_campaign);
  const ProgramRun recorded =
      run_program(folder, "profile c.toml --record c.instances --per-variant 40 --passes 1 --format json");
  ASSERT_EQ(recorded.exit_code, 0) << recorded.err;
  const ProgramRun replayed = run_program(folder, "profile --instances c.instances --passes 1 --format json");
  ASSERT_EQ(replayed.exit_code, 0) << replayed.err;
  const json a = json::parse(recorded.out).at("variants"), b = json::parse(replayed.out).at("variants");
  ASSERT_EQ(a.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(a[i].at("instances_fingerprint"), b[i].at("instances_fingerprint"));
    EXPECT_EQ(b[i].at("plans_as_recorded"), b[i].at("instances"));
  }
}

TEST(Profile, BadInstanceFilesAreOneLineAndExitTwo) {
  const Folder folder;
  const std::string whole(shipped_instance_bytes());
  std::string version = whole;
  version[8] = 7;
  for (const auto& [name, text] : {std::pair<std::string, std::string>{"empty", ""},
                                   {"text", "hello\n"},
                                   {"half", whole.substr(0, 300000)},
                                   {"version", version}}) {
    folder.write(name, text);
    const ProgramRun ended = run_program(folder, "profile --instances " + name);
    EXPECT_EQ(ended.exit_code, 2) << name;
    EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
    EXPECT_THAT(ended.err, HasSubstr(name + ": "));
    EXPECT_EQ(ended.out, "");
  }
  EXPECT_EQ(run_program(folder, "profile --instances missing").exit_code, 2);
  EXPECT_EQ(run_program(folder, "profile --variant none").exit_code, 2);
  EXPECT_EQ(run_program(folder, "profile --core 1000").exit_code, 2);
  EXPECT_EQ(run_program(folder, "profile --svg x.svg").exit_code, 2);
  EXPECT_EQ(run_program(folder, "profile --record /nowhere/x --variant thesis_pd --passes 1").exit_code, 2);
}

TEST(Profile, TheQualityCurveEndsProvenAndIsDrawn) {
  const Folder folder;
  folder.write("c.toml", test::small_campaign);
  const ProgramRun ended =
      run_program(folder,
                  "profile c.toml --variant nine_state --scenario step --per-variant 10 --passes 1 "
                  "--budget 0.001,1000 --svg q.svg --format json");
  ASSERT_EQ(ended.exit_code, 0) << ended.err;
  const json quality = json::parse(ended.out).at("quality");
  ASSERT_EQ(quality.size(), 2u);
  EXPECT_EQ(quality[1].at("proven_optimal_fraction"), 1.0);
  EXPECT_LT(quality[0].at("proven_optimal_fraction"), 0.5);
  EXPECT_GT(quality[0].at("rmse_mm"), 0.0);
  const std::string svg = test::text_of(folder.file("q.svg"));
  EXPECT_THAT(svg, HasSubstr("</svg>"));
  EXPECT_THAT(svg, HasSubstr("nine_state"));
  EXPECT_THAT(svg, HasSubstr("proven optimal"));
}

}  // namespace
}  // namespace solenoid
