#include "experiments/systems/actuator/health/health_study.hpp"

#include "controllers/systems.hpp"
#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/document.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/embedded.hpp"
#include "experiments/base/processes.hpp"
#include "experiments/base/result.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include <fmt/format.h>

namespace solenoid {
namespace {

using Column = Table::Column;

constexpr double goes_on_s = 1.0;  // after a coil was called failed: what the error after it is taken over

/// One plant of a variant in a scenario: every coil fails on it once in every way.
struct Item {
  std::size_t variant = 0, scenario = 0;
  int member = 0;
  bool healthy = false;
  std::uint64_t seed = 1;
};

struct Setting {
  const HealthStudySettings& settings;
  Campaign campaign;
  std::vector<std::size_t> first;  ///< of each scenario's table, its first member

  ScenarioConfig plant(const Item& item) const {
    const std::size_t end = item.scenario + 1 < first.size() ? first[item.scenario + 1] : campaign.scenarios.size();
    const std::size_t members = end - first[item.scenario];
    return campaign.scenarios.at(first[item.scenario] + static_cast<std::size_t>(item.member) % members);
  }
  std::vector<SwitchFault> faults() const {
    std::vector<SwitchFault> all = {{SwitchFaultKind::stuck_on}, {SwitchFaultKind::stuck_off}};
    if (settings.every_kind) {
      all.push_back({SwitchFaultKind::leaking, settings.leaking_share});
      all.push_back({SwitchFaultKind::slow, settings.late_s});
    }
    return all;
  }
};

std::string fault_name(const SwitchFault& fault) {
  switch (fault.kind) {
    case SwitchFaultKind::stuck_on:
      return "stuck open";
    case SwitchFaultKind::stuck_off:
      return "stuck closed";
    case SwitchFaultKind::leaking:
      return fmt::format("leaks {:g} %", 100 * fault.value);
    case SwitchFaultKind::slow:
      return fmt::format("{:g} ms slow", 1e3 * fault.value);
    case SwitchFaultKind::none:
      break;
  }
  return "sound";
}

/// A moment of the motion: in the dwell of the first scenario, in the oscillation of the second.
double moment(const Item& item) {
  std::mt19937_64 random(static_cast<std::uint64_t>(item.member) * 7919u + item.scenario);
  const double share = std::uniform_real_distribution<double>(0.0, 1.0)(random);
  return item.scenario == 0 ? 0.5 + 0.4 * share : 1.2 + 2.0 * share;
}

Json found_of(const HealthRun& run, const CoilFault* fault) {
  Json json = {{"before", run.before_mm}, {"after", run.found ? Json(run.after_mm) : Json()}};
  json["shown"] = run.shown_s ? Json(*run.shown_s) : Json();
  json["found"] = run.found_s ? Json(*run.found_s) : Json();
  json["until"] = run.until_s;
  if (fault && run.found) {
    json["early"] = *run.found_s < fault->at_s - 1e-9;
    json["coil"] = run.found->c == fault->coil;
    json["kind"] = run.found->fault.kind == fault->fault.kind;
  }
  return json;
}

std::string work(const Setting& setting, const Item& item) {
  const VariantConfig& variant = setting.campaign.variants[item.variant];
  ScenarioConfig scenario = setting.plant(item);
  Json list = Json::array();
  if (item.healthy) {
    const HealthRun run = run_with_fault(variant, scenario, item.seed, {}, 0.0);
    return Json{{"alarms", run.found ? 1 : 0}, {"s", run.until_s}}.dump();
  }
  const double at_s = moment(item);
  scenario.duration_s = std::min(scenario.duration_s, item.scenario == 0 ? 3.2 : at_s + 1.5);
  const auto coils = static_cast<std::size_t>(system_of(variant).modes(variant).switch_count());
  for (std::size_t coil = 0; coil < coils; ++coil)
    for (const SwitchFault& fault : setting.faults()) {
      const CoilFault failing{coil, fault, at_s};
      list.push_back(found_of(run_with_fault(variant, scenario, item.seed, failing, goes_on_s), &failing));
    }
  return list.dump();
}

void add(HealthRow& row, const Json& run) {
  const auto number = [&](const char* key) { return run.at(key).is_null() ? -1.0 : run.at(key).get<double>(); };
  const double shown = number("shown"), found = number("found");
  const bool right = run.value("coil", false) && !run.value("early", false);
  ++row.plants;
  row.before_mm.push_back(number("before"));
  if (run.value("early", false)) ++row.alarms;
  if (right) ++row.right_coil;
  if (found >= 0 && !right && !run.value("early", false)) ++row.wrong_coil;
  if (right) row.after_mm.push_back(number("after"));
  // What was found from less than it takes to show itself, and then did no more harm, was found in time.
  const bool before_it_showed = right && shown < 0;
  if ((shown < 0 && !right) || (found < 0 && number("until") - shown < found_within_s)) return;
  ++row.shown;
  if (!right) return;
  const double delay_s = before_it_showed ? 0.0 : std::max(0.0, found - shown);
  row.delays_s.push_back(delay_s);
  if (run.value("kind", false) && delay_s <= found_within_s) ++row.in_time;
}

Setting setting_of(const HealthStudySettings& settings) {
  Setting setting{settings,
                  read_campaign(Document::from_text(std::string(embedded_text("tasks/valve_health.toml")),
                                                    "tasks/valve_health.toml"),
                                {.variants = settings.variants}),
                  {}};
  for (const VariantConfig& variant : setting.campaign.variants)
    if (!actuator(variant).valve_health)
      throw ConfigError(
          fmt::format("--valves: variant '{}' watches no coils (allowed: health_two_way, health_pcm_2, and others "
                      "with valve_health = true)",
                      variant.name));
  std::string before;
  for (std::size_t i = 0; i < setting.campaign.scenarios.size(); ++i) {
    const std::string name = setting.campaign.scenarios.name(i), table = name.substr(0, name.rfind("-m"));
    if (table != before) setting.first.push_back(i);
    before = table;
  }
  return setting;
}

/// Plants with faults first, then sound ones until their time is up.
std::vector<Item> items_of(const Setting& setting) {
  std::vector<Item> items;
  const std::size_t variants = setting.campaign.variants.size(), scenarios = setting.first.size();
  for (int member = 0; member < setting.settings.plants; ++member)
    for (std::size_t v = 0; v < variants; ++v)
      for (std::size_t s = 0; s < scenarios; ++s)
        items.push_back({v, s, member, false, static_cast<std::uint64_t>(member) + 1});
  double left_s = 3600.0 * setting.settings.healthy_hours;
  for (int round = 0; left_s > 0.0; ++round)
    for (std::size_t v = 0; v < variants; ++v)
      for (std::size_t s = 0; s < scenarios && left_s > 0.0; ++s) {
        const Item item{v, s, round, true, 1000u + static_cast<std::uint64_t>(round)};
        left_s -= setting.plant(item).duration_s;
        items.push_back(item);
      }
  return items;
}

std::vector<HealthRow> rows_of(const Setting& setting) {
  std::vector<HealthRow> rows;
  for (const VariantConfig& variant : setting.campaign.variants) {
    const ModeSet modes = system_of(variant).modes(variant);
    for (const char* when : {"at rest", "moving"})
      for (const Switch& coil : modes.switches())
        for (const SwitchFault& fault : setting.faults())
          rows.push_back({.variant = variant.name, .coil = coil.name, .fault = fault_name(fault), .when = when});
  }
  return rows;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return std::nan("");
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(std::lround(share * static_cast<double>(values.size() - 1)))];
}

}  // namespace

