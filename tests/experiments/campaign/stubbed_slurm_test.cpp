// What is made of Slurm's answers, by programs in its place that give whatever answer a test wants. The real thing:
// tests/cluster.
#include "tests/experiments/program_under_test.hpp"

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid::test {
namespace {

using testing::HasSubstr;

class StubbedSlurm : public testing::Test {
 protected:
  StubbedSlurm() {
    folder_.write("c.toml", small_campaign);
    folder_.write_script("scontrol", "echo 'MaxArraySize            = 1001'\n");
    folder_.write_script("scancel", "echo $* >>cancelled\n");
    submits("n=$(cat count 2>/dev/null || echo 100); echo $((n + 1)) >count; cat count");
    tells("echo 'slurm_load_jobs error: Invalid job id specified'; exit 1");
  }
  void submits(const std::string& script) const {
    folder_.write_script("sbatch", "cd '" + folder_.path() + "'; echo $* >>submitted\n" + script + "\n");
  }
  void tells(const std::string& script) const { folder_.write_script("squeue", script + "\n"); }
  ProgramRun compare(const std::string& more = "") const {
    return run_program(folder_, "compare c.toml --slurm --nodes 2 --out out " + more, "PATH=\"$PWD:$PATH\"");
  }
  /// How often sbatch was called.
  std::size_t submissions() const {
    const std::string text = text_of(folder_.file("submitted"));
    return static_cast<std::size_t>(std::ranges::count(text, '\n'));
  }

  Folder folder_;
};

TEST_F(StubbedSlurm, TheJobIsFoundAmongWhatASiteSays) {
  submits("echo 'sbatch: lua: welcome to 3 clusters' >&2; echo '101;cluster'; echo 'sbatch: 7 hours are left' >&2");
  const ProgramRun run = compare();
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("array job 101, finishing job 101\n"));
  EXPECT_EQ(nlohmann::json::parse(text_of(folder_.file("out/slurm/jobs.json"))).at("arrays").at(0).at("id"), 101);
  submits("echo 'sbatch: error: Invalid account'; exit 1");
  const ProgramRun refused = run_program(folder_, "compare c.toml --slurm --out other", "PATH=\"$PWD:$PATH\"");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("array-0.sh: sbatch: error: Invalid account\n"));
}

TEST_F(StubbedSlurm, NothingIsSubmittedWhileItIsNotKnownWhatIsAtWork) {
  ASSERT_EQ(compare().exit_code, 0);
  ASSERT_EQ(submissions(), 2u);
  tells("echo 'Unable to contact slurm controller' >&2; exit 1");
  const ProgramRun run = compare();
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("squeue does not tell what is at work: Unable to contact slurm controller\n"));
  EXPECT_EQ(submissions(), 2u);
  tells("printf '101|1|RUNNING|n1|0|None|\\n101|2|STAGE_OUT|n2|1|None|\\n'");
  EXPECT_THAT(compare().err, HasSubstr("nothing to submit; solenoid status out"));
  EXPECT_EQ(submissions(), 2u);
  tells("printf '101|1|RUNNING|n1|0|None|\\n101|2|TIMEOUT|n2|1|None|\\n'");
  EXPECT_THAT(compare().err, HasSubstr("1 of 2 shards to submit, 1 at work"));
  EXPECT_EQ(text_of(folder_.file("cancelled")), "102\n") << "the finishing job before";
}

TEST_F(StubbedSlurm, ASubmissionThatBrokeOffIsFinished) {
  submits("case $* in *finish.sh) exit 1;; *) echo 101;; esac");
  EXPECT_EQ(compare().exit_code, 2);
  tells("printf '101|1|RUNNING|n1|0|None|\\n101|2|PENDING||0|Priority|\\n'");
  submits("echo 105");
  const ProgramRun run = compare();
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.out, "finishing job 105\nResults: out\n");
  EXPECT_THAT(text_of(folder_.file("submitted")), HasSubstr("--dependency=afterany:101 "));
  EXPECT_THAT(compare().err, HasSubstr("nothing to submit"));
}

TEST_F(StubbedSlurm, ADryRunShowsScriptsWithoutAClusterAndRefusesWhatIsWrongAllTheSame) {
  ASSERT_EQ(compare().exit_code, 0);
  const ProgramRun parted =
      run_program(folder_, "compare c.toml --slurm --dry-run --nodes 3 --out out", "PATH=\"$PWD:$PATH\"");
  EXPECT_EQ(parted.exit_code, 2);
  EXPECT_THAT(parted.err, HasSubstr("--nodes: out is parted into 2 already (allowed: 2, or a new folder)"));
  folder_.write_script("scontrol", "echo 'no controller'; exit 1\n");
  const ProgramRun shown = compare("--dry-run");
  EXPECT_EQ(shown.exit_code, 0);
  EXPECT_THAT(shown.err, HasSubstr("scontrol does not reach the cluster: no controller; all shards are shown"));
  EXPECT_THAT(shown.out, HasSubstr("#SBATCH --array=1-2\n"));
  EXPECT_EQ(submissions(), 2u);
}

}  // namespace
}  // namespace solenoid::test
