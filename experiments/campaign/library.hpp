#pragma once

#include "core/config/document.hpp"
#include "core/config/reader.hpp"
#include "experiments/campaign/campaign.hpp"

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace solenoid {

/// The shipped files whose variants are known everywhere, most of them campaigns too; parsed once.
const std::vector<std::shared_ptr<const Document>>& shipped_campaign_documents();

/// What a campaign file and the files it includes define, each thing with the document it came from.
class Library {
 public:
  struct Entry {
    std::shared_ptr<const Document> document;
    std::string path;          ///< of its table in the document
    const toml::table* table;  ///< as it is written there
    TableReader reader;
    bool shipped = false;
  };

  /// Starts with the shipped variants.
  Library();

  /// Loads a campaign file and, first, what it includes.
  void load(const std::string& path);
  /// The same of a campaign in memory.
  void load(Document document);

  std::map<std::string, Entry>& variants() { return variants_; }
  const std::vector<std::string>& variant_order() const { return order_; }
  std::vector<Entry>& scenarios() { return scenarios_; }
  /// The outermost document that has the key, or the last of the included ones.
  TableReader* with_key(const std::string& key);
  TableReader& root() { return readers_.back(); }

 private:
  using Loaded = std::shared_ptr<const Document>;
  void load(const std::string& path, std::vector<std::string>& including);
  void take(const Loaded& document, std::vector<std::string>& including);
  void adopt_variants(const Loaded& document, TableReader& reader, bool shipped, bool overrides);
  void adopt_scenarios(const Loaded& document, TableReader& reader);

  std::map<std::string, Entry> variants_;
  std::vector<std::string> order_;
  std::vector<Entry> scenarios_;
  std::map<std::string, std::string> scenario_places_;  // by name: where the scenario is
  std::vector<TableReader> readers_;  // of the documents, included ones before those that include them
  std::vector<std::string> loaded_;
  std::size_t bytes_ = 0;  // of all files
};

/// The campaign that a library was loaded with.
Campaign read_campaign(Library& library, const Selection& selection = {});

}  // namespace solenoid
