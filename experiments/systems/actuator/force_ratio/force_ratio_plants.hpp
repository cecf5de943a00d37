#pragma once

#include "core/config/document.hpp"
#include "experiments/systems/actuator/force_ratio/force_ratio_design.hpp"

#include <string>
#include <vector>

namespace solenoid {

/// The truth plant with a ratio's cylinder and motor: the shipped twin, scaled.
Document twin_of(const RatioDesign& design);

/// The shipped controller of a law, believing in a ratio's cylinder and motor.
Document controller_of(const std::string& law, const RatioDesign& design);

/// Which of the shipped plants a campaign has.
struct RatioPlants {
  std::vector<std::string> groups;  ///< what their names begin with
  int members = 1;                  ///< drawn of each
  bool quick = false;               ///< short motions
};

/// The campaign FOLDER/NAME.toml of a controller, by this variant's name, on plants whose truth is `twin`; written there
/// too, with twin.toml beside it, for a person to run again.
Document ratio_campaign(const std::string& folder, const std::string& name, const std::string& variant,
                        const Document& controller, const Document& twin, const RatioPlants& plants);

}  // namespace solenoid
