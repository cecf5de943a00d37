#include "experiments/campaign/stored_runs.hpp"

#include "experiments/base/bytes.hpp"
#include "experiments/base/files.hpp"
#include "experiments/campaign/shard_scratch.hpp"
#include "tests/experiments/campaign/mixed_campaign.hpp"
#include "tests/experiments/program_under_test.hpp"

#include <map>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using test::mixed_campaign;
using testing::ElementsAre;
using testing::HasSubstr;
using Ending = StoredRuns::Ending;

KeptRun kept_run(const Campaign& campaign, std::size_t index, const std::string& status = "ok", double error = 1.0) {
  const CampaignRun run = campaign.runs[index];
  Metrics metrics;
  for (const MetricColumn& metric : campaign.system->description().metrics) metrics.set(metric.key, error);
  metrics.solve_us = {1.5, 2.5, 3.5, 4.5, 5.5};
  metrics.deadline_misses = 3;
  KeptRun kept{run.hash, record_of(campaign, run, metrics), 0.25, {}};
  if (status != "ok") {
    kept.record.status = status;
    kept.record.metrics.reset();
  } else {
    kept.solves.add(3.0);
    kept.solves.add(4000.0);
  }
  return kept;
}

TEST(ShardFile, ARunComesBackAsItWas) {
  const Campaign campaign = mixed_campaign();
  const WritingSession session = decode_session(encode_session(session_of(campaign)));
  for (const char* status : {"ok", "unstable", "failed: \"quotes\"\nand lines"}) {
    const KeptRun run = kept_run(campaign, 5, status, 0.1 + 0.2);
    const std::string bytes = encode_run(run);
    const KeptRun back = decode_run(bytes, session);
    EXPECT_EQ(to_json(back.record), to_json(run.record));
    EXPECT_EQ(back.configuration, campaign.runs[5].hash);
    EXPECT_EQ(back.wall_s, 0.25);
    EXPECT_EQ(back.solves.first, run.solves.first);
    EXPECT_EQ(back.solves.counts, run.solves.counts);
    for (std::size_t cut = 0; cut < bytes.size(); ++cut)
      EXPECT_THROW(decode_run(std::string_view(bytes).substr(0, cut), session), std::invalid_argument) << cut;
    EXPECT_THROW(decode_run(bytes + "x", session), std::invalid_argument);
  }
}

TEST(ShardFile, ASessionOfAnotherFormatIsRefused) {
  const std::string text = encode_session(session_of(mixed_campaign()));
  for (const auto& [from, to] : std::map<std::string, std::string>{
           {"\"format\":1", "\"format\":2"}, {"solve_us_p50", "solve_us_p51"}, {"began_ms", "begin"}, {"{", "["}}) {
    std::string changed = text;
    changed.replace(changed.find(from), from.size(), to);
    EXPECT_THROW(decode_session(changed), std::invalid_argument) << from;
  }
}

/// A folder with shards, and what is counted of it.
class Store : public testing::Test {
 protected:
  Store() : campaign_(mixed_campaign()) { std::filesystem::create_directory(folder_.file("shards")); }

  std::string file(const std::string& name) const { return folder_.file("shards/" + name); }
  void write(const std::string& name, const std::vector<KeptRun>& runs, std::int64_t began_ms = 1,
             const std::string& maker = "") const {
    WritingSession session = session_of(campaign_);
    session.began_ms = began_ms;
    if (!maker.empty()) session.maker = maker;
    ShardWriter writer(file(name), session);
    for (const KeptRun& run : runs) writer.add(encode_run(run), "trace of " + run.record.scenario);
  }
  StoredRuns stored() const {
    StoredRuns runs(folder_.path(), campaign_);
    runs.refresh();
    return runs;
  }

  test::Folder folder_;
  Campaign campaign_;
};