HealthStudy study_valve_health(const HealthStudySettings& settings,
                               const std::function<void(const std::string&)>& progress,
                               const std::function<bool()>& interrupted) {
  const Setting setting = setting_of(settings);
  const std::vector<Item> items = items_of(setting);
  HealthStudy study;
  study.rows = rows_of(setting);
  // The first row of each variant and scenario.
  std::vector<std::size_t> begins;
  for (std::size_t i = 0; i < study.rows.size(); ++i)
    if (i == 0 || study.rows[i].variant != study.rows[i - 1].variant || study.rows[i].when != study.rows[i - 1].when)
      begins.push_back(i);
  std::vector<std::size_t> numbers(items.size());
  std::iota(numbers.begin(), numbers.end(), std::size_t{0});
  std::size_t done = 0;
  PoolEvents events;
  events.interrupted = interrupted;
  events.ended = [&](std::size_t i, const Outcome& outcome) {
    ++done;
    if (done % 20 == 0 || done == items.size()) progress(fmt::format("{} of {} plants", done, items.size()));
    if (!outcome.done) {
      ++study.failed;
      return;
    }
    const Json json = Json::parse(outcome.text);
    const Item& item = items[i];
    if (item.healthy) {
      study.false_alarms += json.at("alarms").get<int>();
      study.healthy_s += json.at("s").get<double>();
      return;
    }
    const std::size_t begin = begins[item.variant * setting.first.size() + item.scenario];
    for (std::size_t k = 0; k < json.size(); ++k) add(study.rows[begin + k], json[k]);
  };
  study.interrupted = !work_in_processes(
      numbers, settings.jobs, [&](std::size_t i) { return work(setting, items[i]); }, events);
  return study;
}

