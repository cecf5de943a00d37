#include "experiments/campaign/campaign.hpp"

#include "experiments/base/files.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/campaign/carrier.hpp"
#include "experiments/campaign/ensemble.hpp"
#include "experiments/campaign/library.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/plugin/load_plugin.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

template <class T>
void refuse_twice(const std::vector<T>& values, const auto& fail) {
  for (std::size_t i = 0; i < values.size(); ++i)
    if (std::find(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(i), values[i]) !=
        values.begin() + static_cast<std::ptrdiff_t>(i))
      fail(fmt::format("{} is there twice (allowed: each once)", values[i]));
}

std::vector<std::string> variant_names(Library& library, const Selection& selection) {
  const bool chosen = !selection.variants.empty();
  TableReader* listing = library.with_key("variants");
  TableReader& blamed = listing ? *listing : library.root();
  const auto fail = [&](const std::string& problem) {
    if (chosen) throw ConfigError("--variant: " + problem);
    blamed.fail("variants", problem);
  };
  std::vector<std::string> names = selection.variants;
  if (!chosen && listing) names = listing->texts("variants");
  const std::string known = fmt::format("{}", fmt::join(library.variant_order(), ", "));
  if (names.empty()) fail(fmt::format("{} (allowed: any of {})", listing ? "empty" : "missing", known));
  refuse_twice(names, fail);
  for (const std::string& name : names)
    if (!library.variants().contains(name) && library.refused_plugins().empty())
      fail(fmt::format("'{}' is not known (allowed: {})", name, known));
  return names;
}

constexpr std::size_t most_seeds = 10'000;
constexpr double most_runs = 1e8;  // whose records are 100 GB, after months on a hundred cores: more is a mistake
constexpr std::size_t most_checked = 1000;  // members of an ensemble that are read with the campaign: in some 0.1 s

std::vector<std::uint64_t> read_seeds(Library& library) {
  TableReader* listing = library.with_key("seeds");
  if (!listing) return {1};
  const std::vector<int> seeds = listing->integers("seeds", 0, 2147483647);
  const auto fail = [&](const std::string& problem) { listing->fail("seeds", problem); };
  if (seeds.empty()) fail("empty (allowed: at least one whole number)");
  if (seeds.size() > most_seeds) fail(fmt::format("{} of them (allowed: at most {})", seeds.size(), most_seeds));
  refuse_twice(seeds, fail);
  return {seeds.begin(), seeds.end()};
}

/// A scenario's table that is wanted: whole, or of its ensemble some members, counted from 0.
struct ChosenScenario {
  Library::Entry* entry;
  bool whole;
  std::set<std::size_t> members{};
};

std::optional<Ensemble> ensemble_of(Library::Entry& entry) {
  if (!entry.reader.has("ensemble")) return std::nullopt;
  TableReader table = entry.reader.table("ensemble");
  return read_ensemble(table, simulation_of(read_system(entry.reader)).quantities());
}

/// Which of the wanted names are members of a scenario, and takes these off the list.
std::set<std::size_t> members_among(std::vector<std::string>& wanted, const std::string& scenario,
                                    Library::Entry& entry) {
  std::set<std::size_t> members;
  std::erase_if(wanted, [&](const std::string& name) {
    const auto member = member_named(name);
    if (!member || member->scenario != scenario) return false;
    const auto ensemble = ensemble_of(entry);
    if (!ensemble || member->number > static_cast<std::size_t>(ensemble->members)) return false;
    members.insert(member->number - 1);
    return true;
  });
  return members;
}

/// Scenarios of the selection, in the campaign's order.
std::vector<ChosenScenario> chosen_scenarios(Library& library, const Selection& selection) {
  if (library.scenarios().empty())
    library.root().fail("scenario", "missing (allowed: at least one table headed [[scenario]])");
  std::vector<ChosenScenario> chosen;
  std::vector<std::string> names, wanted = selection.scenarios;
  for (Library::Entry& entry : library.scenarios()) {
    names.push_back(entry.reader.text("name"));
    if (selection.scenarios.empty() || std::erase(wanted, names.back()) > 0) chosen.push_back({&entry, true});
  }
  for (std::size_t i = 0; i < names.size() && !wanted.empty(); ++i) {
    Library::Entry& entry = library.scenarios()[i];
    const auto members = members_among(wanted, names[i], entry);
    if (!members.empty() && std::ranges::find(chosen, &entry, &ChosenScenario::entry) == chosen.end())
      chosen.push_back({&entry, false, members});
  }
  for (const std::string& name : wanted)
    throw ConfigError(fmt::format("--scenario: '{}' is not known (allowed: {}{})", name, fmt::join(names, ", "),
                                  member_named(name) ? ", and members of their ensembles" : ""));
  std::ranges::sort(chosen, {}, &ChosenScenario::entry);  // they are elements of one vector
  return chosen;
}

