#pragma once

#include "experiments/profile/profile.hpp"
#include "experiments/profile/quality.hpp"
#include "experiments/profile/regression.hpp"

#include <optional>
#include <string>

namespace solenoid {

/// Everything a `profile` command found.
struct ProfileResult {
  Profile profile;
  std::string source;  ///< of the instances, for a person
  std::vector<QualityPoint> quality;
  std::optional<ProfileChange> change;
  double threshold = 1.2;
};

/// For a person: times, where they go, a histogram a variant, the quality curve and the comparison, where there are
/// any.
std::string profile_text(const ProfileResult& result, bool colour);

/// `{"variants": [...]}`; with `instances` each variant also has `solve_us`, its instances' times, as an earlier
/// profile needs them.
std::string profile_json(const ProfileResult& result, bool instances);

/// A heading line, then one line a variant.
std::string profile_csv(const ProfileResult& result);

/// What profile_json wrote with `instances`. Throws ConfigError for anything else.
Profile read_profile(const std::string& path);

}  // namespace solenoid
