// An MCAP log: ours, as every command reads it, or another tool's with JSON channels.
#include "experiments/rig/log/recorded_run.hpp"
#include "experiments/systems/actuator/identify/log_source.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace solenoid;
  static const LogSettings mapped{{"position_m=/slide.y", "pressure_a_pa=/pressures.values.0*1e5",
                                   "pressure_b_pa=/pressures.values.1*1e5", "motor_n=/motor.force",
                                   "coils=/valves.bits"}};
  const fuzz::MemoryFile file(fuzz::text_of(bytes, size));
  fuzz::read_or_refuse(fuzz::text_of(bytes, size), [&] { read_run(file.path()); });
  fuzz::read_or_refuse(fuzz::text_of(bytes, size), [&] { read_log_records(file.path(), {}); });
  fuzz::read_or_refuse(fuzz::text_of(bytes, size), [&] { read_log_records(file.path(), mapped); });
  return 0;
}
