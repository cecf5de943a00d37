#pragma once

#include "experiments/profile/profile.hpp"
#include "experiments/profile/quality.hpp"
#include "experiments/profile/regression.hpp"

#include <optional>
#include <string>

namespace solenoid {

struct Result;

/// Everything a `profile` command found.
struct ProfileResult {
  Profile profile;
  std::string source;  ///< of the instances, for a person
  std::vector<QualityPoint> quality;
  std::string judged = "error", judged_heading = "error";  ///< what the quality is of: a metric's key and heading
  std::optional<ProfileChange> change;
  double threshold = 1.2;
};

/// Times, where they go, a histogram a variant, the quality curve and the comparison, where there are any. JSON:
/// `{"variants": [...], ...}`; with `instances` each variant also has `solve_us`, its instances' times, as an earlier
/// profile needs them. CSV: a line a variant. Drawn is the quality curve.
Result result_of(const ProfileResult& result, bool instances = false);

/// The JSON of a result with `instances`. Throws ConfigError for anything else.
Profile read_profile(const std::string& path);

}  // namespace solenoid
