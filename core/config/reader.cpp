#include "core/config/reader.hpp"

#include "core/config/document.hpp"
#include "core/config/one_line.hpp"

#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {

ConfigError::ConfigError(std::string_view what) : std::runtime_error(one_line(what)) {}

std::string Range::text() const {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  if (low == -infinity && high == infinity) return "a finite number";
  if (high == infinity) return fmt::format("a number {} {}", open_low ? ">" : ">=", low);
  if (low == -infinity) return fmt::format("a number <= {}", high);
  return fmt::format("a number from {}{} to {}", open_low ? "above " : "", low, high);
}

/// A table with the document that keeps it alive.
struct TableReader::Node {
  std::shared_ptr<const Document> document;
  const toml::table* table = nullptr;
  std::string prefix;  // the table's path
  std::set<std::string, std::less<>> known = {};

  const toml::node* find(const std::string& key) {
    known.insert(key);
    return table->get(key);
  }
  std::string path(const std::string& key) const {
    return prefix.empty() || key.empty() ? prefix + key : prefix + "." + key;
  }
};

TableReader::TableReader(std::unique_ptr<Node> node) : node_(std::move(node)) {}
TableReader::TableReader(Document document) : TableReader(std::make_shared<const Document>(std::move(document))) {}
TableReader::TableReader(std::shared_ptr<const Document> document) : node_(new Node) {
  node_->table = &document->root();
  node_->prefix = document->path();
  node_->document = std::move(document);
}
TableReader::~TableReader() = default;
TableReader::TableReader(TableReader&&) noexcept = default;
TableReader& TableReader::operator=(TableReader&&) noexcept = default;

TableReader TableReader::from_text(const std::string& text, const std::string& name) {
  return TableReader(Document::from_text(text, name));
}
TableReader TableReader::from_file(const std::string& path) { return TableReader(Document::from_file(path)); }

const Document& TableReader::document() const { return *node_->document; }

std::string TableReader::where(const std::string& key) const { return node_->document->where(node_->path(key)); }

void TableReader::fail(const std::string& key, const std::string& problem) const {
  throw ConfigError(fmt::format("{}: key '{}': {}", where(key), node_->path(key), problem));
}

bool TableReader::has(const std::string& key) { return node_->find(key) != nullptr; }

bool TableReader::is_table(const std::string& key) {
  const toml::node* found = node_->find(key);
  return found && found->is_table();
}

std::vector<std::string> TableReader::keys() const {
  std::vector<std::string> names;
  for (const auto& [key, value] : *node_->table) names.emplace_back(key.str());
  return names;
}

double TableReader::number(const std::string& key, Range range) {
  const toml::node* found = node_->find(key);
  if (!found) fail(key, fmt::format("missing (allowed: {})", range.text()));
  if (!found->is_number()) fail(key, fmt::format("wrong type (allowed: {})", range.text()));
  const double value = *found->value<double>();
  if (!std::isfinite(value) || !range.contains(value))
    fail(key, fmt::format("{} is refused (allowed: {})", value, range.text()));
  return value;
}

double TableReader::number_or(const std::string& key, double fallback, Range range) {
  return has(key) ? number(key, range) : fallback;
}

int TableReader::integer(const std::string& key, int low, int high) {
  const std::string allowed = fmt::format("a whole number from {} to {}", low, high);
  const toml::node* found = node_->find(key);
  if (!found) fail(key, fmt::format("missing (allowed: {})", allowed));
  if (!found->is_integer()) fail(key, fmt::format("wrong type (allowed: {})", allowed));
  const auto value = *found->value<std::int64_t>();
  if (value < low || value > high) fail(key, fmt::format("{} is refused (allowed: {})", value, allowed));
  return static_cast<int>(value);
}

int TableReader::integer_or(const std::string& key, int fallback, int low, int high) {
  return has(key) ? integer(key, low, high) : fallback;
}

bool TableReader::boolean_or(const std::string& key, bool fallback) {
  const toml::node* found = node_->find(key);
  if (!found) return fallback;
  if (!found->is_boolean()) fail(key, "wrong type (allowed: true, false)");
  return *found->value<bool>();
}