TEST_F(Store, CutAtAnyByteEachWholeRunCountsOnce) {
  write("1-of-2", {kept_run(campaign_, 0), kept_run(campaign_, 3), kept_run(campaign_, 7)});
  const std::string bytes = test::text_of(file("1-of-2.runs"));
  std::size_t before = 0, cuts_told = 0;
  for (std::size_t cut = 0; cut <= bytes.size(); ++cut) {
    std::ofstream(file("1-of-2.runs"), std::ios::binary) << bytes.substr(0, cut);
    const StoredRuns runs = stored();
    const std::size_t there = runs.count(Ending::ok);
    ASSERT_EQ(there + runs.count(Ending::missing), campaign_.runs.size());
    ASSERT_TRUE(there == before || there == before + 1) << cut;
    cuts_told += !runs.damage().empty();
    before = there;
  }
  EXPECT_EQ(before, 3u);
  EXPECT_EQ(cuts_told, bytes.size() - 4) << "all but the ends of session and runs";
  // The whole file beside any part of it: nothing twice.
  for (std::size_t cut = 0; cut <= bytes.size(); cut += 7) {
    std::ofstream(file("copy.runs"), std::ios::binary) << bytes.substr(0, cut);
    ASSERT_EQ(stored().count(Ending::ok), 3u) << cut;
  }
  std::ofstream(file("copy.runs"), std::ios::binary) << bytes << bytes;
  const StoredRuns runs = stored();
  EXPECT_EQ(runs.count(Ending::ok), 3u);
  EXPECT_EQ(runs.copies(), 6u);
}

TEST_F(Store, OthersRunsDoNotCountAndAreTold) {
  write("1-of-2", {kept_run(campaign_, 0)});
  write("2-of-2", {kept_run(campaign_, 1)}, 1, "another program");
  KeptRun changed = kept_run(campaign_, 2);
  changed.configuration = "0123456789abcdef";
  KeptRun foreign = kept_run(campaign_, 2);
  foreign.record.scenario = "elsewhere";
  write("other", {changed, foreign});
  const StoredRuns runs = stored();
  EXPECT_EQ(runs.count(Ending::ok), 1u);
  EXPECT_TRUE(runs.has(0));
  EXPECT_THAT(runs.strangers(), ElementsAre(HasSubstr("2-of-2.runs: 1 run of another program or other plug-ins"),
                                            HasSubstr("other.runs: 2 runs of another campaign")));
  EXPECT_TRUE(runs.damage().empty());
}

TEST_F(Store, OfTwoRecordsTheLaterCountsAndAFailedOneOnlyAlone) {
  write("a", {kept_run(campaign_, 0, "ok", 1.0), kept_run(campaign_, 1, "failed: crash"), kept_run(campaign_, 2)}, 20);
  write("b", {kept_run(campaign_, 0, "ok", 2.0), kept_run(campaign_, 1, "ok", 5.0)}, 10);
  write("c",
        {kept_run(campaign_, 2, "failed: later"), kept_run(campaign_, 3, "failed: too"),
         kept_run(campaign_, 4, "unstable")},
        30);
  const StoredRuns runs = stored();
  EXPECT_EQ(runs.read(0).record.metrics->number("rmse_mm"), 1.0) << "of the later session, though read first";
  EXPECT_EQ(runs.ending(1), Ending::ok);
  EXPECT_EQ(runs.ending(2), Ending::ok);
  EXPECT_EQ(runs.ending(3), Ending::failed);
  EXPECT_EQ(runs.read(3).record.status, "failed: too");
  EXPECT_EQ(runs.ending(4), Ending::unstable);
  EXPECT_EQ(runs.trace(0), "trace of many-m001");
}

TEST_F(Store, RunsOfASessionThatIsNotUnderstoodDoNotCount) {
  write("a", {kept_run(campaign_, 0)});
  std::string later = encode_session(session_of(campaign_));
  later.replace(later.find("\"format\":1"), 10, "\"format\":2");
  {
    FrameWriter frames(file("b.runs"));
    frames.append("S" + later);
    frames.append(encode_frame({crc32(later), no_trace, 0, encode_run(kept_run(campaign_, 1))}));
    frames.append(encode_frame({crc32("of nobody"), no_trace, 0, encode_run(kept_run(campaign_, 2))}));
  }
  const StoredRuns runs = stored();
  EXPECT_EQ(runs.count(Ending::ok), 1u);
  EXPECT_THAT(runs.damage(), ElementsAre(HasSubstr("b.runs: ")));
}

