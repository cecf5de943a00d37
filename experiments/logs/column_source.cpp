#include "experiments/logs/column_source.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/shown_text.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numeric>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

constexpr double atmosphere_pa = 101325.0;
constexpr std::array known_units = {
    KnownUnit{"s", "s", 1.0},
    KnownUnit{"ms", "s", 1e-3},
    KnownUnit{"us", "s", 1e-6},
    KnownUnit{"ns", "s", 1e-9},
    KnownUnit{"min", "s", 60.0},
    KnownUnit{"m", "m", 1.0},
    KnownUnit{"cm", "m", 1e-2},
    KnownUnit{"mm", "m", 1e-3},
    KnownUnit{"um", "m", 1e-6},
    KnownUnit{"in", "m", 0.0254},
    KnownUnit{"Pa", "Pa", 1.0},
    KnownUnit{"hPa", "Pa", 1e2},
    KnownUnit{"kPa", "Pa", 1e3},
    KnownUnit{"MPa", "Pa", 1e6},
    KnownUnit{"mbar", "Pa", 1e2},
    KnownUnit{"bar", "Pa", 1e5},
    KnownUnit{"psi", "Pa", 6894.757293168},
    KnownUnit{"barg", "Pa", 1e5, atmosphere_pa},
    KnownUnit{"psig", "Pa", 6894.757293168, atmosphere_pa},
    KnownUnit{"N", "N", 1.0},
    KnownUnit{"mN", "N", 1e-3},
    KnownUnit{"kN", "N", 1e3},
    KnownUnit{"lbf", "N", 4.4482216152605},
};

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front())) != 0) text.remove_prefix(1);
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())) != 0) text.remove_suffix(1);
  return text;
}

std::string lower(std::string_view text) {
  std::string out(text);
  std::ranges::transform(out, out.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

/// A number at the front, with or without a sign, and spaces around it; takes it away.
std::optional<double> take_number(std::string_view& text) {
  std::string_view rest = trimmed(text);
  const bool plus = rest.starts_with('+');
  if (plus) rest = trimmed(rest.substr(1));
  double value = 0;
  const auto end = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (end.ec != std::errc() || !std::isfinite(value) || (plus && value < 0)) return std::nullopt;
  text = trimmed(rest.substr(static_cast<std::size_t>(end.ptr - rest.data())));
  return value;
}

/// How many letters have to be changed, put in or left out.
std::size_t letters_apart(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t changed = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::string nearest_of(const std::string& wanted, const std::vector<std::string>& headings) {
  constexpr std::size_t longest = 80, most = 200;  // headings come from anywhere
  std::size_t best = wanted.size() / 2 + 1;
  std::string nearest;
  for (std::size_t i = 0; i < std::min(most, headings.size()); ++i) {
    const std::string heading = lower(headings[i]).substr(0, longest);
    if (const std::size_t apart = letters_apart(lower(wanted), heading); apart < best) {
      best = apart;
      nearest = headings[i];
    }
  }
  return nearest;
}

std::string list_of(const std::vector<std::string>& headings) {
  constexpr std::size_t most = 12;
  std::vector<std::string> texts;
  texts.reserve(most + 1);
  for (std::size_t i = 0; i < std::min(most, headings.size()); ++i) texts.push_back(shown(headings[i]));
  if (headings.size() > most) texts.push_back(fmt::format("{} more", headings.size() - most));
  return fmt::format("{}", fmt::join(texts, ", "));
}

std::vector<std::size_t> places_where(const std::vector<std::string>& headings, const auto& fits) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < headings.size(); ++i)
    if (fits(headings[i])) places.push_back(i);
  return places;
}

/// Of the ways in which a heading may be meant, the first that fits any.
std::vector<std::size_t> places_of(const WantedNumber& wanted, const std::string* theirs,
                                   const std::vector<std::string>& headings) {
  const std::string& name = theirs ? *theirs : wanted.name;
  auto places = places_where(headings, [&](const std::string& h) { return h == name; });
  if (places.empty())
    places = places_where(headings, [&](const std::string& h) {
      const HeadingParts parts = parts_of(h);
      return parts.bracketed && (parts.stem == name || (!theirs && parts.stem == wanted.stem));
    });
  if (places.empty() && !theirs && !wanted.unit.empty())
    places = places_where(headings, [&](const std::string& h) {
      const HeadingParts parts = parts_of(h);
      return parts.stem == wanted.stem && find_unit(parts.unit, wanted.unit) != nullptr;
    });
  return places;
}

/// A heading may itself have a star or a sign: "p*", "p-1".
ColumnSource::Scaled among(const std::vector<std::string>& headings, const ColumnSource& source) {
  if (std::ranges::find(headings, source.text) == headings.end()) return source.scaled();
  return {source.text};
}

/// What the unit of a heading says of it.
void convert(const WantedNumber& wanted, const std::string& heading, FoundColumn& found) {
  const HeadingParts parts = parts_of(heading);
  if (heading == wanted.name || parts.unit.empty()) return;
  const KnownUnit* unit = find_unit(parts.unit, wanted.unit);
  if (!unit && !parts.bracketed) return;  // "bench_3" has no unit
  if (!unit)
    throw ConfigError(fmt::format("column {}: unit {} (allowed: {}; or --column {}='{}*FACTOR+OFFSET')", shown(heading),
                                  shown(parts.unit), unit_names(wanted.unit), wanted.name, heading));
  found.factor = unit->factor;
  found.offset = unit->offset;
  if (unit->factor == 1.0 && unit->offset == 0.0) return;
  found.told = fmt::format("{} = {} * {:g}", wanted.name, shown(heading), unit->factor);
  if (unit->offset != 0.0) found.told += fmt::format(" + {:g}", unit->offset);
}

}  // namespace

