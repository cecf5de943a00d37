#pragma once

#include "experiments/campaign/stored_runs.hpp"

#include <optional>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

namespace solenoid {

/// What manifest.json says beside the campaign's runs.
struct ManifestFacts {
  std::string status;  ///< running | finished | interrupted | failed
  std::string reason;  ///< of a failure
  std::string started, ended;
  int jobs = 0;    ///< 0: not said
  int shards = 0;  ///< that the campaign was parted into; 0: not said
};

/// manifest.json of a campaign run by this program on this machine; `runs`: null, or those that there are.
std::string manifest_text(const Campaign& campaign, const ManifestFacts& facts, const StoredRuns* runs);

/// The same of a folder whose runs somebody else may have made: what `manifest` says of program, machine and times stays, and
/// status, end, hosts and counts become those of now.
std::string merged_manifest(nlohmann::ordered_json manifest, const std::string& status, const Campaign& campaign,
                            const StoredRuns& runs);

/// Who made a folder's runs (Campaign::maker), by its manifest; none if that does not say.
std::optional<std::string> maker_of(const nlohmann::ordered_json& manifest);
/// The same by its manifest.json, which need not be there.
std::optional<std::string> maker_of_folder(const std::string& folder);

}  // namespace solenoid
