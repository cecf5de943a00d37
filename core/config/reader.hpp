#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace solenoid {

class Document;

/// This error says why a configuration cannot be used: in one_line, with file, line, key and what is allowed.
class ConfigError : public std::runtime_error {
 public:
  explicit ConfigError(std::string_view what);
};

/// A number must lie in this inclusive range; text() has the words that an error uses for it.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool open_low = false;  ///< low itself is excluded

  static Range any() { return {}; }
  static Range positive() { return {0.0, std::numeric_limits<double>::infinity(), true}; }
  static Range non_negative() { return {0.0}; }
  static Range between(double low, double high) { return {low, high}; }
  bool contains(double value) const { return value <= high && (open_low ? value > low : value >= low); }
  std::string text() const;
};

/// A file that a document names.
struct LinkedFile {
  std::string path;
  std::optional<std::string> text;  ///< none: cannot be read
};

/// Reads one table of a TOML document key by key: every getter checks type and range, and finish() refuses the keys
/// that nobody asked for. All errors are ConfigErrors of the form `FILE:LINE: key 'a.b': problem (allowed: ...)`, with
/// who set the key in place of file and line if it was set in memory.
class TableReader {
 public:
  explicit TableReader(Document document);
  explicit TableReader(std::shared_ptr<const Document> document);
  /// Reads a file. Throws ConfigError if it cannot be read or is not TOML.
  static TableReader from_file(const std::string& path);
  static TableReader from_text(const std::string& text, const std::string& name);
  ~TableReader();
  TableReader(TableReader&&) noexcept;
  TableReader& operator=(TableReader&&) noexcept;

  bool has(const std::string& key);
  bool is_table(const std::string& key);
  std::vector<std::string> keys() const;

  double number(const std::string& key, Range range = Range::any());
  double number_or(const std::string& key, double fallback, Range range = Range::any());
  int integer(const std::string& key, int low, int high);
  int integer_or(const std::string& key, int fallback, int low, int high);
  bool boolean_or(const std::string& key, bool fallback);
  /// Reads a text; an empty `allowed` takes any.
  std::string text(const std::string& key, const std::vector<std::string>& allowed = {});
  std::string text_or(const std::string& key, const std::string& fallback,
                      const std::vector<std::string>& allowed = {});
  std::vector<int> integers(const std::string& key, int low, int high);
  std::vector<double> numbers(const std::string& key, Range range = Range::any());
  std::vector<std::string> texts(const std::string& key);
  TableReader table(const std::string& key);
  std::vector<TableReader> tables(const std::string& key);  ///< an array of tables ([[key]]); empty if absent
  LinkedFile file(const std::string& key);                  ///< that this text names
  TableReader file_table(const std::string& key);           ///< of the TOML file that this text names

  /// Refuses keys that no getter was asked for.
  void finish();

  /// Throws the ConfigError of this key.
  [[noreturn]] void fail(const std::string& key, const std::string& problem) const;
  /// Returns `FILE:LINE` of the key, or of the table; whoever set it, if it was set in memory.
  std::string where(const std::string& key = "") const;
  const Document& document() const;

 private:
  struct Node;
  explicit TableReader(std::unique_ptr<Node> node);
  std::unique_ptr<Node> node_;
};

}  // namespace solenoid
