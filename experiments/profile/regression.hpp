#pragma once

#include "experiments/profile/profile.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// How a variant's times relate to an earlier profile's, with the 95 % interval of a bootstrap over instances.
struct RatioInterval {
  double ratio = 1.0, low = 1.0, high = 1.0;
};

struct VariantChange {
  std::string name;
  RatioInterval typical;  ///< geometric mean of now / then over instances
  RatioInterval tail;     ///< p99 now / p99 then
  bool slower = false;    ///< one of the intervals lies wholly above the threshold
};

struct ProfileChange {
  std::vector<VariantChange> variants;  ///< that both have
  std::vector<std::string> only_now, only_then;
  bool slower() const;
};

/// Compares instance by instance. Throws ConfigError when a variant's instances are not the same, or none is common.
ProfileChange compare_profiles(const Profile& now, const Profile& then, const std::string& then_name, double threshold);

}  // namespace solenoid
