#include "experiments/campaign/campaign.hpp"

#include "experiments/base/files.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/campaign/ensemble.hpp"
#include "experiments/campaign/library.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/plugin/load_plugin.hpp"

#include <algorithm>
#include <filesystem>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

/// A copy of a variant's or scenario's table that means the same beside `inputs`.
struct Carried {
  toml::table table;
  std::string key;  ///< the table's text with each file's content in place of its name
};

/// Copies a table; every text in it that names a readable .csv or .toml file is carried into campaign.inputs.
class Carrier {
 public:
  explicit Carrier(std::vector<InputFile>& inputs) : inputs_(inputs) {}

  Carried carry(const Document& document) {
    toml::table moved = document.root(), keyed = moved;
    rewrite(moved, keyed, document);
    return {std::move(moved), toml_text(keyed)};
  }

 private:
  void rewrite(toml::table& moved, toml::table& keyed, const Document& document) {
    for (auto&& [key, node] : moved) {
      if (toml::table* inner = node.as_table()) rewrite(*inner, *keyed[key].as_table(), document);
      const auto* text = node.as_string();
      if (!text || !(text->get().ends_with(".csv") || text->get().ends_with(".toml"))) continue;
      const auto content = document.linked(text->get());
      if (!content) continue;
      const std::string hash = fingerprint(*content);
      keyed.insert_or_assign(key, "content " + hash);
      moved.insert_or_assign(key, add(text->get(), hash, *content));
    }
  }

  std::string add(const std::string& path, const std::string& hash, const std::string& content) {
    const std::filesystem::path file(path);
    std::string stem = file.stem().string();
    if (const std::string tail = "-" + hash; stem.ends_with(tail)) stem.resize(stem.size() - tail.size());
    std::string name = fmt::format("inputs/{}-{}{}", stem, hash, file.extension().string());
    if (std::none_of(inputs_.begin(), inputs_.end(), [&](const InputFile& f) { return f.name == name; }))
      inputs_.push_back({name, content});
    return name;
  }

  std::vector<InputFile>& inputs_;
};

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

constexpr std::size_t most_seeds = 10'000, most_runs = 100'000;

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

/// Scenarios of the selection, in the campaign's order.
std::vector<Library::Entry*> chosen_scenarios(Library& library, const Selection& selection) {
  if (library.scenarios().empty())
    library.root().fail("scenario", "missing (allowed: at least one table headed [[scenario]])");
  std::vector<Library::Entry*> chosen;
  std::vector<std::string> names;
  for (Library::Entry& entry : library.scenarios()) {
    names.push_back(entry.reader.text("name"));
    if (selection.scenarios.empty() ||
        std::find(selection.scenarios.begin(), selection.scenarios.end(), names.back()) != selection.scenarios.end())
      chosen.push_back(&entry);
  }
  for (const std::string& wanted : selection.scenarios)
    if (std::find(names.begin(), names.end(), wanted) == names.end())
      throw ConfigError(fmt::format("--scenario: '{}' is not known (allowed: {})", wanted, fmt::join(names, ", ")));
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
      variant_keys_.push_back(name + "\n" + carried.key);
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
    for (Library::Entry* entry : chosen_scenarios(library_, selection_)) {
      const auto quantities = simulation_of(read_system(entry->reader)).quantities();
      std::optional<Ensemble> ensemble;
      if (entry->reader.has("ensemble")) {
        TableReader table = entry->reader.table("ensemble");
        ensemble = read_ensemble(table, quantities);
        for (const std::string& key : drawn_keys(quantities, false))
          if (entry->reader.has(key)) entry->reader.fail(key, "beside ensemble, which draws it (allowed: one of them)");
      }
      const ScenarioConfig scenario = read_scenario(entry->reader);
      if (!ensemble) {
        take_scenario(scenario, entry->document->part(entry->path, *entry->table));
        continue;
      }
      for (const toml::table& member : ensemble_scenarios(*ensemble, quantities, *entry->table)) {
        const auto drawn = std::make_shared<Document>(entry->document->part(entry->path, member));
        for (const std::string& key : drawn_keys(quantities, true))
          if (!entry->table->contains(key)) drawn->set_by(entry->path + "." + key, entry->reader.where("ensemble"));
        TableReader reader(drawn);
        take_scenario(read_scenario(reader), *drawn);
      }
    }
    resolved_.root().insert("scenario", std::move(scenario_tables_));
  }

  void take_scenario(const ScenarioConfig& scenario, const Document& document) {
    campaign_.scenarios.push_back(scenario);
    for (const VariantConfig& variant : campaign_.variants) check_pair(scenario, variant, document);
    resolved_.comes_from(fmt::format("scenario[{}]", scenario_tables_.size()), document, document.path());
    Carried carried = carrier_.carry(document);
    scenario_keys_.push_back(carried.key);
    scenario_tables_.push_back(std::move(carried.table));
  }

  void cross() {
    const std::size_t runs = campaign_.scenarios.size() * campaign_.variants.size() * campaign_.seeds.size();
    if (runs > most_runs)
      library_.root().fail(
          "seeds",
          fmt::format("{} scenarios, {} variants and {} seeds are {} runs (allowed: at most {})",
                      campaign_.scenarios.size(), campaign_.variants.size(), campaign_.seeds.size(), runs, most_runs));
    for (std::size_t s = 0; s < campaign_.scenarios.size(); ++s)
      for (std::size_t v = 0; v < campaign_.variants.size(); ++v)
        for (const std::uint64_t seed : campaign_.seeds) {
          CampaignRun run{v, s, seed, "", ""};
          run.id = run_id(campaign_.scenarios[s].name, campaign_.variants[v].name, seed);
          run.hash = fingerprint(fmt::format("{}\n{}{}\n{}\n{}", program_fingerprint(), plugins_, variant_keys_[v],
                                             scenario_keys_[s], seed));
          campaign_.runs.push_back(std::move(run));
        }
  }

  Library& library_;
  const Selection& selection_;
  Campaign campaign_;
  Carrier carrier_{campaign_.inputs};
  Document resolved_;
  toml::array scenario_tables_;
  std::string plugins_;  // fingerprints
  std::vector<std::string> variant_keys_, scenario_keys_;
};

}  // namespace

std::string run_id(const std::string& scenario, const std::string& variant, std::uint64_t seed) {
  return fmt::format("{}--{}--s{}", scenario, variant, seed);
}

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
  task.scenarios.resize(1);
  return task;
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