bool can_be_read(const auto& read) {
  try {
    read();
    return true;
  } catch (const ConfigError&) {
    return false;
  }
}

constexpr double most_ticks = 4e6;  // of a run, all of which are kept until it ends

/// What a variant cannot be in a scenario.
void check_pair(const ScenarioConfig& scenario, const VariantConfig& variant, const Document& document) {
  const auto where = [&](const char* key) { return document.where(document.path() + "." + key); };
  require_one_system(variant, scenario, where("system"));
  const VariantConfig v = told(variant, scenario, where("timing"));
  const double ticks = scenario.duration_s / v.timing.tick_s;
  if (!(ticks >= 1.0) || ticks > most_ticks)
    throw ConfigError(
        fmt::format("{}: key 'duration_s': {:g} s in scenario '{}' are {:.4g} ticks of {:g} ms (allowed: "
                    "1 to {:.0f} ticks)",
                    where("duration_s"), scenario.duration_s, scenario.name, ticks, 1e3 * v.timing.tick_s, most_ticks));
  simulation_of(scenario).check(scenario, v, where);
}

/// Fills a campaign part by part, and beside it the resolved document and what each run's hash covers.
class CampaignReader {
 public:
  CampaignReader(Library& library, const Selection& selection)
      : library_(library), selection_(selection), resolved_(library.root().document().name()) {}

  Campaign read() {
    toml::table& root = resolved_.root();
    campaign_.name = library_.root().text_or("name", std::filesystem::path(resolved_.name()).stem().string());
    campaign_.seeds = read_seeds(library_);
    root.insert("name", campaign_.name);
    root.insert("seeds", toml::array{});
    for (const std::uint64_t seed : campaign_.seeds)
      root["seeds"].as_array()->push_back(static_cast<std::int64_t>(seed));
    take_variants();
    note_plugins();
    if (!campaign_.without.plugins.empty() && (campaign_.variants.empty() || library_.scenarios().empty()))
      throw PluginError(campaign_.without.plugins.front());
    take_scenarios();
    campaign_.system = campaign_.scenarios.front().system;
    campaign_.maker = plugins_.empty() ? program_fingerprint() : program_fingerprint() + "+" + fingerprint(plugins_);
    cross();
    for (const InputFile& input : campaign_.inputs) resolved_.carry(input.name, input.text);
    campaign_.resolved_toml =
        "# Everything this campaign ran; `solenoid compare` runs it again.\n" + toml_text(root) + "\n";
    if (campaign_.resolved_toml.size() > file_size::configuration)  // nobody could read the results
      library_.root().fail("scenario", fmt::format("with all that it stands for the campaign is {} bytes (allowed: {})",
                                                   campaign_.resolved_toml.size(), file_size::configuration));
    campaign_.resolved = std::make_shared<const Document>(std::move(resolved_));
    return std::move(campaign_);
  }

 private:
  void take_variants() {
    leave_out();
    for (auto& [name, entry] : library_.variants())  // all: a mistake in an unused variant is a mistake
      if (!entry.shipped) read_variant(entry.reader, name);
    toml::table tables;
    toml::array names;
    for (const std::string& name : variant_names(library_, selection_)) {
      if (!library_.variants().contains(name)) {
        campaign_.without.names.push_back(name);
        continue;
      }
      const Library::Entry& entry = library_.variants().at(name);
      Document variant = entry.document->part(entry.path, *entry.table);
      believe(variant);
      Carried carried = carrier_.carry(variant);
      variant_keys_.push_back(name + "\n" + toml_text(carried.key));
      names.push_back(name);
      tables.insert(name, std::move(carried.table));
      resolved_.comes_from("variant." + name, variant, variant.path());
      TableReader reader(std::move(variant));
      campaign_.variants.push_back(read_variant(reader, name));
    }
    resolved_.root().insert("variants", std::move(names));
    resolved_.root().insert("variant", std::move(tables));
  }

