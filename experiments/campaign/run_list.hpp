#pragma once

#include "experiments/campaign/scenario_list.hpp"

#include <cstdint>

namespace solenoid {

/// One cell of variants x scenarios x seeds.
struct CampaignRun {
  std::size_t variant = 0, scenario = 0;
  std::uint64_t seed = 1;
  std::string id;    ///< run_id()
  std::string hash;  ///< of everything configured that the run's result depends on
};

/// SCENARIO--VARIANT--sSEED, after which the files of a run are named.
std::string run_id(const std::string& scenario, const std::string& variant, std::uint64_t seed);

/// The runs of a campaign in canonical order: by scenario, then variant, then seed. None is kept: each is put together
/// when it is asked for, in some 2 us.
class RunList {
 public:
  using value_type = CampaignRun;
  using Iterator = IndexIterator<RunList, CampaignRun>;

  /// A variant's name, and the begin of its runs' hashes: of what there depends on no scenario.
  struct Variant {
    std::string name;
    Fingerprint key;
  };

  RunList() = default;
  RunList(std::vector<Variant> variants, ScenarioList scenarios, std::vector<std::uint64_t> seeds);
  /// The same variants in other scenarios, with other seeds.
  RunList over(ScenarioList scenarios, std::vector<std::uint64_t> seeds) const;

  std::size_t size() const { return scenarios_.size() * variants_.size() * seeds_.size(); }
  bool empty() const { return size() == 0; }
  CampaignRun operator[](std::size_t i) const;
  /// Throws std::out_of_range.
  CampaignRun at(std::size_t i) const;
  CampaignRun front() const { return at(0); }
  Iterator begin() const { return {*this, 0}; }
  Iterator end() const { return {*this, size()}; }

  /// Its variant's number, without putting it together.
  std::size_t variant(std::size_t i) const { return i / seeds_.size() % variants_.size(); }
  /// Where the run of a scenario, a variant and a seed is, by their numbers.
  std::size_t place(std::size_t scenario, std::size_t variant, std::size_t seed) const {
    return (scenario * variants_.size() + variant) * seeds_.size() + seed;
  }
  /// Where the run of these names is.
  std::optional<std::size_t> find(const std::string& scenario, const std::string& variant, std::uint64_t seed) const;
  /// The same of an ID.
  std::optional<std::size_t> find(const std::string& id) const;

 private:
  std::vector<Variant> variants_;
  ScenarioList scenarios_;
  std::vector<std::uint64_t> seeds_;
  std::unordered_map<std::string, std::size_t> variant_places_;
  std::unordered_map<std::uint64_t, std::size_t> seed_places_;
};

}  // namespace solenoid
