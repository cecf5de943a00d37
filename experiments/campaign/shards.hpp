#pragma once

#include "experiments/campaign/campaign.hpp"

#include <optional>
#include <string>
#include <vector>

namespace solenoid {

/// One of `count` shares of a campaign's runs, counted from 1: "3/40". Which runs those are depends on the campaign and the
/// count alone, so that shares may be done anywhere, in any order, and again.
struct Shard {
  int index = 1, count = 1;
  bool alone = true;  ///< a campaign that is not parted: the process has its folder to itself

  static Shard of(int index, int count) { return {index, count, false}; }
  /// "03-of-40", after which its files are named; "all" of a campaign that is not parted.
  std::string name() const;
  /// "3/40".
  std::string text() const;
};

inline constexpr int most_shards = 100'000;

/// Reads "3/40"; "1/1" is a campaign that is not parted. Throws ConfigError.
Shard parse_shard(const std::string& text);

/// The share of an array job's task, by the environment that Slurm gives it: task T of an array of N consecutive tasks has
/// the share of its place among them; where SOLENOID_SHARDS says how many shares there are, SOLENOID_FIRST_SHARD + T. None
/// outside of an array. Throws ConfigError if that does not fit.
std::optional<Shard> shard_of_array_task();

/// The numbers of a shard's runs, ascending. Runs of a variant in a scenario, or in an ensemble of them, cost about the
/// same and are dealt to the shards in turn; what is left over of each such class goes to those that have least to do by
/// then, dearest class first, where a run is held to cost its ticks, times fifty if the variant is not real time.
std::vector<std::size_t> runs_of(const Campaign& campaign, const Shard& shard);
/// The shard of each run, from 1, of so many shards.
std::vector<std::uint32_t> shards_of_runs(const Campaign& campaign, int count);

/// How long a campaign takes a core, by order of magnitude [s].
double expected_core_s(const Campaign& campaign);

}  // namespace solenoid