  /// Those that a variant has something of, by name: what else is loaded, and in which order, is nothing to the results.
  void note_plugins() {
    std::map<std::string, std::string> needed;
    for (const LoadedPlugin& plugin : loaded_plugins())
      if (std::ranges::any_of(campaign_.variants, [&](const VariantConfig& v) { return plugin.serves(v); }))
        needed.emplace(plugin.name, plugin.fingerprint);
    if (!needed.empty()) resolved_.root().insert("plugins", toml::array{});
    for (const auto& [name, print] : needed) {
      resolved_.root()["plugins"].as_array()->push_back(name);
      if (!print.empty()) plugins_ += print + "\n";
    }
  }

  /// Takes those variants and scenarios out of the library that nothing is known of without a plug-in that was refused.
  void leave_out() {
    campaign_.without.plugins = library_.refused_plugins();
    if (campaign_.without.plugins.empty()) return;
    auto& variants = library_.variants();
    for (auto v = variants.begin(); v != variants.end();)
      v = can_be_read([&] { read_variant(v->second.reader, v->first); }) ? std::next(v) : variants.erase(v);
    std::erase_if(library_.scenarios(), [&](Library::Entry& entry) {
      const bool out = !can_be_read([&] { read_system(entry.reader); });
      if (out) campaign_.without.names.push_back(entry.reader.text("name"));
      return out;
    });
  }

  /// Sets the selection's model, whose file is relative to the working directory.
  void believe(Document& variant) const {
    const std::string& model = selection_.model;
    if (model.empty()) return;
    variant.root().insert_or_assign("model",
                                    model.ends_with(".toml") ? std::filesystem::absolute(model).string() : model);
    variant.set_by(variant.path() + ".model", "--model");
  }

  void take_scenarios() {
    for (const ChosenScenario& chosen : chosen_scenarios(library_, selection_)) {
      Library::Entry& entry = *chosen.entry;
      const auto ensemble = ensemble_of(entry);
      const auto quantities = simulation_of(read_system(entry.reader)).quantities();
      if (ensemble)
        for (const std::string& key : drawn_keys(quantities, false))
          if (entry.reader.has(key)) entry.reader.fail(key, "beside ensemble, which draws it (allowed: one of them)");
      ScenarioConfig scenario = read_scenario(entry.reader);
      const Document document = entry.document->part(entry.path, *entry.table);
      if (!ensemble) {
        take_scenario(std::move(scenario), document);
        continue;
      }
      const Carried carried = carrier_.carry(document);
      Document table = entry.document->part(entry.path, carried.table);
      for (const InputFile& file : carried.files) table.carry(file.name, file.text);
      const auto members =
          std::make_shared<const EnsembleMembers>(*ensemble, quantities, table, entry.reader.where("ensemble"));
      for (const std::size_t member : chosen.members) take_scenario(members->read(member), members->document(member));
      if (chosen.whole) take_ensemble(members, document, carried);
    }
    refuse_namesakes();
    resolved_.root().insert("scenario", std::move(scenario_tables_));
  }

  void take_scenario(ScenarioConfig scenario, const Document& document) {
    for (const VariantConfig& variant : campaign_.variants) check_pair(scenario, variant, document);
    Carried carried = carrier_.carry(document);
    const ScenarioText text = scenario_text(carried.key, simulation_of(scenario).quantities());
    campaign_.scenarios.add(std::move(scenario), fingerprint(text.rest) + "\n" + text.drawn);
    keep_table(document, std::move(carried.table));
  }

  /// The ensemble stays as it is written: the resolved campaign of a million members is no longer than that of one.
  void take_ensemble(const std::shared_ptr<const EnsembleMembers>& members, const Document& document, Carried carried) {
    for (std::size_t member = 0; member < std::min(members->size(), most_checked); ++member)
      check_member(members->document(member));
    if (members->size() > most_checked)
      for (const bool high : {false, true}) check_member(members->corner(high));
    const std::string same = scenario_text(carrier_.carry(members->document(0)).key, members->quantities()).rest;
    campaign_.scenarios.add(members, fingerprint(same) + "\n");
    drawn_.emplace(members->scenario(), members->size());
    keep_table(document, std::move(carried.table));
  }

