#include "experiments/campaign/scenario_list.hpp"

#include "core/config/reader.hpp"
#include "experiments/campaign/ensemble.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace solenoid {

ScenarioList ScenarioList::only(ScenarioConfig scenario) {
  ScenarioList list;
  list.add(std::move(scenario), {});
  return list;
}

ScenarioList ScenarioList::first() const {
  const auto& [task, member] = place(0);
  ScenarioList list;
  list.add(front(), task.key + (task.ensemble ? task.ensemble->drawn_text(member) : ""));
  return list;
}

void ScenarioList::add(ScenarioConfig scenario, std::string key) {
  std::string name = scenario.name;
  add({std::move(name), std::move(key), std::move(scenario), nullptr}, 1);
}

void ScenarioList::add(std::shared_ptr<const EnsembleMembers> ensemble, std::string key) {
  const std::size_t members = ensemble->size();
  add({ensemble->scenario(), std::move(key), {}, std::move(ensemble)}, members);
}

void ScenarioList::add(Task task, std::size_t members) {
  by_name_.emplace(task.name, tasks_.size());
  ends_.push_back(size() + members);
  tasks_.push_back(std::make_shared<const Task>(std::move(task)));
}

ScenarioList::Place ScenarioList::place(std::size_t i) const {
  const auto task = std::ranges::upper_bound(ends_, i) - ends_.begin();
  const auto t = static_cast<std::size_t>(task);
  return {*tasks_[t], i - (t == 0 ? 0 : ends_[t - 1])};
}

ScenarioConfig ScenarioList::operator[](std::size_t i) const {
  const auto [task, member] = place(i);
  return task.ensemble ? task.ensemble->read(member) : task.scenario;
}

ScenarioConfig ScenarioList::at(std::size_t i) const {
  if (i >= size()) throw std::out_of_range("no such scenario");
  return (*this)[i];
}

std::string ScenarioList::name(std::size_t i) const {
  const auto [task, member] = place(i);
  return task.ensemble ? task.ensemble->name(member) : task.name;
}

std::optional<std::size_t> ScenarioList::find(const std::string& name) const {
  const auto first_of = [&](std::size_t task) { return task == 0 ? 0 : ends_[task - 1]; };
  if (const auto whole = by_name_.find(name); whole != by_name_.end() && !tasks_[whole->second]->ensemble)
    return first_of(whole->second);
  const std::optional<MemberName> member = member_named(name);
  if (!member) return std::nullopt;
  const auto drawn = by_name_.find(member->scenario);
  if (drawn == by_name_.end() || !tasks_[drawn->second]->ensemble) return std::nullopt;
  if (member->number > tasks_[drawn->second]->ensemble->size()) return std::nullopt;
  return first_of(drawn->second) + member->number - 1;
}

void ScenarioList::add_key(std::size_t i, Fingerprint& hash) const {
  const auto [task, member] = place(i);
  hash.add(task.key);
  if (task.ensemble) hash.add(task.ensemble->drawn_text(member));
}

std::vector<std::string> ScenarioList::tasks() const {
  std::vector<std::string> names;
  for (const auto& task : tasks_) names.push_back(task->name);
  return names;
}

}  // namespace solenoid
