#include "core/system/description.hpp"

#include "core/reference/trajectory.hpp"
#include "core/safety/faults.hpp"
#include "core/systems/actuator/signals.hpp"
#include "core/systems/inverter/signals.hpp"
#include "core/systems/thrusters/signals.hpp"

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

TEST(Description, OfEverySystemIsComplete) {
  for (const SystemDescription* system : {&actuator_description(), &thrusters_description(), &inverter_description()})
    EXPECT_NO_THROW(require_complete(*system)) << system->name;
}

TEST(Description, WhatIsMissingOrPointsToNothingIsNamed) {
  using Change = std::function<void(SystemDescription&)>;
  const std::pair<const char*, Change> cases[] = {
      {"no name", [](SystemDescription& s) { s.name.clear(); }},
      {"13 states", [](SystemDescription& s) { s.states.resize(13); }},
      {"7 channels", [](SystemDescription& s) { s.channels.resize(7); }},
      {"estimate_keys", [](SystemDescription& s) { s.estimate_keys.pop_back(); }},
      {"decided_keys", [](SystemDescription& s) { s.decided_keys.emplace_back("one too many"); }},
      {"reference_keys", [](SystemDescription& s) { s.reference_keys.pop_back(); }},
      {"no axis", [](SystemDescription& s) { s.axes.clear(); }},
      {"no such state", [](SystemDescription& s) { s.axes[0].state = s.states.size(); }},
      {"no such channel", [](SystemDescription& s) { s.axes[0].channel = s.channels.size(); }},
      {"no output", [](SystemDescription& s) { s.outputs.clear(); }},
      {"no such axis", [](SystemDescription& s) { s.outputs[0].axis = s.axes.size(); }},
      {"derivative", [](SystemDescription& s) { s.outputs[0].derivative = 3; }},
      {"'beauty' is no metric", [](SystemDescription& s) { s.judged.metric = "beauty"; }},
      {"timing", [](SystemDescription& s) { s.timing.tick_s = 0.0; }}};
  for (const auto& [what, change] : cases) {
    SystemDescription changed = thrusters_description();
    change(changed);
    try {
      require_complete(changed);
      ADD_FAILURE() << what;
    } catch (const std::logic_error& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(what));
    }
  }
}

TEST(Description, NamesLimitsInASystemsOwnWords) {
  FaultSet faults;
  faults.add(Fault::axis_limit);
  EXPECT_EQ(to_string(faults, actuator_description()), "position limit");
  EXPECT_EQ(to_string(faults, inverter_description()), "current limit");
  EXPECT_EQ(to_string(faults, thrusters_description()), "axis limit");
}

TEST(Trajectory, AHarmonicIsOneFromItsOwnBeginningOnAndForEver) {
  const double w = 2 * std::numbers::pi * 50.0, phase = 0.7;
  const Trajectory turning = Trajectory(0.0)
                                 .harmonic(3.0, 50.0, phase, 0.013)
                                 .harmonic(5.0, 50.0, phase + w * 0.013, std::numeric_limits<double>::infinity());
  EXPECT_DOUBLE_EQ(turning.start(), 3.0 * std::cos(phase));
  for (const double t : {0.0, 0.004, 0.0129, 0.0131, 0.02, 1.0, 1e4}) {
    const double amplitude = t < 0.013 ? 3.0 : 5.0;
    const MotionSample at = turning.at(t);
    const double rounding = 1e-15 * (1 + w * t) * amplitude * 10;
    EXPECT_NEAR(at.value, amplitude * std::cos(w * t + phase), rounding) << t;
    EXPECT_NEAR(at.rate, -w * amplitude * std::sin(w * t + phase), w * rounding) << t;
    EXPECT_NEAR(at.acceleration, -w * w * amplitude * std::cos(w * t + phase), w * w * rounding) << t;
  }
}

}  // namespace
}  // namespace solenoid
