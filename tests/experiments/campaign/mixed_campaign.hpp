#pragma once

#include "core/config/document.hpp"
#include "experiments/campaign/campaign.hpp"

#include <string>

#include <fmt/format.h>

namespace solenoid::test {

inline Campaign campaign_from(const std::string& text) { return read_campaign(Document::from_text(text, "c.toml")); }

/// Two variants of which one is not real time, an ensemble and a plain scenario of another length, three seeds.
inline Campaign mixed_campaign(int members = 21) {
  return campaign_from(fmt::format(R"(
variants = ["thesis_pd", "nine_pd", "slow"]
seeds = [1, 2, 3]
[variant.slow]
valves = "three_way"
solver = "ipopt"
[[scenario]]
name = "many"
trajectory = {{ kind = "step" }}
ensemble = {{ members = {}, sampling = "sobol", seed = 3, friction = [0.7, 2.0] }}
[[scenario]]
name = "one"
trajectory = {{ kind = "sine" }}
)",
                                   members));
}

}  // namespace solenoid::test
