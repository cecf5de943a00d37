#pragma once

#include "experiments/base/files.hpp"
#include "experiments/base/index_iterator.hpp"
#include "experiments/campaign/scenario.hpp"

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

namespace solenoid {

class EnsembleMembers;

/// A campaign's scenarios in its order. A table with `ensemble` stands for as many as it draws, and none of them is kept:
/// each is read anew when it is asked for, which takes some 0.15 ms.
class ScenarioList {
 public:
  using value_type = ScenarioConfig;
  using Iterator = IndexIterator<ScenarioList, ScenarioConfig>;

  ScenarioList() = default;
  /// A list of one.
  static ScenarioList only(ScenarioConfig scenario);
  /// The first alone, with its key.
  ScenarioList first() const;

  /// A scenario of a table, and what of that a run's result depends on: of members in common, for each adds its own.
  void add(ScenarioConfig scenario, std::string key);
  void add(std::shared_ptr<const EnsembleMembers> ensemble, std::string key);

  std::size_t size() const { return ends_.empty() ? 0 : ends_.back(); }
  bool empty() const { return tasks_.empty(); }
  /// Throws ConfigError for a member that its ensemble should not have drawn; at() also std::out_of_range.
  ScenarioConfig operator[](std::size_t i) const;
  ScenarioConfig at(std::size_t i) const;
  ScenarioConfig front() const { return at(0); }
  Iterator begin() const { return {*this, 0}; }
  Iterator end() const { return {*this, size()}; }

  /// Without reading the scenario.
  std::string name(std::size_t i) const;
  std::optional<std::size_t> find(const std::string& name) const;
  /// Adds what of the scenario a run's result depends on.
  void add_key(std::size_t i, Fingerprint& hash) const;
  /// The names of the tables: an ensemble has one.
  std::vector<std::string> tasks() const;

 private:
  struct Task {
    std::string name;
    std::string key;
    ScenarioConfig scenario;                          // of a table without ensemble
    std::shared_ptr<const EnsembleMembers> ensemble;  // or null
  };
  struct Place {
    const Task& task;
    std::size_t member;
  };
  void add(Task task, std::size_t members);
  Place place(std::size_t i) const;

  std::vector<std::shared_ptr<const Task>> tasks_;
  std::vector<std::size_t> ends_;  // beyond the last scenario of each task
  std::unordered_map<std::string, std::size_t> by_name_;
};

}  // namespace solenoid