  void check_member(Document document) const {
    const auto member = std::make_shared<const Document>(std::move(document));
    TableReader reader(member);
    const ScenarioConfig scenario = read_scenario(reader);
    for (const VariantConfig& variant : campaign_.variants) check_pair(scenario, variant, *member);
  }

  void keep_table(const Document& document, toml::table table) {
    resolved_.comes_from(fmt::format("scenario[{}]", scenario_tables_.size()), document, document.path());
    scenario_tables_.push_back(std::move(table));
  }

  /// No scenario is called as a member of another is.
  void refuse_namesakes() const {
    for (const std::string& name : campaign_.scenarios.tasks()) {
      const auto member = member_named(name);
      const auto drawn = member ? drawn_.find(member->scenario) : drawn_.end();
      if (drawn != drawn_.end() && member->number <= drawn->second)
        library_.root().fail("scenario", fmt::format("'{}' is a member of the ensemble '{}' too (allowed: one scenario "
                                                     "a name)",
                                                     name, member->scenario));
    }
  }

  void cross() {
    const auto scenarios = static_cast<double>(campaign_.scenarios.size());  // the product of whole numbers may wrap
    const double runs =
        scenarios * static_cast<double>(campaign_.variants.size()) * static_cast<double>(campaign_.seeds.size());
    if (runs > most_runs)
      library_.root().fail(
          "seeds",
          fmt::format("{} scenarios, {} variants and {} seeds are {:.0f} runs (allowed: at most {:.0f})",
                      campaign_.scenarios.size(), campaign_.variants.size(), campaign_.seeds.size(), runs, most_runs));
    std::vector<RunList::Variant> variants;
    for (std::size_t v = 0; v < campaign_.variants.size(); ++v) {
      Fingerprint key;
      key.add(variant_keys_[v] + "\n");
      variants.push_back({campaign_.variants[v].name, key});
    }
    campaign_.runs = RunList(std::move(variants), campaign_.scenarios, campaign_.seeds);
  }

  Library& library_;
  const Selection& selection_;
  Campaign campaign_;
  Carrier carrier_{campaign_.inputs};
  Document resolved_;
  toml::array scenario_tables_;
  std::string plugins_;  // fingerprints
  std::vector<std::string> variant_keys_;
  std::map<std::string, std::size_t> drawn_;  // members of each ensemble
};

}  // namespace

Campaign read_campaign(Library& library, const Selection& selection) {
  return CampaignReader(library, selection).read();
}

Campaign read_campaign(const std::string& path, const Selection& selection) {
  Library library(selection);
  library.load(path);
  return read_campaign(library, selection);
}

Campaign read_campaign(Document document, const Selection& selection) {
  Library library(selection);
  library.load(std::move(document));
  return read_campaign(library, selection);
}

Campaign read_real_time_task(const std::string& campaign, const std::string& variant, const std::string& scenario) {
  Selection selection{{variant}, {}};
  if (!scenario.empty()) selection.scenarios = {scenario};
  Campaign task = read_campaign(
      campaign.empty() ? simulation_of(system_of(shipped_variant(variant))).real_time_campaign() : campaign, selection);
  task.scenarios = task.scenarios.first();
  task.runs = task.runs.over(task.scenarios, task.seeds);
  return task;
}

std::string identity_of(const Campaign& campaign) {
  Fingerprint identity;
  identity.add(campaign.maker);
  for (const CampaignRun& run : campaign.runs) identity.add(run.hash);
  return identity.text();
}

double period_of(const Campaign& campaign) {
  return told(campaign.variants.front(), campaign.scenarios.front()).timing.period_s();
}

std::vector<VariantConfig> shipped_variants() {
  Library library;
  std::vector<VariantConfig> all;
  for (const std::string& name : library.variant_order())
    all.push_back(read_variant(library.variants().at(name).reader, name));
  return all;
}

VariantConfig shipped_variant(const std::string& name) {
  Library library;
  const auto found = library.variants().find(name);
  if (found == library.variants().end())
    throw ConfigError(
        fmt::format("variant '{}' is not known (allowed: {})", name, fmt::join(library.variant_order(), ", ")));
  return read_variant(found->second.reader, name);
}

std::vector<std::string> shipped_campaigns() {
  std::vector<std::string> names;
  for (const auto& document : shipped_campaign_documents())
    if (document->root().contains("scenario")) names.push_back(std::filesystem::path(document->name()).stem().string());
  return names;
}

}  // namespace solenoid
