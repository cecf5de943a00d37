#include "core/config/document.hpp"

#include "core/config/reader.hpp"
#include "core/config/toml_depth.hpp"
#include "core/config/whole_file.hpp"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <new>
#include <sstream>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace solenoid {
namespace {

/// Where each value of a document comes from, by its path.
class Origins {
 public:
  Origins(const std::string& file, std::map<std::string, std::string>& origins) : file_(file), origins_(origins) {}

  void note(const toml::node& node, const std::string& path) {
    const auto& [at, place] = *origins_.emplace(path, fmt::format("{}:{}", file_, node.source().begin.line)).first;
    room_ -= std::min(room_, at.size() + place.size());
    if (room_ == 0)
      throw ConfigError(fmt::format("{}: too many keys of too long paths (allowed: {} bytes)", place, most_bytes));
    if (const toml::table* table = node.as_table())
      for (const auto& [key, value] : *table)
        note(value, path.empty() ? std::string(key.str()) : fmt::format("{}.{}", path, key.str()));
    if (const toml::array* array = node.as_array())
      for (std::size_t i = 0; i < array->size(); ++i)
        if ((*array)[i].is_table()) note((*array)[i], fmt::format("{}[{}]", path, i));
  }

 private:
  static constexpr std::size_t most_bytes = 100'000'000;
  const std::string& file_;
  std::map<std::string, std::string>& origins_;
  std::size_t room_ = most_bytes;
};

/// What walks, copies and names values does so level by level, and errors name keys.
void require_shallow(const toml::table& root, const std::string& name) {
  constexpr int most_levels = 64;
  constexpr std::size_t longest_key = 200;
  std::vector<std::pair<const toml::node*, int>> open = {{&root, 0}};
  while (!open.empty()) {
    const auto [node, level] = open.back();
    open.pop_back();
    if (level > most_levels)
      throw ConfigError(
          fmt::format("{}:{}: nested more than {} deep (allowed: less)", name, node->source().begin.line, most_levels));
    if (const toml::table* table = node->as_table())
      for (const auto& [key, value] : *table) {
        if (key.str().size() > longest_key)
          throw ConfigError(fmt::format("{}:{}: a key of {} characters (allowed: at most {})", name,
                                        key.source().begin.line, key.str().size(), longest_key));
        open.emplace_back(&value, level + 1);
      }
    if (const toml::array* array = node->as_array())
      for (const toml::node& value : *array)
        if (!value.is_value()) open.emplace_back(&value, level + 1);
  }
}

/// Whether a path is `top` or below it.
bool within(const std::string& path, const std::string& top) {
  return path.starts_with(top) &&
         (top.empty() || path.size() == top.size() || path[top.size()] == '.' || path[top.size()] == '[');
}

}  // namespace

Document Document::from_text(const std::string& text, const std::string& name) {
  Document document(name);
  require_short_keys(text, name);
  try {
    document.root_ = toml::parse(text, name);
    require_shallow(document.root_, name);
  } catch (const toml::parse_error& error) {
    throw ConfigError(fmt::format("{}:{}: not valid TOML: {} (allowed: valid TOML)", name, error.source().begin.line,
                                  error.description()));
  } catch (const std::bad_alloc&) {
    throw ConfigError(fmt::format("{}: does not fit into memory (allowed: less)", name));
  }
  Origins(name, document.origins_).note(document.root_, "");
  return document;
}

Document Document::from_file(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    throw ConfigError(fmt::format("{}: is a folder (allowed: a readable TOML file)", path));
  const auto text = read_whole_file(path, file_size::configuration);
  if (!text) throw ConfigError(fmt::format("{}: cannot be read (allowed: a readable TOML file)", path));
  return from_text(*text, path);
}

Document Document::part(const std::string& path, const toml::table& table) const {
  Document part(name_);
  part.path_ = path;
  part.root_ = table;
  part.carried_ = carried_;
  part.comes_from(path, *this, path);
  return part;
}

std::string Document::where(const std::string& path) const {
  for (std::string around = path;;) {
    if (const auto known = origins_.find(around); known != origins_.end()) return known->second;
    if (around.empty()) return name_;
    const std::size_t end = around.find_last_of(".[");
    around.resize(end == std::string::npos ? 0 : end);
  }
}

void Document::set_by(const std::string& path, const std::string& who) {
  for (auto origin = origins_.lower_bound(path); origin != origins_.end() && origin->first.starts_with(path);)
    origin = within(origin->first, path) ? origins_.erase(origin) : std::next(origin);
  origins_[path] = who;
}

void Document::comes_from(const std::string& path, const Document& other, const std::string& from) {
  std::map<std::string, std::string> taken;  // the other may be this one
  for (auto origin = other.origins_.lower_bound(from);
       origin != other.origins_.end() && origin->first.starts_with(from); ++origin)
    if (within(origin->first, from)) taken.emplace(path + origin->first.substr(from.size()), origin->second);
  set_by(path, other.where(from));
  for (auto& [at, origin] : taken) origins_[at] = std::move(origin);
}

std::optional<std::string> Document::linked(const std::string& file) const {
  const auto carried = carried_.find(file);
  return carried != carried_.end() ? *carried->second : read_whole_file(beside(file), file_size::linked);
}

std::string Document::beside(const std::string& file) const {
  return (std::filesystem::path(name_).parent_path() / file).string();
}

std::string toml_text(const toml::table& table) {
  std::ostringstream text;
  text << toml::toml_formatter{table, toml::format_flags::none};
  return text.str();
}

}  // namespace solenoid
