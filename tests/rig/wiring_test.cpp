// What was seen of a rig's wiring, and the wirings that explain it.
#include "experiments/systems/actuator/commission/wiring.hpp"

#include <algorithm>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace solenoid {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// Every wiring with one fault.
std::vector<Wiring> single_faults(bool three_way) {
  std::vector<Wiring> all(7);
  all[0].position_inverted = all[1].motor_inverted = all[2].motor_dead = true;
  all[3].pressures_swapped = all[4].valves_swapped = all[5].no_supply = true;
  all[6].position_dead = true;
  for (const std::size_t k : {0u, 1u}) {
    all.emplace_back().pressure_inverted[k] = true;
    all.emplace_back().pressure_dead[k] = true;
    all.emplace_back().exchanged[k] = true;
  }
  for (std::size_t c = 0; c < (three_way ? 2u : 4u); ++c) all.emplace_back().dead[c] = true;
  return all;
}

Wiring both(const Wiring& one, const Wiring& other) {
  Wiring w;
  w.position_inverted = one.position_inverted || other.position_inverted;
  w.position_dead = one.position_dead || other.position_dead;
  w.motor_inverted = one.motor_inverted || other.motor_inverted;
  w.motor_dead = one.motor_dead || other.motor_dead;
  w.pressures_swapped = one.pressures_swapped || other.pressures_swapped;
  w.valves_swapped = one.valves_swapped || other.valves_swapped;
  w.no_supply = one.no_supply || other.no_supply;
  for (const std::size_t k : {0u, 1u}) {
    w.pressure_inverted[k] = one.pressure_inverted[k] || other.pressure_inverted[k];
    w.pressure_dead[k] = one.pressure_dead[k] || other.pressure_dead[k];
    w.exchanged[k] = one.exchanged[k] || other.exchanged[k];
  }
  for (std::size_t c = 0; c < w.dead.size(); ++c) w.dead[c] = one.dead[c] || other.dead[c];
  return w;
}

/// What does nothing has no sign.
bool has_its_signs(const Wiring& w) {
  return !(w.motor_inverted && w.motor_dead) && !(w.position_inverted && w.position_dead) &&
         !(w.pressure_inverted[0] && w.pressure_dead[0]) && !(w.pressure_inverted[1] && w.pressure_dead[1]);
}

/// What a rig shows by itself, nobody having moved the slide by hand.
WiringSeen without_hand(const Wiring& wiring, bool three_way) {
  WiringSeen seen = expected_of(wiring, three_way);
  seen.by_hand.reset();
  return seen;
}

TEST(Wiring, ASoundRigHasNoFinding) {
  for (const bool three_way : {false, true}) EXPECT_THAT(diagnosis(without_hand({}, three_way)), IsEmpty());
}

TEST(Wiring, EachSingleFaultIsFoundAndNothingElse) {
  for (const bool three_way : {false, true})
    for (const Wiring& w : single_faults(three_way)) {
      SCOPED_TRACE(w.words(three_way).front());
      EXPECT_THAT(explanations(without_hand(w, three_way)), ElementsAre(w));
      EXPECT_EQ(diagnosis(without_hand(w, three_way)), w.words(three_way));
    }
}

/// Of two faults the truth is among the explanations unless fewer faults show the same; what is said is never something
/// that would not show what was seen.
TEST(Wiring, OfTwoFaultsTheTruthOrSomethingSimplerThatShowsTheSame) {
  for (const bool three_way : {false, true}) {
    const std::vector<Wiring> one = single_faults(three_way);
    int told = 0, pairs = 0;
    for (std::size_t i = 0; i < one.size(); ++i)
      for (std::size_t j = i + 1; j < one.size(); ++j) {
        const Wiring w = both(one[i], one[j]);
        if (!has_its_signs(w)) continue;
        const WiringSeen seen = expected_of(w, three_way);
        const std::vector<Wiring> found = explanations(seen);
        ASSERT_FALSE(found.empty());
        for (const Wiring& f : found) {
          EXPECT_LE(f.faults(), 2);
          const WiringSeen again = expected_of(f, three_way);
          for (std::size_t c = 0; c < seen.coils.size(); ++c)
            for (const std::size_t k : {0u, 1u}) EXPECT_EQ(again.coils[c].pressure[k], seen.coils[c].pressure[k]);
        }
        EXPECT_TRUE(std::ranges::count(found, w) == 1 || found.front().faults() < 2);
        ++pairs;
        told += found.size() == 1 && found.front() == w;
      }
    EXPECT_GT(told, pairs / 2) << pairs;
  }
}

TEST(Wiring, SwappedValvesAndSensorsLookLikeAMirroredSlideUntilAHandMovesIt) {
  Wiring mirrored, turned;
  mirrored.valves_swapped = mirrored.pressures_swapped = true;
  turned.position_inverted = turned.motor_inverted = true;
  WiringSeen seen = without_hand(mirrored, false);
  EXPECT_EQ(seen.coils, expected_of(turned, false).coils);
  EXPECT_THAT(explanations(seen), testing::UnorderedElementsAre(mirrored, turned));
  ASSERT_EQ(diagnosis(seen).size(), 1u);
  EXPECT_THAT(diagnosis(seen).front(), HasSubstr("does not tell which"));
  seen.by_hand = 1;
  EXPECT_THAT(explanations(seen), ElementsAre(mirrored));
  seen.by_hand = -1;
  EXPECT_THAT(explanations(seen), ElementsAre(turned));
}

/// What friction or an end stop hides takes nothing that is wrong into the diagnosis.
TEST(Wiring, AnswersThatWereNotSeenNeverRuleTheTruthOut) {
  std::mt19937 random(5);
  for (const bool three_way : {false, true})
    for (const Wiring& w : single_faults(three_way))
      for (int repeat = 0; repeat < 20; ++repeat) {
        WiringSeen seen = without_hand(w, three_way);
        for (Response& r : seen.coils) {
          if (random() % 3 == 0) r.position.reset();
          for (Answer& p : r.pressure)
            if (random() % 4 == 0) p.reset();
        }
        const std::vector<Wiring> found = explanations(seen);
        EXPECT_TRUE(std::ranges::count(found, w) == 1 || found.front().faults() == 0) << w.words(three_way).front();
      }
}

TEST(Wiring, WhatFitsNothingIsSaid) {
  WiringSeen seen = expected_of({}, false);
  seen.coils[0].pressure = {-1, -1};
  seen.coils[1].pressure = {1, 1};
  EXPECT_THAT(diagnosis(seen).front(), HasSubstr("fits no wiring"));
}

}  // namespace
}  // namespace solenoid
