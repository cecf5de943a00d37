#include "controllers/systems.hpp"
#include "core/config/reader.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {

System::System(const SystemDescription& description, Choices choices)
    : description_(description), choices_(std::move(choices)) {
  require_complete(description);
  list_keys();
}

template <class Row>
void System::add_decider(std::vector<Row>& rows, Row row, const std::vector<AddedKey>& keys) {
  require_new(names_of(choices_.solvers), row.name, "solver");
  require_new(names_of(choices_.laws), row.name, "law");
  if (!keys.empty()) row.groups.push_back(row.name);
  rows.push_back(std::move(row));
  add_keys_of(rows.back().name, keys);
}

void System::add(SolverRow row, const std::vector<AddedKey>& keys) {
  add_decider(choices_.solvers, std::move(row), keys);
}

void System::add(LawRow row, const std::vector<AddedKey>& keys) { add_decider(choices_.laws, std::move(row), keys); }

void System::add(EstimatorName row, const std::vector<AddedKey>& keys) {
  require_new(names_of(choices_.estimators), row.name, "estimator");
  choices_.estimators.push_back(std::move(row));
  add_keys_of("estimation", keys);
}

void System::add(ModeSetRow row) {
  require_new(choices_.mode_sets, row.name, "mode set");
  choices_.mode_sets.push_back(row.name);
  added_modes_.push_back(std::move(row));
  list_keys();
}

namespace {

/// Of two limits the stricter one.
ModeSet limited(const ModeSet& modes, const LimitSettings& limits) {
  if (!limits.least_on_ms && !limits.least_off_ms && limits.most_changes == 0) return modes;
  std::vector<Switch> switches(modes.switches().begin(), modes.switches().end());
  for (Switch& s : switches) {
    s.min_on_s = std::max(s.min_on_s, 1e-3 * limits.least_on_ms.value_or(0.0));
    s.min_off_s = std::max(s.min_off_s, 1e-3 * limits.least_off_ms.value_or(0.0));
    if (limits.most_changes == 0) continue;
    s.max_changes = limits.most_changes;
    s.window_s = 1e-3 * limits.window_ms.value_or(0.0);
  }
  return modes.with_switches(std::move(switches));
}

}  // namespace

ModeSet System::modes(const VariantConfig& variant) const {
  const ModeSetRow* row = find_row(added_modes_, variant.modes);
  const ModeSet modes = row ? row->make(variant) : own_modes(variant);
  return limited(modes, variant.limits);
}

Estimator System::estimator(const VariantConfig& variant) const {
  const EstimatorName* row = find_row(choices_.estimators, variant.estimator);
  return row && row->make ? row->make(variant) : own_estimator(variant);
}

void System::add_keys(const std::vector<VariantKey>& own) {
  own_keys_.insert(own_keys_.end(), own.begin(), own.end());
  list_keys();
}

void System::require_new(const std::vector<std::string>& names, const std::string& name, const char* kind) const {
  if (std::ranges::count(names, name) > 0)
    throw ConfigError(fmt::format("system '{}': {} '{}' is there twice (allowed: names other than {})", this->name(),
                                  kind, name, fmt::join(names, ", ")));
}

void System::add_keys_of(const std::string& group, const std::vector<AddedKey>& keys) {
  std::vector<std::string> taken;
  for (const VariantKey& key : keys_) taken.push_back(key.path);
  for (const AddedKey& key : keys) {
    require_new(taken, key.path, "key");
    added_keys_.push_back(key);
    own_keys_.push_back({key.path, group, VariantKey::At<double>([path = key.path](VariantConfig& v) -> double& {
                           return v.added.at(path);
                         }),
                         key.range, key.unit, key.meaning});
  }
  list_keys();
}

void System::list_keys() {
  keys_ = common_keys(description_, names_of(choices_.solvers), names_of(choices_.laws), choices_.mode_sets,
                      names_of(choices_.estimators), choices_.parameter_sets);
  keys_.insert(keys_.end(), own_keys_.begin(), own_keys_.end());
}

Horizon make_horizon(const VariantConfig& v) {
  Horizon horizon{v.timing.tick_s, {}};
  if (solver_row(v).pulses) {
    horizon.blocks.assign(static_cast<std::size_t>(v.horizon.steps), 1);
    return horizon;
  }
  for (const int periods : v.horizon.blocks) horizon.blocks.push_back(periods * v.timing.ticks_per_period);
  if (horizon.blocks.empty()) horizon.blocks = {v.horizon.steps};
  return horizon;
}

}  // namespace solenoid
