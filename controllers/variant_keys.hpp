#pragma once

#include "controllers/variant.hpp"
#include "core/config/reader.hpp"

#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace solenoid {

/// One key of a [variant.NAME] table, declared once: reading, refusals, defaults, listings and Python come from it.
struct VariantKey {
  template <class T>
  using At = T& (*)(VariantConfig&);
  using Member = std::variant<std::monostate, At<double>, At<int>, At<bool>, At<std::string>, At<std::vector<int>>,
                              At<std::optional<double>>>;
  using Value = std::variant<std::monostate, double, int, bool, std::string, std::vector<int>>;

  std::string path;   ///< "cost.switching", "motor"
  std::string group;  ///< solvers, laws and estimators name the groups they read; "": every variant has it
  Member member;      ///< none: read by hand in variant.cpp
  Range range;        ///< of a number, or of each in a list
  std::string unit;
  std::string meaning;
  std::vector<std::string> choices{};                ///< of a text; empty: any
  std::string by_hand_default{}, by_hand_allowed{};  ///< of keys without a member

  /// What a variant has there; nothing for keys without a member and limits that are not set.
  Value value(const VariantConfig& variant) const;
  std::string default_text() const;
  std::string allowed_text() const;
};

/// Every key, in the order of the documentation.
const std::vector<VariantKey>& variant_keys();
/// nullptr where there is none of this path.
const VariantKey* find_variant_key(std::string_view path);
/// The number that a variant has there which does not say; nothing for keys that are no numbers.
std::optional<double> default_number(std::string_view path);

/// Names of the solvers, laws and estimators that read this key; "all" for one that every variant has.
std::string readers_of(const VariantKey& key);

/// Reads what the table has of the keys of these groups. Throws ConfigError.
void read_keys(TableReader& table, std::span<const std::string> groups, VariantConfig& variant);

}  // namespace solenoid
