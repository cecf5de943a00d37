// The record in a plug-in's file, which is read before anything of the file is run.
#include "experiments/plugin/plugin_file.hpp"
#include "tests/fuzz/fuzz.hpp"

#include <cstdlib>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  using namespace solenoid;
  const std::string text =
      "\x7f"
      "ELF" +
      std::string(fuzz::text_of(bytes, size));
  fuzz::read_or_refuse(fuzz::text_of(bytes, size), [&] {
    const PluginRecord record = parse_plugin(text, "fuzz.so");
    if (record.name.empty() || record.abi.empty()) std::abort();
    require_same_abi(record, "fuzz.so");
  });
  return 0;
}