std::string TableReader::text(const std::string& key, const std::vector<std::string>& allowed) {
  const std::string words = allowed.empty() ? "a text" : fmt::format("{}", fmt::join(allowed, ", "));
  const toml::node* found = node_->find(key);
  if (!found) fail(key, fmt::format("missing (allowed: {})", words));
  if (!found->is_string()) fail(key, fmt::format("wrong type (allowed: {})", words));
  std::string value = *found->value<std::string>();
  if (!allowed.empty() && std::find(allowed.begin(), allowed.end(), value) == allowed.end())
    fail(key, fmt::format("'{}' is not known (allowed: {})", value, words));
  return value;
}

std::string TableReader::text_or(const std::string& key, const std::string& fallback,
                                 const std::vector<std::string>& allowed) {
  return has(key) ? text(key, allowed) : fallback;
}

namespace {

template <class T, class Check>
std::vector<T> read_array(const toml::node* found, const std::function<void(const std::string&)>& fail,
                          const std::string& allowed, Check check) {
  if (!found || !found->is_array())
    fail(fmt::format("{} (allowed: a list of {})", found ? "wrong type" : "missing", allowed));
  std::vector<T> values;
  for (const toml::node& item : *found->as_array()) {
    const std::optional<T> value = check(item);
    if (!value) fail(fmt::format("entry {} is refused (allowed: a list of {})", values.size() + 1, allowed));
    values.push_back(*value);
  }
  return values;
}

}  // namespace

std::vector<int> TableReader::integers(const std::string& key, int low, int high) {
  return read_array<int>(
      node_->find(key), [&](const std::string& problem) { fail(key, problem); },
      fmt::format("whole numbers from {} to {}", low, high),
      [&](const toml::node& item) -> std::optional<int> {
        if (!item.is_integer()) return std::nullopt;
        const auto value = *item.value<std::int64_t>();
        if (value < low || value > high) return std::nullopt;
        return static_cast<int>(value);
      });
}

std::vector<double> TableReader::numbers(const std::string& key, Range range) {
  return read_array<double>(
      node_->find(key), [&](const std::string& problem) { fail(key, problem); }, "numbers, each " + range.text(),
      [&](const toml::node& item) -> std::optional<double> {
        if (!item.is_number()) return std::nullopt;
        const double value = *item.value<double>();
        if (!std::isfinite(value) || !range.contains(value)) return std::nullopt;
        return value;
      });
}

std::vector<std::string> TableReader::texts(const std::string& key) {
  return read_array<std::string>(
      node_->find(key), [&](const std::string& problem) { fail(key, problem); }, "texts",
      [](const toml::node& item) { return item.value_exact<std::string>(); });
}

TableReader TableReader::table(const std::string& key) {
  const toml::node* found = node_->find(key);
  if (!found || !found->is_table()) fail(key, found ? "wrong type (allowed: a table)" : "missing (allowed: a table)");
  return TableReader(std::unique_ptr<Node>(new Node{node_->document, found->as_table(), node_->path(key)}));
}

std::vector<TableReader> TableReader::tables(const std::string& key) {
  const toml::node* found = node_->find(key);
  std::vector<TableReader> all;
  if (!found) return all;
  const auto refuse = [&] { fail(key, fmt::format("wrong type (allowed: tables, each headed [[{}]])", key)); };
  if (!found->is_array()) refuse();
  for (const toml::node& item : *found->as_array()) {
    if (!item.is_table()) refuse();
    const std::string path = fmt::format("{}[{}]", node_->path(key), all.size());
    all.push_back(TableReader(std::unique_ptr<Node>(new Node{node_->document, item.as_table(), path})));
  }
  return all;
}

LinkedFile TableReader::file(const std::string& key) {
  const std::string name = text(key);
  return {node_->document->beside(name), node_->document->linked(name)};
}

TableReader TableReader::file_table(const std::string& key) {
  const LinkedFile linked = file(key);
  return linked.text ? from_text(*linked.text, linked.path) : from_file(linked.path);
}

void TableReader::finish() {
  for (const auto& [key, value] : *node_->table)
    if (!node_->known.contains(key.str()))
      fail(std::string(key.str()), fmt::format("not known (allowed: {})", fmt::join(node_->known, ", ")));
}

}  // namespace solenoid
