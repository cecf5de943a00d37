#pragma once

#include "controllers/variant.hpp"
#include "core/config/reader.hpp"

#include <string>

namespace solenoid::test {

/// A variant "mine" of the keys in a text, which is called mine.toml.
inline VariantConfig variant_of(const std::string& text) {
  TableReader table = TableReader::from_text(text, "mine.toml");
  return read_variant(table, "mine");
}

/// Why such a variant is refused; "accepted" if it is not.
inline std::string refusal_of(const std::string& text) {
  try {
    variant_of(text);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace solenoid::test
