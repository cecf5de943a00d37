#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include <toml++/toml.h>

namespace solenoid {

/// A TOML document in memory, to be read by a TableReader, copied and changed. Values keep the place they came from, for
/// the errors of whoever reads them, also as copies and in documents put together from others. This header needs toml++.
///
/// path   of a value, dotted as errors print it: "variant.mine.cost", "scenario[0].trajectory"; empty: the whole
class Document {
 public:
  /// An empty document; relative files are beside `name`.
  explicit Document(std::string name) : name_(std::move(name)) {}
  /// Throws ConfigError if the file cannot be read or is not TOML.
  static Document from_file(const std::string& path);
  /// Throws ConfigError if it is not TOML.
  static Document from_text(const std::string& text, const std::string& name);
  /// A copy of a table of this document, or of what became of it, as a document whose root is at `path`.
  Document part(const std::string& path, const toml::table& table) const;

  const std::string& name() const { return name_; }
  const std::string& path() const { return path_; }  ///< of the root; empty but for a part
  toml::table& root() { return root_; }
  const toml::table& root() const { return root_; }

  /// `FILE:LINE` of a value, or of the nearest thing around it; whoever set it, if someone did.
  std::string where(const std::string& path) const;
  /// Names who set the value at a path and all below it.
  void set_by(const std::string& path, const std::string& who);
  /// Lets what is at `path` come from where `from` in another document does: for a copy of it.
  void comes_from(const std::string& path, const Document& other, const std::string& from);

  /// Takes along a file that values of this document name.
  void carry(const std::string& file, std::string text) {
    carried_.insert_or_assign(file, std::make_shared<const std::string>(std::move(text)));
  }
  /// The text of a file that a value names: carried, or beside the document. Nothing if it cannot be read.
  std::optional<std::string> linked(const std::string& file) const;
  /// A file beside the document.
  std::string beside(const std::string& file) const;

 private:
  std::string name_, path_;
  toml::table root_;
  std::map<std::string, std::string> origins_;                         // of each value by its path
  std::map<std::string, std::shared_ptr<const std::string>> carried_;  // text of each file, which copies share
};

/// The table as a document's text.
std::string toml_text(const toml::table& table);

}  // namespace solenoid