TEST_F(Store, AFileThatIsReplacedUnderTheReaderIsFoundOut) {
  write("a", {kept_run(campaign_, 0), kept_run(campaign_, 3)});
  write("b", {kept_run(campaign_, 3), kept_run(campaign_, 0)});
  const std::string other = test::text_of(file("b.runs")), other_traces = test::text_of(file("b.traces"));
  for (const char* name : {"b.runs", "b.traces"}) std::filesystem::remove(file(name));
  StoredRuns runs = stored();
  ASSERT_EQ(runs.trace(0), "trace of many-m001");
  std::ofstream(file("b.traces"), std::ios::binary) << other_traces;
  std::filesystem::rename(file("b.traces"), file("a.traces"));
  EXPECT_NO_THROW(runs.trace(0)) << "of one scenario, with the same trace";
  std::ofstream(file("b.runs"), std::ios::binary) << other;
  std::filesystem::rename(file("b.runs"), file("a.runs"));  // of the same length
  EXPECT_THROW(runs.read(0), ConfigError);
  StoredRuns::Reader reader(runs);
  EXPECT_THROW(reader.read(3), ConfigError);
  EXPECT_TRUE(runs.refresh());
  EXPECT_EQ(runs.read(0).configuration, campaign_.runs[0].hash);
  EXPECT_EQ(runs.read(3).configuration, campaign_.runs[3].hash);
  std::filesystem::remove(file("a.runs"));
  std::filesystem::resize_file(file("a.traces"), 3);
  EXPECT_THROW(runs.trace(0), ConfigError);
}

TEST_F(Store, ATraceOfAnotherRunIsNotBelieved) {
  WritingSession session = session_of(campaign_);
  for (const char* name : {"a", "b"}) ShardWriter(file(name), session).add(encode_run(kept_run(campaign_, 0)), name);
  std::filesystem::rename(file("b.traces"), file("a.traces"));
  std::filesystem::remove(file("b.runs"));
  const StoredRuns runs = stored();
  ASSERT_TRUE(runs.traced(0));
  try {
    runs.trace(0);
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("a.traces: the trace at byte 0 is not that of its run (allowed: "));
  }
}

TEST_F(Store, WhatAProcessPutsBackLeavesWhatAnotherPutThere) {
  {
    ShardScratch first(folder_.file("near"), file("1-of-2")), second(folder_.file("near too"), file("1-of-2"));
    const auto do_runs = [&](const ShardScratch& scratch, const std::vector<std::size_t>& runs) {
      ShardWriter writer(scratch.path(), session_of(campaign_));
      for (const std::size_t run : runs)
        writer.add(encode_run(kept_run(campaign_, run)), "trace of " + std::to_string(run));
    };
    do_runs(first, {0});
    do_runs(second, {1, 5});
    second.put_back(true);
    EXPECT_EQ(stored().count(Ending::ok), 2u);
    first.put_back(true);
  }
  const StoredRuns runs = stored();
  for (const std::size_t run : {0u, 1u, 5u}) EXPECT_EQ(runs.trace(run), "trace of " + std::to_string(run));
  EXPECT_EQ(runs.count(Ending::ok), 3u);
  EXPECT_TRUE(std::filesystem::is_empty(folder_.file("near")));
  EXPECT_EQ(runs.files(), 1u);
}

TEST_F(Store, WhatAnEarlierProcessLeftOnANodeIsTakenUp) {
  {
    const ShardScratch killed(folder_.file("near"), file("1-of-2"));
    EXPECT_FALSE(killed.left_before());
    ShardWriter(killed.path(), session_of(campaign_)).add(encode_run(kept_run(campaign_, 4)));
  }
  ShardScratch next(folder_.file("near"), file("1-of-2"));
  ASSERT_TRUE(next.left_before());
  StoredRuns runs(folder_.path(), campaign_);
  runs.add_file(next.path());
  EXPECT_TRUE(runs.has(4));
  const ShardScratch beside(folder_.file("near"), file("1-of-2"));  // the same shard at the same time
  EXPECT_NE(beside.path(), next.path());
  EXPECT_FALSE(beside.left_before());
  ShardScratch nowhere(folder_.file("near"), folder_.file("gone/shards/1-of-2"));
  ShardWriter(nowhere.path(), session_of(campaign_)).add(encode_run(kept_run(campaign_, 4)));
  try {
    nowhere.put_back(true);
    FAIL();
  } catch (const OutputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("what was done is in " + nowhere.path() + ".runs on "));
  }
  EXPECT_TRUE(std::filesystem::exists(nowhere.path() + ".runs"));
  std::filesystem::remove(nowhere.path() + ".runs");  // as those do who tidy up
  EXPECT_THROW(nowhere.put_back(true), OutputError);
  EXPECT_NO_THROW(nowhere.put_back(false));
}

