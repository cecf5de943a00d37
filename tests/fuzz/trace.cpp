// A run's trace, and what reports make of it.
#include "experiments/campaign/trace.hpp"

#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace solenoid;
  fuzz::read_or_refuse(fuzz::text_of(bytes, size), [&] {
    try {
      overview(decode_trace(fuzz::text_of(bytes, size)), 100);
    } catch (const std::invalid_argument& error) {  // its callers know the file's name
      throw ConfigError(error.what());
    }
  });
  return 0;
}
