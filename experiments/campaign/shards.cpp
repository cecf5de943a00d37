#include "experiments/campaign/shards.hpp"

#include "core/config/reader.hpp"
#include "experiments/campaign/ensemble.hpp"
#include "experiments/plugin/python_rows.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <numeric>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double not_real_time = 50.0;  // times as dear, by order of magnitude
constexpr double tick_core_s = 10e-6;   // of a run in real time on the truth plant: `compare robustness`

/// Runs that cost about the same: a variant in consecutive scenarios.
struct CostClass {
  std::size_t variant = 0, first_scenario = 0, scenarios = 0;
  double cost = 0.0;  ///< of a run
};

std::vector<CostClass> cost_classes(const Campaign& campaign) {
  std::vector<CostClass> classes;
  for (std::size_t s = 0; s < campaign.scenarios.size();) {
    const std::string group = ensemble_name(campaign.scenarios.name(s));
    std::size_t end = s + 1;
    while (end < campaign.scenarios.size() && ensemble_name(campaign.scenarios.name(end)) == group) ++end;
    const ScenarioConfig scenario = campaign.scenarios[s];
    for (std::size_t v = 0; v < campaign.variants.size(); ++v) {
      const VariantConfig variant = told(campaign.variants[v], scenario);
      const double dear = is_real_time(variant) ? 1.0 : not_real_time;
      classes.push_back({v, s, end - s, dear * scenario.duration_s / variant.timing.tick_s});
    }
    s = end;
  }
  return classes;
}

/// Which shards get one of the `left` runs of a class that are left over, and what everybody has to do then.
std::vector<std::size_t> least_busy(std::vector<double>& loads, std::size_t left, double cost) {
  std::vector<std::size_t> order(loads.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t shard) { return loads[shard]; });
  order.resize(left);
  for (const std::size_t shard : order) loads[shard] += cost;
  return order;
}

int number_of(const char* name) {
  const char* text = std::getenv(name);
  int value = -1;
  if (text) std::from_chars(text, text + std::string_view(text).size(), value);
  return value;
}

}  // namespace

std::string Shard::name() const {
  if (alone) return "all";
  return fmt::format("{:0{}}-of-{}", index, fmt::formatted_size("{}", count), count);
}

std::string Shard::text() const { return fmt::format("{}/{}", index, count); }

Shard parse_shard(const std::string& text) {
  Shard shard;
  const char* end = text.data() + text.size();
  const auto index = std::from_chars(text.data(), end, shard.index);
  const bool parted = index.ec == std::errc() && index.ptr != end && *index.ptr == '/';
  const auto count = parted ? std::from_chars(index.ptr + 1, end, shard.count) : index;
  if (!parted || count.ec != std::errc() || count.ptr != end || shard.index < 1 || shard.index > shard.count ||
      shard.count > most_shards)
    throw ConfigError(
        fmt::format("--shard: '{}' is no share (allowed: I/N, I from 1 to N, N at most {}, or auto in an array job)",
                    text, most_shards));
  shard.alone = shard.count == 1;
  return shard;
}

std::optional<Shard> shard_of_array_task() {
  const int task = number_of("SLURM_ARRAY_TASK_ID");
  if (task < 0) return std::nullopt;
  const int told = number_of("SOLENOID_SHARDS");
  const int count = told > 0 ? told : number_of("SLURM_ARRAY_TASK_COUNT");
  const int index = told > 0 ? task + std::max(number_of("SOLENOID_FIRST_SHARD"), 0)
                             : task - std::max(number_of("SLURM_ARRAY_TASK_MIN"), 0) + 1;
  const int span =
      told > 0 ? count : number_of("SLURM_ARRAY_TASK_MAX") - std::max(number_of("SLURM_ARRAY_TASK_MIN"), 0) + 1;
  if (count < 1 || count > most_shards || index < 1 || index > count || (span > 0 && span != count))
    throw ConfigError(
        fmt::format("--shard: task {} of an array of {} (allowed: an array of consecutive tasks, or "
                    "SOLENOID_SHARDS with how many shares there are)",
                    task, count));
  return Shard::of(index, count);
}

double expected_core_s(const Campaign& campaign) {
  double ticks = 0.0;
  for (const CostClass& c : cost_classes(campaign))
    ticks += c.cost * static_cast<double>(c.scenarios * campaign.seeds.size());
  return tick_core_s * ticks;
}

std::vector<std::uint32_t> shards_of_runs(const Campaign& campaign, int count) {
  std::vector<CostClass> classes = cost_classes(campaign);
  std::ranges::stable_sort(classes, std::greater<>(), &CostClass::cost);
  const auto shards = static_cast<std::size_t>(count);
  const std::size_t seeds = campaign.seeds.size();
  std::vector<double> loads(shards, 0.0);
  std::vector<std::uint32_t> owners(campaign.runs.size());
  for (const CostClass& c : classes) {
    const std::size_t runs = c.scenarios * seeds, dealt = runs - runs % shards;
    const std::vector<std::size_t> busy = least_busy(loads, runs - dealt, c.cost);
    for (std::size_t position = 0; position < runs; ++position) {
      const std::size_t scenario = c.first_scenario + position / seeds;
      const std::size_t shard = position < dealt ? position % shards : busy[position - dealt];
      owners[campaign.runs.place(scenario, c.variant, position % seeds)] = static_cast<std::uint32_t>(shard + 1);
    }
  }
  return owners;
}

std::vector<std::size_t> runs_of(const Campaign& campaign, const Shard& shard) {
  const std::vector<std::uint32_t> owners = shards_of_runs(campaign, shard.count);
  std::vector<std::size_t> runs;
  for (std::size_t run = 0; run < owners.size(); ++run)
    if (owners[run] == static_cast<std::uint32_t>(shard.index)) runs.push_back(run);
  return runs;
}

}  // namespace solenoid
