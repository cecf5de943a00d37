#include "experiments/campaign/library.hpp"

#include "experiments/base/embedded.hpp"
#include "experiments/base/files.hpp"
#include "experiments/campaign/plugins.hpp"
#include "experiments/plugin/python_rows.hpp"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

constexpr const char* shipped_folder = "scenarios/";  // whose variants are known everywhere
constexpr const char* studies_folder = "studies/";    // whose are not
constexpr std::size_t most_levels = 32;               // of files that include files

/// A file's text, or that of the shipped file of this name ("default" or "default.toml").
std::string text_of(const std::string& path) {
  std::error_code unknown;  // a path that cannot even be looked at
  const bool there = std::filesystem::exists(path, unknown) || unknown;
  if (there && !std::filesystem::is_directory(path, unknown)) {
    if (const auto text = read_whole_file(path, file_size::configuration)) return *text;
    throw ConfigError(fmt::format("{}: cannot be read (allowed: a readable TOML file)", path));
  }
  std::string name = std::filesystem::path(path).filename().string();
  if (!name.ends_with(".toml")) name += ".toml";
  for (const char* folder : {shipped_folder, studies_folder})
    if (const std::string_view shipped = embedded_text(folder + name); !shipped.empty()) return std::string(shipped);
  throw ConfigError(fmt::format("{}: cannot be read (allowed: a readable TOML file, or a shipped one)", path));
}

/// Names become file names and table rows.
bool good_name(const std::string& name) {
  const auto good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.' ||
           c == '-';
  };
  return !name.empty() && name.size() <= 80 && name.front() != '.' && name.find("--") == std::string::npos &&
         std::all_of(name.begin(), name.end(), good);
}
constexpr const char* good_names = "at most 80 letters, digits, _, . and single -";

}  // namespace

const std::vector<std::shared_ptr<const Document>>& shipped_campaign_documents() {
  static std::vector<std::shared_ptr<const Document>> documents;
  static std::size_t looked_at = 0;
  for (; looked_at < embedded_names().size(); ++looked_at)
    if (const std::string& name = embedded_names()[looked_at]; name.starts_with(shipped_folder))
      documents.push_back(
          std::make_shared<const Document>(Document::from_text(std::string(embedded_text(name)), name)));
  return documents;
}

Library::Library(const Selection& selection)
    : loads_plugins_(selection.loads_plugins), leaves_out_(selection.leaves_out) {
  adopt_shipped();
}

void Library::adopt_shipped() {
  const auto& documents = shipped_campaign_documents();
  for (; shipped_ < documents.size(); ++shipped_) {
    TableReader reader(documents[shipped_]);
    if (reader.has("variant")) adopt_variants(documents[shipped_], reader, true, false);
  }
}

void Library::load(const std::string& path) {
  std::vector<std::string> including;
  load(path, including);
}

void Library::load(Document document) {
  std::vector<std::string> including = {document.name()};
  take(std::make_shared<const Document>(std::move(document)), including);
}

void Library::load(const std::string& path, std::vector<std::string>& including) {
  std::error_code ignored;
  const std::string key = std::filesystem::weakly_canonical(path, ignored).string();
  if (std::find(including.begin(), including.end(), key) != including.end())
    throw ConfigError(fmt::format("{}: key 'include': includes itself (allowed: files without a circle)", path));
  if (std::find(loaded_.begin(), loaded_.end(), key) != loaded_.end()) return;
  if (including.size() == most_levels)
    throw ConfigError(fmt::format("{}: key 'include': files in files, {} deep (allowed: less)", path, most_levels));
  loaded_.push_back(key);
  including.push_back(key);
  const std::string text = text_of(path);
  bytes_ += text.size();
  if (bytes_ > file_size::configuration)
    throw ConfigError(fmt::format("{}: key 'include': {} bytes with the files before it (allowed: at most {})", path,
                                  bytes_, file_size::configuration));
  take(std::make_shared<const Document>(Document::from_text(text, path)), including);
  including.pop_back();
}

