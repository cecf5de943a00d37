#include "experiments/campaign/run_list.hpp"

#include <charconv>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace solenoid {

std::string run_id(const std::string& scenario, const std::string& variant, std::uint64_t seed) {
  return fmt::format("{}--{}--s{}", scenario, variant, seed);
}

RunList::RunList(std::vector<Variant> variants, ScenarioList scenarios, std::vector<std::uint64_t> seeds)
    : variants_(std::move(variants)), scenarios_(std::move(scenarios)), seeds_(std::move(seeds)) {
  for (std::size_t v = 0; v < variants_.size(); ++v) variant_places_.emplace(variants_[v].name, v);
  for (std::size_t s = 0; s < seeds_.size(); ++s) seed_places_.emplace(seeds_[s], s);
}

RunList RunList::over(ScenarioList scenarios, std::vector<std::uint64_t> seeds) const {
  return {variants_, std::move(scenarios), std::move(seeds)};
}

CampaignRun RunList::operator[](std::size_t i) const {
  CampaignRun run{variant(i), i / seeds_.size() / variants_.size(), seeds_[i % seeds_.size()], {}, {}};
  const Variant& variant = variants_[run.variant];
  run.id = run_id(scenarios_.name(run.scenario), variant.name, run.seed);
  Fingerprint hash = variant.key;
  scenarios_.add_key(run.scenario, hash);
  hash.add(fmt::format("\n{}", run.seed));
  run.hash = hash.text();
  return run;
}

CampaignRun RunList::at(std::size_t i) const {
  if (i >= size()) throw std::out_of_range("no such run");
  return (*this)[i];
}

std::optional<std::size_t> RunList::find(const std::string& scenario, const std::string& variant,
                                         std::uint64_t seed) const {
  const auto s = scenarios_.find(scenario);
  const auto v = variant_places_.find(variant);
  const auto k = seed_places_.find(seed);
  if (!s || v == variant_places_.end() || k == seed_places_.end()) return std::nullopt;
  return place(*s, v->second, k->second);
}

std::optional<std::size_t> RunList::find(const std::string& id) const {
  const std::size_t variant = id.find("--"), seed = id.rfind("--s");
  if (variant == std::string::npos || seed <= variant) return std::nullopt;
  std::uint64_t number = 0;
  const char* end = id.data() + id.size();
  const auto read = std::from_chars(id.data() + seed + 3, end, number);
  if (read.ec != std::errc() || read.ptr != end) return std::nullopt;
  const std::optional<std::size_t> found =
      find(id.substr(0, variant), id.substr(variant + 2, seed - variant - 2), number);
  return found && (*this)[*found].id == id ? found : std::nullopt;  // "s007" is none's
}

}  // namespace solenoid
