#include "experiments/systems/actuator/commission/wiring.hpp"

#include <algorithm>
#include <functional>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

constexpr int most_faults = 3;
constexpr const char* two_way_coils[] = {"supply A", "exhaust A", "supply B", "exhaust B"};
constexpr const char* three_way_coils[] = {"A", "B"};

Answer turned(Answer answer, bool inverted) { return answer && inverted ? Answer(-*answer) : answer; }
/// What a sensor shows of it.
Answer read(Answer answer, bool inverted, bool dead) { return dead ? Answer(0) : turned(answer, inverted); }

/// A rig with this wiring, a coil tried after the other. Chambers: 0 is A, 1 is B.
class Tried {
 public:
  Tried(const Wiring& wiring, bool three_way) : wiring_(wiring), three_way_(three_way) {
    for (const std::size_t k : {0u, 1u}) charged_[k] = three_way && wiring.exchanged[k] && !wiring.no_supply;
  }

  /// Of the chambers themselves, as the sensors show it.
  std::array<Answer, 2> shown_of(const std::array<int, 2>& of_chambers) const {
    std::array<Answer, 2> shown;
    for (const std::size_t k : {0u, 1u})
      shown[k] = read(of_chambers[wiring_.pressures_swapped ? 1 - k : k], wiring_.pressure_inverted[k],
                      wiring_.pressure_dead[k]);
    return shown;
  }
  std::array<Answer, 2> at_rest() const { return shown_of({charged_[0] ? 1 : 0, charged_[1] ? 1 : 0}); }
  bool pressed() const { return charged_[0] != charged_[1]; }

  Response coil(std::size_t c) {
    std::array<int, 2> change{};
    const std::size_t commanded = three_way_ ? c : c / 2;
    const std::size_t chamber = wiring_.valves_swapped ? 1 - commanded : commanded;
    const bool fills = (three_way_ || c % 2 == 0) != wiring_.exchanged[chamber];
    const bool was_pressed = pressed();
    if (!wiring_.dead[c]) {
      if (fills && !wiring_.no_supply) change[chamber] = 1;
      if (!fills && charged_[chamber]) change[chamber] = -1;
      if (!three_way_) charged_[chamber] = change[chamber] != 0 ? change[chamber] > 0 : charged_[chamber];
    }
    const int push = change[0] - change[1];  // A towards +y, B against it
    Response r{read(Answer(push), wiring_.position_inverted, wiring_.position_dead), shown_of(change)};
    // A slide that a full chamber presses against its stop may stay there.
    if (was_pressed && three_way_) r.position.reset();
    return r;
  }

 private:
  const Wiring& wiring_;
  bool three_way_;
  std::array<bool, 2> charged_{};
};

bool agrees(Answer seen, Answer expected) { return !seen || !expected || *seen == *expected; }
bool agrees(const Response& seen, const Response& expected) {
  return agrees(seen.position, expected.position) && agrees(seen.pressure[0], expected.pressure[0]) &&
         agrees(seen.pressure[1], expected.pressure[1]);
}
bool agrees(const WiringSeen& seen, const WiringSeen& expected) {
  if (!agrees(seen.by_hand, expected.by_hand) || !agrees(seen.motor, expected.motor)) return false;
  if (!agrees(seen.at_rest[0], expected.at_rest[0]) || !agrees(seen.at_rest[1], expected.at_rest[1])) return false;
  for (std::size_t c = 0; c < seen.coils.size() && c < expected.coils.size(); ++c)
    if (!agrees(seen.coils[c], expected.coils[c])) return false;
  return true;
}

/// Every single fault, as what it sets.
std::vector<std::function<void(Wiring&)>> single_faults(bool three_way) {
  std::vector<std::function<void(Wiring&)>> all = {
      [](Wiring& w) { w.position_inverted = true; }, [](Wiring& w) { w.position_dead = true; },
      [](Wiring& w) { w.motor_inverted = true; },    [](Wiring& w) { w.motor_dead = true; },
      [](Wiring& w) { w.pressures_swapped = true; }, [](Wiring& w) { w.valves_swapped = true; },
      [](Wiring& w) { w.no_supply = true; }};
  for (const std::size_t k : {0u, 1u}) {
    all.emplace_back([k](Wiring& w) { w.pressure_inverted[k] = true; });
    all.emplace_back([k](Wiring& w) { w.pressure_dead[k] = true; });
    all.emplace_back([k](Wiring& w) { w.exchanged[k] = true; });
  }
  for (std::size_t c = 0; c < (three_way ? 2u : 4u); ++c) all.emplace_back([c](Wiring& w) { w.dead[c] = true; });
  return all;
}

