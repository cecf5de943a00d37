// A CSV log of anybody's, with and without options.
#include "experiments/systems/actuator/identify/log_source.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace solenoid;
  if (size == 0) return 0;
  LogSettings settings;
  if ((bytes[0] & 1) != 0)
    settings.columns = {"time_s=t*1e-3", "pressure_a_pa=pA*1e5+101325", "pressure_b_pa=pB*-1e5+101325"};
  if ((bytes[0] & 2) != 0) settings.valves = "three_way";
  fuzz::read_or_refuse(fuzz::text_of(bytes, size), [&] {
    records_from_csv(std::string(fuzz::text_of(bytes + 1, size - 1)), "fuzz.csv", settings);
  });
  return 0;
}
