#pragma once

namespace solenoid {

class TableReader;
struct VariantConfig;

/// Reads the tables of the variant's valve law (docs/reference/configuration.md) and checks that its valves have the
/// modes that the law needs. Throws ConfigError with file, line, key and what is allowed.
void read_law(TableReader& table, VariantConfig& variant);

}  // namespace solenoid