/// What does nothing has no sign.
bool possible(const Wiring& w) {
  return !(w.motor_inverted && w.motor_dead) && !(w.position_inverted && w.position_dead) &&
         !(w.pressure_inverted[0] && w.pressure_dead[0]) && !(w.pressure_inverted[1] && w.pressure_dead[1]);
}

/// Adds to `found` what agrees of `so_far` with `left` more faults out of those from `next` on.
void search(const WiringSeen& seen, const std::vector<std::function<void(Wiring&)>>& faults, const Wiring& so_far,
            std::size_t next, int left, std::vector<Wiring>& found) {
  if (left == 0) {
    if (possible(so_far) && agrees(seen, expected_of(so_far, seen.three_way))) found.push_back(so_far);
    return;
  }
  for (std::size_t f = next; f < faults.size(); ++f) {
    Wiring more = so_far;
    faults[f](more);
    search(seen, faults, more, f + 1, left - 1, found);
  }
}

}  // namespace

int Wiring::faults() const {
  int count =
      position_inverted + position_dead + motor_inverted + motor_dead + pressures_swapped + valves_swapped + no_supply;
  for (const bool one : pressure_inverted) count += one;
  for (const bool one : pressure_dead) count += one;
  for (const bool one : exchanged) count += one;
  for (const bool one : dead) count += one;
  return count;
}

std::vector<std::string> Wiring::words(bool three_way) const {
  std::vector<std::string> all;
  if (position_inverted) all.emplace_back("the position sensor is inverted");
  if (position_dead) all.emplace_back("the position sensor shows nothing, or the slide is stuck");
  if (motor_inverted) all.emplace_back("the motor has the wrong sign");
  if (motor_dead) all.emplace_back("the motor does nothing");
  if (pressures_swapped) all.emplace_back("the pressure sensors A and B are swapped");
  if (valves_swapped) all.emplace_back("the valves of chambers A and B are swapped");
  if (no_supply) all.emplace_back("there is no supply pressure");
  for (const std::size_t k : {0u, 1u}) {
    const char name = k == 0 ? 'A' : 'B';
    if (pressure_inverted[k]) all.push_back(fmt::format("pressure sensor {} is inverted", name));
    if (pressure_dead[k]) all.push_back(fmt::format("pressure sensor {} shows nothing", name));
    if (exchanged[k])
      all.push_back(three_way ? fmt::format("supply and exhaust are swapped at the valve of chamber {}", name)
                              : fmt::format("the supply and exhaust coils of chamber {} are swapped", name));
  }
  for (std::size_t c = 0; c < dead.size(); ++c)
    if (dead[c]) all.push_back(fmt::format("coil {} is dead", three_way ? three_way_coils[c % 2] : two_way_coils[c]));
  return all;
}

WiringSeen expected_of(const Wiring& wiring, bool three_way) {
  WiringSeen seen;
  seen.three_way = three_way;
  Tried rig(wiring, three_way);
  seen.at_rest = rig.at_rest();
  seen.by_hand = read(1, wiring.position_inverted, wiring.position_dead);
  const int pull = wiring.motor_dead ? 0 : wiring.motor_inverted ? -1 : 1;
  if (!rig.pressed()) seen.motor = read(pull, wiring.position_inverted, wiring.position_dead);
  for (std::size_t c = 0; c < (three_way ? 2u : 4u); ++c) seen.coils.push_back(rig.coil(c));
  return seen;
}

std::vector<Wiring> explanations(const WiringSeen& seen) {
  const auto faults = single_faults(seen.three_way);
  std::vector<Wiring> found;
  for (int count = 0; count <= most_faults && found.empty(); ++count) search(seen, faults, {}, 0, count, found);
  return found;
}

std::vector<std::string> diagnosis(const WiringSeen& seen) {
  const std::vector<Wiring> found = explanations(seen);
  if (found.empty()) return {"what the sensors showed fits no wiring with up to three faults: look at each wire"};
  if (found.size() == 1) return found.front().words(seen.three_way);
  std::vector<std::string> each;
  for (const Wiring& w : found) each.push_back(fmt::format("{}", fmt::join(w.words(seen.three_way), " and ")));
  return {fmt::format("{}: what was seen does not tell which", fmt::join(each, "; or "))};
}

}  // namespace solenoid
