#pragma once

#include "core/config/document.hpp"

#include <optional>
#include <string>

namespace solenoid {

/// The number at a dotted key of a variant's table, if it has one: "cost.switching", or of an array "horizon.blocks.0".
std::optional<double> number_at(const toml::table& variant, const std::string& key);

/// Sets it, making the tables on the way. A block's length also sets horizon.steps to what the blocks are together.
/// Throws ConfigError if something on the way is no table, or the array has no such element.
void set_number(toml::table& variant, const std::string& key, double value, bool whole);

/// Sets it in a campaign's [variant.NAME], by `who`.
void set_number(Document& campaign, const std::string& variant, const std::string& key, double value, bool whole,
                const std::string& who);

}  // namespace solenoid
