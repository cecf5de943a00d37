// A rig's TOML, of every system.
#include "controllers/systems.hpp"
#include "controllers/variant.hpp"
#include "experiments/rig/rig_file.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace solenoid;
  if (size == 0) return 0;
  const VariantConfig variant = new_variant(systems()[bytes[0] % systems().size()]);
  const std::string text(fuzz::text_of(bytes + 1, size - 1));
  fuzz::read_or_refuse(fuzz::text_of(bytes, size),
                       [&] { read_rig(TableReader::from_text(text, "fuzz.toml"), variant); });
  return 0;
}
