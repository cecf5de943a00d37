// Recorded instances.
#include "controllers/instances/instance_set.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace solenoid;
  const fuzz::MemoryFile file(fuzz::text_of(bytes, size));
  fuzz::read_or_refuse(fuzz::text_of(bytes, size), [&] { read_instances(file.path()); });
  return 0;
}
