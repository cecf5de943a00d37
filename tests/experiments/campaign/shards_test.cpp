#include "experiments/campaign/shards.hpp"

#include "core/config/reader.hpp"
#include "tests/experiments/campaign/mixed_campaign.hpp"

#include <algorithm>
#include <cstdlib>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace solenoid {
namespace {

using test::campaign_from;
using test::mixed_campaign;

TEST(Shards, AreAPartitionThatDealsEveryClassEvenly) {
  const Campaign campaign = mixed_campaign();
  for (const int count : {1, 2, 3, 7, 40, 198, 300}) {
    std::vector<int> owners(campaign.runs.size());
    std::map<std::pair<std::size_t, bool>, std::pair<std::size_t, std::size_t>> dealt;  // least and most of a class
    for (int index = 1; index <= count; ++index) {
      const std::vector<std::size_t> runs = runs_of(campaign, Shard::of(index, count));
      EXPECT_TRUE(std::ranges::is_sorted(runs));
      std::map<std::pair<std::size_t, bool>, std::size_t> own;
      for (std::size_t v = 0; v < 3; ++v) own[{v, false}] = own[{v, true}] = 0;
      for (const std::size_t run : runs) {
        ++owners[run];
        ++own[{campaign.runs[run].variant, campaign.runs[run].scenario == 21}];
      }
      for (const auto& [name, n] : own) {
        auto& [least, most] = dealt.try_emplace(name, n, n).first->second;
        least = std::min(least, n);
        most = std::max(most, n);
      }
    }
    for (const int owner : owners) ASSERT_EQ(owner, 1) << count;
    for (const auto& [name, range] : dealt) EXPECT_LE(range.second - range.first, 1u) << count << " " << name.first;
  }
}

TEST(Shards, WhatIsLeftOverGoesToThoseThatHaveLeastToDo) {
  // One run of each class: the dear ones do not fall to one shard.
  const Campaign campaign = campaign_from(R"(
variants = ["thesis_pd", "nine_pd", "slow", "slower"]
[variant.slow]
valves = "three_way"
solver = "ipopt"
[variant.slower]
valves = "three_way"
solver = "ipopt"
[[scenario]]
name = "one"
trajectory = { kind = "sine" }
)");
  for (int index = 1; index <= 2; ++index) {
    std::size_t dear = 0;
    for (const std::size_t run : runs_of(campaign, Shard::of(index, 2))) dear += campaign.runs[run].variant >= 2;
    EXPECT_EQ(dear, 1u);
  }
}

TEST(Shards, AreNamedAndRead) {
  EXPECT_EQ(Shard{}.name(), "all");
  EXPECT_EQ(Shard::of(3, 40).name(), "03-of-40");
  EXPECT_EQ(Shard::of(1, 1).name(), "1-of-1");
  EXPECT_EQ(parse_shard("3/40").text(), "3/40");
  EXPECT_TRUE(parse_shard("1/1").alone);
  for (const char* wrong : {"", "3", "0/4", "5/4", "-1/4", "1/0", "1/4x", "1/100001", "x/4", "1 / 4"})
    EXPECT_THROW(parse_shard(wrong), ConfigError) << wrong;
}

class ArrayTask : public testing::Test {
 protected:
  static void say(const std::map<std::string, std::string>& variables) {
    for (const char* name : {"SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_COUNT", "SLURM_ARRAY_TASK_MIN",
                             "SLURM_ARRAY_TASK_MAX", "SOLENOID_SHARDS", "SOLENOID_FIRST_SHARD"})
      ::unsetenv(name);
    for (const auto& [name, value] : variables) ::setenv(name.c_str(), value.c_str(), 1);
  }
  ~ArrayTask() override { say({}); }
};

TEST_F(ArrayTask, IsAShardByItsPlaceInTheArray) {
  say({});
  EXPECT_FALSE(shard_of_array_task());
  say({{"SLURM_ARRAY_TASK_ID", "7"}, {"SLURM_ARRAY_TASK_MIN", "5"}, {"SLURM_ARRAY_TASK_COUNT", "10"}});
  EXPECT_EQ(shard_of_array_task()->text(), "3/10");
  say({{"SLURM_ARRAY_TASK_ID", "0"}, {"SLURM_ARRAY_TASK_MIN", "0"}, {"SLURM_ARRAY_TASK_COUNT", "1"}});
  EXPECT_EQ(shard_of_array_task()->name(), "1-of-1");
  say({{"SLURM_ARRAY_TASK_ID", "4"},
       {"SLURM_ARRAY_TASK_COUNT", "1"},
       {"SOLENOID_SHARDS", "2000"},
       {"SOLENOID_FIRST_SHARD", "1000"}});
  EXPECT_EQ(shard_of_array_task()->text(), "1004/2000");
  say({{"SLURM_ARRAY_TASK_ID", "4"},
       {"SLURM_ARRAY_TASK_MIN", "0"},
       {"SLURM_ARRAY_TASK_MAX", "8"},
       {"SLURM_ARRAY_TASK_COUNT", "5"}});
  EXPECT_THROW(shard_of_array_task(), ConfigError) << "every second number: shares would be left out";
  say({{"SLURM_ARRAY_TASK_ID", "9"}, {"SLURM_ARRAY_TASK_MIN", "1"}, {"SLURM_ARRAY_TASK_COUNT", "3"}});
  EXPECT_THROW(shard_of_array_task(), ConfigError);
}

}  // namespace
}  // namespace solenoid