void Library::require_plugins(const Document& document, TableReader& reader) {
  if (!reader.has("plugins")) return;
  bool python = false;  // of all systems: after those of plug-ins
  for (const std::string& plugin : reader.texts("plugins")) {
    const bool file = plugin.ends_with(".so");
    if (plugin == python_plugin)
      python = true;
    else if (file && loads_plugins_)
      load_or_leave_out(document.beside(plugin));
    else if (std::ranges::count(loaded_plugins(), plugin, &LoadedPlugin::name) == 0)
      reader.fail("plugins",
                  file ? fmt::format("'{}' is a file, and results and logs load none (allowed: names of "
                                     "plug-ins that --plugin has loaded)",
                                     plugin)
                       : fmt::format("'{}' is not loaded (allowed: its file, or the option --plugin with it)", plugin));
  }
  if (python) add_python_rows();
  adopt_shipped();
}

void Library::load_or_leave_out(const std::string& plugin) {
  try {
    load_plugin(plugin);
  } catch (const PluginError& error) {
    if (!leaves_out_) throw;
    refused_plugins_.emplace_back(error.what());
  }
}

void Library::take(const Loaded& document, std::vector<std::string>& including) {
  TableReader reader(document);
  const std::size_t first_included = readers_.size();
  require_plugins(*document, reader);
  if (reader.has("include"))
    for (const std::string& name : reader.texts("include")) load(document->beside(name), including);
  for (const char* known : {"name", "plugins", "variants", "seeds", "scenario", "variant", "study"}) reader.has(known);
  reader.finish();
  if (const std::string name = reader.text_or("name", "-"); name.empty() || name.find('/') != std::string::npos)
    reader.fail("name", fmt::format("'{}' names no folder (allowed: a text without /)", name));
  adopt_variants(document, reader, false, readers_.size() > first_included || including.size() == 1);
  adopt_scenarios(document, reader);
  readers_.push_back(std::move(reader));
}

void Library::adopt_variants(const Loaded& document, TableReader& reader, bool shipped, bool overrides) {
  if (!reader.has("variant")) return;
  TableReader tables = reader.table("variant");
  const toml::table& raw = *document->root()["variant"].as_table();
  std::vector<std::string> names = tables.keys();  // sorted by name: back to the order of the file
  std::stable_sort(names.begin(), names.end(), [&](const std::string& a, const std::string& b) {
    return raw.get(a)->source().begin.line < raw.get(b)->source().begin.line;
  });
  for (const std::string& name : names) {
    if (!good_name(name)) tables.fail(name, fmt::format("not a name (allowed: {})", good_names));
    const auto known = variants_.find(name);
    const bool twice = known != variants_.end() && known->second.shipped == shipped && !overrides;
    if (twice && known->second.document->name() != document->name())
      tables.fail(name, fmt::format("defined twice, also at {} (allowed: one definition a name)",
                                    known->second.reader.where()));
    if (known == variants_.end()) order_.push_back(name);
    TableReader variant = tables.table(name);  // which it must be
    variants_.insert_or_assign(
        name, Entry{document, "variant." + name, raw.get(name)->as_table(), std::move(variant), shipped});
  }
}

void Library::adopt_scenarios(const Loaded& document, TableReader& reader) {
  std::vector<TableReader> tables = reader.tables("scenario");
  if (tables.empty()) return;
  const toml::array& raw = *document->root()["scenario"].as_array();
  for (std::size_t i = 0; i < tables.size(); ++i) {
    const std::string name = tables[i].text("name");
    if (!good_name(name)) tables[i].fail("name", fmt::format("'{}' is no name (allowed: {})", name, good_names));
    const auto [same, fresh] = scenario_places_.try_emplace(name, tables[i].where());
    if (!fresh)
      tables[i].fail("name",
                     fmt::format("'{}' is there twice, also at {} (allowed: one scenario a name)", name, same->second));
    scenarios_.push_back({document, fmt::format("scenario[{}]", i), raw[i].as_table(), std::move(tables[i])});
  }
}

TableReader* Library::with_key(const std::string& key) {
  const auto found =
      std::find_if(readers_.rbegin(), readers_.rend(), [&](TableReader& reader) { return reader.has(key); });
  return found == readers_.rend() ? nullptr : &*found;
}

}  // namespace solenoid