ColumnSource::Scaled ColumnSource::scaled() const {
  Scaled out{std::string(trimmed(text))};
  const auto star = text.rfind('*');
  const auto refuse = [&](std::string_view factor) {
    throw ConfigError(fmt::format("--column {}: {} is no number (allowed: NAME=COLUMN*FACTOR+OFFSET)",
                                  shown(name + "=" + text), shown(factor)));
  };
  if (star != std::string::npos) {
    const std::string_view said = std::string_view(text).substr(star + 1);
    std::string_view rest = said;
    const auto factor = take_number(rest);
    if (!factor) refuse(said);
    out = {std::string(trimmed(std::string_view(text).substr(0, star))), *factor, 0.0, true};
    if (rest.empty()) return out;
    const std::string_view behind = rest;
    const auto offset = rest.starts_with('+') || rest.starts_with('-') ? take_number(rest) : std::nullopt;
    if (!offset || !rest.empty()) refuse(behind);
    out.offset = *offset;
    return out;
  }
  // An exponent has a sign of its own: the first sign from which on all is a number.
  for (std::size_t at = 1; at < text.size(); ++at) {
    if (text[at] != '+' && text[at] != '-') continue;
    std::string_view rest = std::string_view(text).substr(at);
    const auto offset = take_number(rest);
    if (!offset || !rest.empty()) continue;
    return {std::string(trimmed(std::string_view(text).substr(0, at))), 1.0, *offset, true};
  }
  return out;
}

std::vector<ColumnSource> parse_columns(const std::vector<std::string>& texts, const std::vector<std::string>& names) {
  std::vector<ColumnSource> sources;
  sources.reserve(texts.size());
  for (const std::string& text : texts) {
    const auto equals = text.find('=');
    const std::string name(trimmed(std::string_view(text).substr(0, equals)));
    if (equals == std::string::npos || std::ranges::find(names, name) == names.end())
      throw ConfigError(
          fmt::format("--column {}: (allowed: NAME=COLUMN or NAME=COLUMN*FACTOR+OFFSET with NAME one of {})",
                      shown(text), fmt::join(names, ", ")));
    if (std::ranges::find(sources, name, &ColumnSource::name) != sources.end())
      throw ConfigError(fmt::format("--column {}: {} a second time (allowed: once)", shown(text), name));
    sources.push_back({name, text.substr(equals + 1)});
  }
  return sources;
}

const KnownUnit* find_unit(std::string_view name, std::string_view si) {
  const auto same = [&](const KnownUnit& unit) { return unit.si == si && unit.name == name; };
  if (const auto* unit = std::ranges::find_if(known_units, same); unit != known_units.end()) return unit;
  // "mPa" is not "MPa": where two differ by capitals alone, neither is guessed; mm, kpa and BAR are none of these.
  const auto alike = [&](const KnownUnit& unit) { return unit.si == si && lower(unit.name) == lower(name); };
  const auto* unit = std::ranges::find_if(known_units, alike);
  return unit == known_units.end() || unit->name == "MPa" || unit->name == "mN" ? nullptr : unit;
}

std::string unit_names(std::string_view si) {
  std::vector<std::string_view> names;
  names.reserve(known_units.size());
  for (const KnownUnit& unit : known_units)
    if (unit.si == si) names.push_back(unit.name);
  return names.empty() ? "no unit" : fmt::format("{}", fmt::join(names, ", "));
}

HeadingParts parts_of(std::string_view heading) {
  heading = trimmed(heading);
  for (const auto& [open, close] : {std::pair('[', ']'), std::pair('(', ')')}) {
    if (!heading.ends_with(close)) continue;
    const auto at = heading.rfind(open);
    if (at == std::string_view::npos) continue;
    return {std::string(trimmed(heading.substr(0, at))),
            std::string(trimmed(heading.substr(at + 1, heading.size() - at - 2))), true};
  }
  const auto bar = heading.rfind('_');
  if (bar == std::string_view::npos || bar == 0) return {std::string(heading), {}, false};
  return {std::string(heading.substr(0, bar)), std::string(heading.substr(bar + 1)), false};
}

bool has_column(const WantedNumber& wanted, const ColumnSource* source, const std::vector<std::string>& headings) {
  if (!source) return !places_of(wanted, nullptr, headings).empty();
  try {
    const std::string heading = among(headings, *source).heading;
    return !places_of(wanted, &heading, headings).empty();
  } catch (const ConfigError&) {
    return false;
  }
}

FoundColumn find_column(const WantedNumber& wanted, const ColumnSource* source,
                        const std::vector<std::string>& headings) {
  FoundColumn found;
  ColumnSource::Scaled theirs;
  if (source) theirs = among(headings, *source);
  const std::string& name = source ? theirs.heading : wanted.name;
  const auto places = places_of(wanted, source ? &theirs.heading : nullptr, headings);
  if (places.size() > 1)
    throw ConfigError(fmt::format("column {} twice, as columns {} and {} (allowed: once)", shown(headings[places[1]]),
                                  places[0] + 1, places[1] + 1));
  if (places.empty()) {
    const std::string nearest = nearest_of(name, headings);
    throw ConfigError(fmt::format("no column {}{} (allowed: --column {}=ONE OF {})", shown(name),
                                  nearest.empty() ? "" : ", nearest is " + shown(nearest), wanted.name,
                                  list_of(headings)));
  }
  found.place = places[0];
  if (theirs.said) {
    found.factor = theirs.factor;
    found.offset = theirs.offset;
  } else if (!wanted.unit.empty()) {
    convert(wanted, headings[found.place], found);
  }
  return found;
}

}  // namespace solenoid
