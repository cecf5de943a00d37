#pragma once

#include "experiments/campaign/campaign.hpp"
#include "experiments/profile/profile_report.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

class Document;

/// What a profile is asked for: which problems, how measured, compared with what.
struct ProfileTask {
  /// Problems are recorded from this: a campaign's file, a shipped one's name, or a run's log.mcap; empty: those below.
  std::string campaign;
  std::shared_ptr<const Document> document;  ///< the campaign, in place of a file's
  std::string instances;                     ///< file of problems; empty: the shipped ones
  std::shared_ptr<const InstanceSet> set;    ///< the problems, in place of a file's
  std::string record;  ///< file that recorded problems are kept in; alone: of the campaign "profile"
  Selection selection;
  std::size_t per_variant = 700;
  std::vector<double> budgets_ms;  ///< closed loops with every solve cut at these
  std::string save, against;       ///< files of profiles: to keep this one in, and an earlier one
  double threshold = 1.2;          ///< ratio that counts as slower
  ProfileOptions options;
  std::function<void(const std::string&)> tell = [](const std::string&) {};  ///< what begins now, and what is wrong
};

/// Records or reads the problems, replays them, and runs the closed loops of the quality curve. Nothing if
/// `options.interrupted`. Throws ConfigError naming file or option.
std::optional<ProfileResult> profile(const ProfileTask& task);

/// The problems of a file, or those that ship.
InstanceSet instances_from(const std::string& path);

/// Leaves only the variants asked for; none: all. Throws ConfigError naming those there are.
void select_variants(const std::vector<std::string>& wanted, InstanceSet& set);

}  // namespace solenoid
