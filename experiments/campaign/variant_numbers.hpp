#pragma once

#include "experiments/base/files.hpp"
#include "experiments/campaign/campaign.hpp"

#include <optional>
#include <string>

#include <toml++/toml.h>

namespace solenoid {

/// A campaign as a document to change and read again, the files it names beside it. What the reader refuses it refuses
/// here.
class CampaignDraft {
 public:
  explicit CampaignDraft(const Campaign& campaign);

  /// The campaign as it was read.
  const toml::table& document() const { return document_; }
  Campaign read(const toml::table& document, const Selection& selection = {}) const;

 private:
  TemporaryFolder folder_;
  toml::table document_;
};

/// The number at a dotted key of a variant's table, if it has one: "cost.switching", or of an array "horizon.blocks.0".
std::optional<double> number_at(const toml::table& variant, const std::string& key);

/// Sets it, making the tables on the way. A block's length also sets horizon.steps to what the blocks are together.
/// Throws ConfigError if something on the way is no table, or the array has no such element.
void set_number(toml::table& variant, const std::string& key, double value, bool whole);

}  // namespace solenoid
