#include "experiments/learn/held_out.hpp"

#include "core/config/document.hpp"
#include "core/config/reader.hpp"
#include "experiments/learn/learn.hpp"

#include <string_view>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// Solvers are made for some models and mode sets only: known before anything runs.
void check_teacher(const VariantConfig& v) {
  if (const ReadySolver ready = ready_solver(v, *system_of(v).problem(v)); !ready.solver)
    throw ConfigError(
        fmt::format("variant '{}': {} (allowed: a variant that branch and bound solves)", v.name, ready.misfit));
}

}  // namespace

SplitCampaign split_campaign(const std::string& campaign, const std::string& variant) {
  constexpr std::string_view judging = "held_out";
  SplitCampaign split;
  const Campaign all = read_campaign(campaign, {.variants = {variant}});
  if (const auto* scenarios = all.resolved->root()["scenario"].as_array())
    for (const auto& scenario : *scenarios) {
      const std::string name = scenario.as_table()->get("name")->value<std::string>().value_or("");
      (name.starts_with(judging) ? split.held_out_names : split.training_names).push_back(name);
    }
  if (split.training_names.empty() || split.held_out_names.empty())
    throw ConfigError(
        fmt::format("{}: {} scenarios to teach on, {} to judge (allowed: at least one of each; scenarios "
                    "named {}... judge)",
                    campaign, split.training_names.size(), split.held_out_names.size(), judging));
  split.training = read_campaign(campaign, {.variants = {variant}, .scenarios = split.training_names});
  split.held_out = read_campaign(campaign, {.variants = {variant}, .scenarios = split.held_out_names});
  for (Campaign* part : {&split.training, &split.held_out})
    for (VariantConfig& v : part->variants) v = teacher_of(v);
  check_teacher(split.training.variants.front());
  return split;
}

}  // namespace solenoid
