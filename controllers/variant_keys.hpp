#pragma once

#include "controllers/variant.hpp"
#include "core/config/reader.hpp"
#include "core/system/description.hpp"

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace solenoid {

/// One key of a [variant.NAME] table, declared once: reading, refusals, defaults, listings and Python come from it.
struct VariantKey {
  template <class T>
  using At = std::function<T&(VariantConfig&)>;
  using Member = std::variant<std::monostate, At<double>, At<int>, At<bool>, At<std::string>, At<std::vector<int>>,
                              At<std::optional<double>>>;
  using Value = std::variant<std::monostate, double, int, bool, std::string, std::vector<int>>;

  std::string path;   ///< "cost.switching", "motor"
  std::string group;  ///< solvers, laws and estimators name the groups they read; "": every variant has it
  Member member;      ///< none: the system reads it by hand
  Range range;        ///< of a number, or of each in a list
  std::string unit;
  std::string meaning;
  std::vector<std::string> choices{};                ///< of a text; empty: any
  std::string by_hand_default{}, by_hand_allowed{};  ///< of keys without a member
  bool names_network = false;                        ///< of a text: a file is kept by its whole path (networks.hpp)

  /// What a variant has there; nothing for keys without a member and limits that are not set.
  Value value(const VariantConfig& variant) const;
  /// What these defaults have there.
  std::string default_text(const VariantConfig& defaults) const;
  std::string allowed_text() const;
};

/// Collects keys that the same solvers, laws or estimators read.
struct KeyGroup {
  std::vector<VariantKey>& keys;
  std::string group;

  /// A number, or a list of them.
  void add(const std::string& path, VariantKey::Member at, Range range, const std::string& unit,
           const std::string& meaning) const;
  /// true or false.
  void flag(const std::string& path, VariantKey::Member at, const std::string& meaning) const;
  /// A text, one of the choices if there are any.
  void text(const std::string& path, VariantKey::Member at, std::vector<std::string> choices,
            const std::string& meaning) const;
  /// A network, by name or file.
  void network(const std::string& path, VariantKey::Member at, const std::string& meaning) const;
  /// What the system reads by hand: default and what is allowed as the documentation has them.
  void by_hand(const std::string& path, const std::string& fallback, const std::string& allowed,
               const std::string& meaning) const;
};

/// The keys that a variant of any system has, of one with these choices.
std::vector<VariantKey> common_keys(const SystemDescription& system, const std::vector<std::string>& solvers,
                                    const std::vector<std::string>& laws, const std::vector<std::string>& mode_sets,
                                    const std::vector<std::string>& estimators,
                                    const std::vector<std::string>& parameter_sets);

/// A state's name and unit, as limits.least_NAME and limits.most_NAME have them: "position_m".
std::string limited_state_key(const Signal& state);

/// Of a system's keys the one of this path; nullptr where there is none.
const VariantKey* find_variant_key(const System& system, std::string_view path);
/// The number that a variant has there which does not say; nothing for keys that are no numbers.
std::optional<double> default_number(const System& system, std::string_view path);

/// Names of the system's solvers, laws and estimators that read this key; "all" for one that every variant has.
std::string readers_of(const System& system, const VariantKey& key);

/// Reads what the table has of the keys of these groups of the variant's system. Throws ConfigError.
void read_keys(TableReader& table, std::span<const std::string> groups, VariantConfig& variant);

}  // namespace solenoid
