#pragma once

#include "core/config/document.hpp"
#include "experiments/campaign/campaign.hpp"

#include <string>
#include <vector>

#include <toml++/toml.h>

namespace solenoid {

/// A copy of a variant's or scenario's table that means the same beside `inputs`.
struct Carried {
  toml::table table;
  toml::table key;               ///< the table with each file's content in place of its name
  std::vector<InputFile> files;  ///< that it names
};

/// Copies tables; every text in them that names a readable .csv or .toml file is carried into a campaign's inputs.
class Carrier {
 public:
  explicit Carrier(std::vector<InputFile>& inputs) : inputs_(inputs) {}

  Carried carry(const Document& document);

 private:
  void rewrite(toml::table& moved, toml::table& keyed, const Document& document, std::vector<InputFile>& files);
  std::string add(const std::string& path, const std::string& hash, const std::string& content);

  std::vector<InputFile>& inputs_;
};

}  // namespace solenoid
