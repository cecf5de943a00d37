// A campaign's TOML: variants, scenarios, motions, plants.
#include "experiments/campaign/campaign.hpp"

#include "core/config/document.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace solenoid;
  fuzz::read_or_refuse(fuzz::text_of(bytes, size), [&] {
    read_campaign(Document::from_text(std::string(fuzz::text_of(bytes, size)), "fuzz.toml"));
  });
  return 0;
}
