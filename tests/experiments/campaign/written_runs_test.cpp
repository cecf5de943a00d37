#include "experiments/campaign/written_runs.hpp"

#include "experiments/report/comparison.hpp"
#include "tests/experiments/program_under_test.hpp"
#include "tests/experiments/synthetic_runs.hpp"

#include <gmock/gmock.h>

namespace solenoid {
namespace {

using testing::HasSubstr;

/// Records of two variants in 150 scenarios, in five shards.
struct SomeRuns {
  explicit SomeRuns(int shards = 5) { test::write_synthetic(campaign, folder.file("r"), shards); }

  test::Folder folder;
  Campaign campaign = test::synthetic_campaign({"thesis_pd", "nine_state"}, 150);
};

std::string text_of(const std::function<void(const TextSink&)>& write) {
  std::string text;
  write([&](std::string_view piece) { text += piece; });
  return text;
}

TEST(WrittenRuns, AreTheTextsOfAllRecordsAtOnce) {
  const SomeRuns some;
  StoredRuns kept(some.folder.file("r"), some.campaign);
  const SystemDescription& system = some.campaign.system->description();
  Json more = Json::object();
  const auto json = [&] { return text_of([&](const TextSink& write) { write_json(kept, more, write); }); };
  EXPECT_EQ(json(), result_of({}, false).json());
  kept.refresh();
  ASSERT_EQ(kept.count(StoredRuns::Ending::missing), 0u);
  std::vector<RunRecord> records;
  for (std::size_t i = 0; i < kept.size(); ++i) records.push_back(kept.read(i).record);
  EXPECT_EQ(json(), runs_json(records));
  more = result_of(table_of(kept, system)).facts;
  EXPECT_EQ(json(), result_of(records, false).json());
  EXPECT_EQ(text_of([&](const TextSink& write) { write_csv(kept, system, write); }), to_csv(records));
}

TEST(WrittenRuns, AreTheSameWhateverTheShards) {
  std::vector<std::string> texts;
  for (const int shards : {1, 2, 7}) {
    const SomeRuns some(shards);
    StoredRuns kept(some.folder.file("r"), some.campaign);
    kept.refresh();
    texts.push_back(
        text_of([&](const TextSink& write) { write_csv(kept, some.campaign.system->description(), write); }));
  }
  EXPECT_EQ(texts[0], texts[1]);
  EXPECT_EQ(texts[0], texts[2]);
}

TEST(StoredRuns, ReadOneByOneAndTogetherAreTheSame) {
  const SomeRuns some;
  StoredRuns kept(some.folder.file("r"), some.campaign);
  kept.refresh();
  std::vector<std::size_t> order;
  const auto unread = for_each_run(kept, [&](std::size_t run, const KeptRun& whole) {
    order.push_back(run);
    EXPECT_EQ(encode_run(whole), encode_run(kept.read(run)));
    EXPECT_EQ(encode_run(whole), encode_run(test::synthetic_run(some.campaign, run)));
  });
  EXPECT_TRUE(unread.empty());
  EXPECT_EQ(order.size(), kept.size());
  EXPECT_TRUE(std::ranges::is_sorted(order));
}

TEST(StoredRuns, WhatCannotBeReadAnyMoreIsSkippedAndTold) {
  const SomeRuns some(1);
  StoredRuns kept(some.folder.file("r"), some.campaign);
  kept.refresh();
  const std::string file = fmt::format("r/shards/{}.runs", Shard::of(1, 1).name());
  std::string bytes = test::text_of(some.folder / file);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] + 1);
  some.folder.write(file, bytes);
  std::size_t read = 0;
  const std::vector<UnreadRun> unread = for_each_run(kept, [&](std::size_t, const KeptRun&) { ++read; });
  ASSERT_EQ(unread.size(), 1u);
  EXPECT_EQ(read, kept.size() - 1);
  EXPECT_THAT(unread[0].reason, HasSubstr(file + ": is damaged at byte"));
  EXPECT_THROW(kept.read(unread[0].run), std::exception);
}

TEST(RunList, FindsARunByItsID) {
  const Campaign campaign = test::synthetic_campaign({"thesis_pd", "nine_state"}, 1200);
  for (const std::size_t i : {std::size_t{0}, std::size_t{1}, std::size_t{777}, campaign.runs.size() - 1})
    EXPECT_EQ(campaign.runs.find(campaign.runs[i].id), i);
  for (const char* none : {"", "sine", "sine-m001--thesis_pd", "sine-m001--thesis_pd--s2", "sine-m001--thesis_pd--s01",
                           "sine-m001--thesis_pd--s1x", "sine-m0001--thesis_pd--s1", "sine--thesis_pd--s1", "--s1",
                           "sine-m001--nobody--s1", "sine-m1201--thesis_pd--s1"})
    EXPECT_EQ(campaign.runs.find(none), std::nullopt) << none;
}

}  // namespace
}  // namespace solenoid
