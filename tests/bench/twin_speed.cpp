// Speed of the truth plant: simulated seconds a second of one core, plant and sensors only, in the mode campaigns use
// and in the adaptive one; and how far the modes part over the same commands.

#include "core/systems/actuator/signals.hpp"
#include "experiments/systems/actuator/twin/twin_plant.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <random>

#include <fmt/format.h>

namespace {

using namespace solenoid;

struct Outcome {
  double times_real_time = 0;
  std::vector<ActuatorState> states;
};

Outcome run(TwinParameters parameters, const IntegrationChoice& choice, double duration_s) {
  parameters.integration = choice;
  TwinPlant plant(parameters, "three_way", 0.05, {false, true, 1});
  std::mt19937_64 random(7);
  Outcome outcome;
  const auto ticks = static_cast<int>(duration_s * 1000);
  const std::clock_t start = std::clock();  // processor time: other programs do not count
  for (int k = 0; k < ticks; ++k) {
    outcome.states.push_back(actuator_state(plant.read(1e-3 * k).truth));
    if (k % 5 == 0) plant.write({static_cast<SwitchPattern>(random() % 4), (k / 500) % 2 ? 4.0 : -4.0});
  }
  outcome.times_real_time = duration_s * CLOCKS_PER_SEC / static_cast<double>(std::clock() - start);
  return outcome;
}

double largest_difference(const Outcome& a, const Outcome& b, std::size_t which, double until_s) {
  double largest = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(1000 * until_s); ++k)
    largest = std::max(largest, std::abs(a.states[k][which] - b.states[k][which]));
  return largest;
}

}  // namespace

int main() {
  constexpr double duration_s = 8.0;
  const TwinParameters twin = nominal_twin();
  const Outcome exact = run(twin, {Integration::adaptive, 1, 1e-11}, duration_s);
  fmt::print("adaptive 1e-11: {:.1f} times real time\n", exact.times_real_time);
  const auto compare = [&](const char* name, const IntegrationChoice& choice) {
    const Outcome other = run(twin, choice, duration_s);
    fmt::print(
        "{:16} {:7.1f} times real time; largest difference over {} s: position {:.3g} um, velocity {:.3g} mm/s, "
        "pressure {:.3g} Pa\n",
        name, other.times_real_time, duration_s, 1e6 * largest_difference(exact, other, position, duration_s),
        1e3 * largest_difference(exact, other, velocity, duration_s),
        largest_difference(exact, other, pressure_a, duration_s));
  };
  compare("adaptive 1e-9", {Integration::adaptive, 1, 1e-9});
  compare("fixed 0.1 ms", {Integration::fixed, 1, 1e-9});
  compare("fixed 0.05 ms", {Integration::fixed, 2, 1e-9});
  compare("fixed 0.025 ms", {Integration::fixed, 4, 1e-9});
  compare("fixed 2 us", {Integration::fixed, 50, 1e-9});
  return 0;
}
