// TOML of a model's parameters, of the twin, of experiments and of a mismatch.
#include "core/systems/actuator/parameters.hpp"

#include "experiments/systems/actuator/identify/experiment.hpp"
#include "experiments/systems/actuator/twin/twin_parameters.hpp"
#include "tests/fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace solenoid;
  if (size == 0) return 0;
  const std::string text(fuzz::text_of(bytes + 1, size - 1));
  fuzz::read_or_refuse(fuzz::text_of(bytes, size), [&] {
    TableReader table = TableReader::from_text(text, "fuzz.toml");
    switch (bytes[0] % 4) {
      case 0:
        read_parameters(table);
        break;
      case 1:
        read_twin(table);
        break;
      case 2:
        read_experiments(table);
        break;
      default:
        read_mismatch(table);
    }
  });
  return 0;
}
