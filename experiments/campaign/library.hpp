#pragma once

#include "core/config/reader.hpp"

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <toml++/toml.h>

namespace solenoid {

/// The table as a document.
std::string toml_text(const toml::table& table);

/// A TOML document twice: as a reader that checks every key, and as the tables themselves, to be copied into a resolved
/// configuration.
struct Document {
  TableReader reader;
  toml::table raw;
  std::string path;  ///< of the file, or the name of a shipped one

  Document(const std::string& text, const std::string& name);
};

/// What a campaign file and the files it includes define, each thing with the document it came from.
class Library {
 public:
  struct Entry {
    std::shared_ptr<Document> document;
    TableReader reader;
    const toml::table* raw;
    bool shipped = false;
  };

  /// Starts with the shipped variants.
  Library();

  /// Loads a campaign file and, first, what it includes.
  void load(const std::string& path);

  std::map<std::string, Entry>& variants() { return variants_; }
  const std::vector<std::string>& variant_order() const { return order_; }
  std::vector<Entry>& scenarios() { return scenarios_; }
  /// The outermost file that has the key, or the last of the included ones.
  Document* with_key(const std::string& key) const;
  Document& root() const { return *documents_.back(); }

 private:
  void load(const std::string& path, std::vector<std::string>& including);
  void adopt_variants(const std::shared_ptr<Document>& document, bool shipped, bool overrides);
  void adopt_scenarios(const std::shared_ptr<Document>& document);

  std::map<std::string, Entry> variants_;
  std::vector<std::string> order_;
  std::vector<Entry> scenarios_;
  std::vector<std::shared_ptr<Document>> documents_;  // included ones before those that include them
  std::vector<std::string> loaded_;
};

}  // namespace solenoid
