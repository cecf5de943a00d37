#pragma once

#include "core/config/document.hpp"
#include "core/config/reader.hpp"
#include "experiments/campaign/campaign.hpp"

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace solenoid {

/// The files, shipped with the program or a plug-in, whose variants are known everywhere, most of them campaigns too.
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

  /// Starts with the shipped variants. Of the selection it is whether plug-ins are loaded and what happens to those that
  /// are refused.
  explicit Library(const Selection& selection = {});

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
  /// Why plug-ins were refused, if that is no error.
  const std::vector<std::string>& refused_plugins() const { return refused_plugins_; }

 private:
  using Loaded = std::shared_ptr<const Document>;
  /// Takes up the variants of what is shipped and has not been looked at.
  void adopt_shipped();
  /// Loads the plug-ins whose files a document names, and sees that those are there which it calls by name.
  void require_plugins(const Document& document, TableReader& reader);
  void load_or_leave_out(const std::string& plugin);
  void load(const std::string& path, std::vector<std::string>& including);
  void take(const Loaded& document, std::vector<std::string>& including);
  void adopt_variants(const Loaded& document, TableReader& reader, bool shipped, bool overrides);
  void adopt_scenarios(const Loaded& document, TableReader& reader);

  bool loads_plugins_, leaves_out_;
  std::vector<std::string> refused_plugins_;
  std::map<std::string, Entry> variants_;
  std::vector<std::string> order_;
  std::vector<Entry> scenarios_;
  std::map<std::string, std::string> scenario_places_;  // by name: where the scenario is
  std::vector<TableReader> readers_;  // of the documents, included ones before those that include them
  std::vector<std::string> loaded_;
  std::size_t bytes_ = 0;    // of all files
  std::size_t shipped_ = 0;  // documents whose variants are known
};

/// The campaign that a library was loaded with.
Campaign read_campaign(Library& library, const Selection& selection = {});

}  // namespace solenoid
