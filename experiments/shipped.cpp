#include "experiments/shipped.hpp"

#include "core/config/reader.hpp"
#include "experiments/embedded.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {

VariantConfig shipped_variant(const std::string& name) {
  TableReader file =
      TableReader::from_text(std::string(embedded_text("scenarios/variants.toml")), "shipped variants.toml");
  TableReader variants = file.table("variant");
  if (!variants.has(name))
    throw ConfigError(fmt::format("variant '{}' is not known (allowed: {})", name, fmt::join(variants.keys(), ", ")));
  TableReader table = variants.table(name);
  return read_variant(table, name);
}

}  // namespace solenoid