Result result_of(const HealthStudy& study) {
  Table table{
      .name = "faults",
      .columns = {Column("variant", "variant", "<"), Column("coil", "coil", "<"), Column("fault", "fault", "<"),
                  Column("when", "when", "<"), Column("plants", "plants"), Column("shown", "shown"),
                  Column("in_time_share", "in 150 ms %", ".1f%"), Column("delay_s_p50"), Column("delay_s_p95"),
                  Column("", "delay ms p50", ".0f"), Column("", "p95", ".0f"), Column("right_coil", "right coil"),
                  Column("wrong_coil", "wrong coil"), Column("alarms_before", "alarms before"),
                  Column("before_mm", "error mm before", ".2f"), Column("after_mm", "after", ".2f")}};
  int stuck_shown = 0, stuck_in_time = 0;
  for (const HealthRow& r : study.rows) {
    const double share = r.shown > 0 ? static_cast<double>(r.in_time) / r.shown : std::nan("");
    const double p50 = quantile(r.delays_s, 0.5), p95 = quantile(r.delays_s, 0.95);
    table.add({r.variant, r.coil, r.fault, r.when, r.plants, r.shown, share, p50, p95, 1e3 * p50, 1e3 * p95,
               r.right_coil, r.wrong_coil, r.alarms, quantile(r.before_mm, 0.5), quantile(r.after_mm, 0.5)});
    if (!r.fault.starts_with("stuck")) continue;
    stuck_shown += r.shown;
    stuck_in_time += r.in_time;
  }
  const double hours = study.healthy_s / 3600.0;
  table.notes = {
      fmt::format("\nA fault has shown itself when it has changed a chamber's air by {:g} kPa within some {:g} ms; "
                  "until then nothing can be "
                  "known of it. Errors: medians over the plants of the root mean square.",
                  1e-3 * shown_pa, 1e3 * shown_within_s),
      fmt::format(
          "Stuck coils: {} of {} found within {:g} ms, {:.1f} %. Sound plants: {} false alarms in {:.2f} hours.",
          stuck_in_time, stuck_shown, 1e3 * found_within_s, stuck_shown > 0 ? 100.0 * stuck_in_time / stuck_shown : 0.0,
          study.false_alarms, hours)};
  return {.facts = {{"healthy_hours", hours}, {"false_alarms", study.false_alarms}, {"failed", study.failed}},
          .tables = {table}};
}

}  // namespace solenoid
