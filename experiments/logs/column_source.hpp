#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace solenoid {

/// A number that a log must have, as we call it: "pressure_a_pa" is of the quantity "Pa".
struct WantedNumber {
  std::string name;
  std::string stem;  ///< the name without its unit: "pressure_a"
  std::string unit;  ///< SI; empty: it has none, and no factor
};

/// Where a wanted number is: a column of a CSV, a field of an MCAP's topic. Ours is factor * theirs + offset.
struct ColumnSource {
  std::string name;  ///< ours
  std::string text;  ///< theirs, with what is said of factor and offset: "pA*1e5+101325"

  struct Scaled {
    std::string heading;
    double factor = 1.0, offset = 0.0;
    bool said = false;  ///< that there is a factor or an offset
  };
  /// What `text` says; throws ConfigError where a factor is no number.
  Scaled scaled() const;
};

/// Reads `NAME=HEADING`, `NAME=HEADING*FACTOR`, `NAME=HEADING*FACTOR+OFFSET`, `NAME=HEADING+OFFSET`, where both numbers
/// may be negative. Throws ConfigError for a name that is not among these.
std::vector<ColumnSource> parse_columns(const std::vector<std::string>& texts, const std::vector<std::string>& names);

/// A unit in which logs have a quantity: ours is factor * theirs + offset.
struct KnownUnit {
  std::string_view name;
  std::string_view si;
  double factor, offset = 0.0;
};
/// The unit of this name, if it is one of the quantity with this SI unit; capitals make no difference but for M and m.
const KnownUnit* find_unit(std::string_view name, std::string_view si);
/// "s, ms, us, ns, min"
std::string unit_names(std::string_view si);

/// A heading in its parts: "pA [bar]" and "x (mm)" have a unit in brackets, "t_ms" perhaps one behind its last '_'.
struct HeadingParts {
  std::string stem, unit;
  bool bracketed = false;
};
HeadingParts parts_of(std::string_view heading);

/// A column found for a wanted number.
struct FoundColumn {
  std::size_t place = 0;
  double factor = 1.0, offset = 0.0;
  std::string told{};  ///< what was converted, for a person; empty: nothing
};
/// Where a wanted number is among these headings: that of `source` if there is one, otherwise one called as we call it,
/// or so with another unit. Throws ConfigError, without the file's name, if there is none, or two, or if its unit is not
/// known.
FoundColumn find_column(const WantedNumber& wanted, const ColumnSource* source,
                        const std::vector<std::string>& headings);
/// Whether it is there, however often and in whatever unit.
bool has_column(const WantedNumber& wanted, const ColumnSource* source, const std::vector<std::string>& headings);

}  // namespace solenoid