TEST_F(Store, WhatIsPutBackGoesBesideAFileThatSomebodyIsWriting) {
  ShardWriter other(file("1-of-2"), session_of(campaign_));
  other.add(encode_run(kept_run(campaign_, 0)), "a trace");
  ShardScratch scratch(folder_.file("near"), file("1-of-2"));
  ShardWriter(scratch.path(), session_of(campaign_)).add(encode_run(kept_run(campaign_, 1)), "another");
  scratch.put_back(true);
  other.add(encode_run(kept_run(campaign_, 2)), "a third");
  const StoredRuns runs = stored();
  EXPECT_EQ(runs.count(Ending::ok), 3u);
  EXPECT_EQ(runs.trace(1), "another");
  EXPECT_EQ(runs.trace(2), "a third");
}

TEST_F(Store, ADamagedTraceCostsItsRunAndNothingElse) {
  ShardScratch scratch(folder_.file("near"), file("1-of-2"));
  {
    ShardWriter writer(scratch.path(), session_of(campaign_));
    for (const std::size_t run : {0u, 1u, 2u}) writer.add(encode_run(kept_run(campaign_, run)), std::string(50, 'x'));
  }
  std::string traces = test::text_of(scratch.path() + ".traces");
  traces[traces.size() / 2] = 'y';
  std::ofstream(scratch.path() + ".traces", std::ios::binary) << traces;
  scratch.put_back(true);
  const StoredRuns runs = stored();
  EXPECT_EQ(runs.count(Ending::ok), 2u);
  EXPECT_FALSE(runs.has(1));
}

TEST_F(Store, APlaceThatSomebodyElsePreparedIsNotUsed) {
  const std::string first = ShardScratch(folder_.file("near"), file("1-of-2")).path();
  const std::filesystem::path place = std::filesystem::path(first).parent_path();
  const auto expect_another = [&](const char* what) {
    const ShardScratch scratch(folder_.file("near"), file("1-of-2"));
    EXPECT_NE(std::filesystem::path(scratch.path()).parent_path(), place) << what;
  };
  std::filesystem::create_directory_symlink(folder_.path(), place);
  expect_another("a link");
  std::filesystem::remove(place);
  std::filesystem::create_directory(place);
  std::filesystem::permissions(place, std::filesystem::perms::all);
  expect_another("open to all");
}

TEST_F(Store, ARunIsTakenUpWhenItComes) {
  StoredRuns runs(folder_.path(), campaign_);
  EXPECT_FALSE(runs.refresh());
  ShardWriter writer(file("all"), session_of(campaign_));
  EXPECT_FALSE(runs.refresh());
  writer.add(encode_run(kept_run(campaign_, 4)));
  EXPECT_TRUE(runs.refresh());
  EXPECT_TRUE(runs.has(4));
  EXPECT_FALSE(runs.traced(4));
  writer.add(encode_run(kept_run(campaign_, 4)), "its trace");  // as of the worst
  EXPECT_TRUE(runs.refresh());
  EXPECT_EQ(runs.trace(4), "its trace");
  EXPECT_FALSE(runs.refresh());
  StoredRuns anew(folder_.path(), campaign_);
  anew.leave_aside();
  EXPECT_FALSE(anew.has(4));
  writer.add(encode_run(kept_run(campaign_, 5)));
  EXPECT_TRUE(anew.refresh());
  EXPECT_FALSE(anew.has(4));
  EXPECT_TRUE(anew.has(5));
}

}  // namespace
}  // namespace solenoid
