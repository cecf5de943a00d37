// JSON of a results folder: a run, a profile.
#include "experiments/campaign/run_file.hpp"
#include "experiments/profile/profile_report.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace solenoid;
  const fuzz::MemoryFile file(fuzz::text_of(bytes, size));
  fuzz::read_or_refuse(fuzz::text_of(bytes, size), [&] { read_run_file(file.path()); });
  fuzz::read_or_refuse(fuzz::text_of(bytes, size), [&] { read_profile(file.path()); });
  return 0;
}
