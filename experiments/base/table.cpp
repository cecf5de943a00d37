#include "experiments/base/table.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>
#include <unistd.h>

namespace solenoid {
namespace {

bool missing(const Json& value) {
  return value.is_null() || (value.is_number_float() && std::isnan(value.get<double>()));
}

std::string joined(const Json& list, const char* between) {
  std::string text;
  for (const Json& one : list)
    text += (text.empty() ? "" : between) + (one.is_string() ? one.get<std::string>() : one.dump());
  return text;
}

bool left(const Table::Column& column) { return column.format.starts_with('<'); }

std::string number_text(const Json& value, std::string format) {
  if (format.starts_with('<')) format.erase(0, 1);
  double number = value.get<double>();
  if (format.empty()) return value.is_number_float() ? short_number(number) : value.dump();
  if (format.ends_with('%')) number *= 100, format.pop_back();
  return fmt::format(fmt::runtime("{:" + format + "}"), number);
}

std::string cell_text(const Json& value, const std::string& format) {
  if (missing(value)) return "-";
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_number()) return number_text(value, format);
  return joined(value, !value.empty() && value.front().is_string() ? "; " : " ");
}

std::string csv_quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

std::string csv_cell(const Json& value) {
  if (missing(value)) return "";
  if (value.is_boolean()) return value.get<bool>() ? "1" : "0";
  if (value.is_number_float()) return fmt::format("{}", value.get<double>());
  return csv_quoted(value.is_string()  ? value.get<std::string>()
                    : value.is_array() ? joined(value, " ")
                                       : value.dump());
}

std::string csv_heading(const Table::Column& column) {
  std::string name = column.name;
  if (name.ends_with('?')) name.pop_back();
  if (column.data != Table::Data::csv) std::ranges::replace(name, '.', '_');
  return csv_quoted(name);
}

/// The object of a row gets a value; dots in the name lead into objects below it.
void put(Json& object, std::string name, const Json& value) {
  const bool optional = name.ends_with('?');
  if (optional) name.pop_back();
  if (optional && missing(value)) return;
  Json* at = &object;
  for (std::size_t dot; (dot = name.find('.')) != std::string::npos; name.erase(0, dot + 1))
    at = &(*at)[name.substr(0, dot)];
  (*at)[name] = missing(value) ? Json() : value;
}

/// How wide a column is, and whether it keeps a place for marks, so that numbers stay under numbers.
struct Width {
  std::size_t characters = 0;
  bool marks = false;
};

std::string padded(const std::string& text, std::size_t width, bool to_the_left) {
  return to_the_left ? fmt::format("{:<{}}", text, width) : fmt::format("{:>{}}", text, width);
}

void end_line(std::string& text) {
  text.erase(text.find_last_not_of(' ') + 1);
  text += '\n';
}

}  // namespace

bool colour_wanted() { return ::isatty(STDOUT_FILENO) != 0 && std::getenv("NO_COLOR") == nullptr; }

bool Table::shown() const {
  return std::ranges::any_of(columns, [](const Column& c) { return !c.heading.empty(); });
}

std::string Table::text(bool colour) const {
  std::vector<Width> widths(columns.size());
  std::string text = title.empty() ? "" : title + "\n";
  for (std::size_t c = 0; c < columns.size(); ++c) {
    if (columns[c].heading.empty()) continue;
    widths[c].characters = columns[c].heading.size();
    for (const Row& row : rows) {
      widths[c].characters = std::max(widths[c].characters, cell_text(row[c].value, columns[c].format).size());
      widths[c].marks = widths[c].marks || row[c].marked;
    }
    text += padded(columns[c].heading, widths[c].characters, left(columns[c])) + (widths[c].marks ? "   " : "  ");
  }
  if (shown()) end_line(text);
  for (const Row& row : rows) {
    if (!shown()) break;
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (columns[c].heading.empty()) continue;
      std::string cell = padded(cell_text(row[c].value, columns[c].format), widths[c].characters, left(columns[c]));
      if (widths[c].marks) cell += row[c].marked ? '*' : ' ';
      text += colour && row[c].marked ? fmt::format("\033[1;32m{}\033[0m  ", cell) : cell + "  ";
    }
    end_line(text);
  }
  for (const std::string& note : notes) text += note + "\n";
  return text;
}

Json Table::json() const {
  Json list = Json::array();
  for (const Row& row : rows) {
    Json object = Json::object();
    for (std::size_t c = 0; c < columns.size(); ++c)
      if (!columns[c].name.empty() && columns[c].data != Data::csv) put(object, columns[c].name, row[c].value);
    list.push_back(std::move(object));
  }
  return list;
}

std::string Table::csv() const {
  std::string text;
  const auto line = [&](const auto& cell) {
    const char* before = "";
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (columns[c].name.empty() || columns[c].data == Data::json) continue;
      text += before + cell(c);
      before = ",";
    }
    text += '\n';
  };
  line([&](std::size_t c) { return csv_heading(columns[c]); });
  for (const Row& row : rows) line([&](std::size_t c) { return csv_cell(row[c].value); });
  return text;
}

std::string Table::html() const {
  std::string text = title.empty() ? "" : "<h2>" + html_escaped(title) + "</h2>\n";
  const auto line = [&](const char* tag, const auto& cell) {
    text += "<tr>";
    for (std::size_t c = 0; c < columns.size(); ++c)
      if (!columns[c].heading.empty())
        text += fmt::format("<{0}{1}>{2}</{0}>", tag, left(columns[c]) ? " class=\"left\"" : "", cell(c));
    text += "</tr>\n";
  };
  if (shown()) {
    text += "<table>\n";
    line("th", [&](std::size_t c) { return html_escaped(columns[c].heading); });
    for (const Row& row : rows)
      line("td", [&](std::size_t c) {
        const std::string cell = html_escaped(cell_text(row[c].value, columns[c].format));
        return row[c].marked ? "<strong>" + cell + "</strong>" : cell;
      });
    text += "</table>\n";
  }
  for (const std::string& note : notes) text += "<p>" + html_escaped(note) + "</p>\n";
  return text;
}

std::string Table::markdown() const {
  std::string text;
  const auto line = [&](const auto& cell) {
    for (std::size_t c = 0; c < columns.size(); ++c)
      if (!columns[c].heading.empty()) text += "| " + cell(c) + " ";
    text += "|\n";
  };
  line([&](std::size_t c) { return columns[c].heading; });
  line([](std::size_t) { return std::string("---"); });
  for (const Row& row : rows)
    line([&](std::size_t c) {
      const std::string cell = cell_text(row[c].value, columns[c].format);
      return c == 0 ? "`" + cell + "`" : cell;
    });
  return text;
}

std::string short_number(double value) {
  if (value == 0.0 || !std::isfinite(value)) return fmt::format("{}", value);
  const double magnitude = std::abs(value);
  if (magnitude < 1e-3 || magnitude >= 1e6) return fmt::format("{:.2e}", value);
  const int digits = std::clamp(2 - static_cast<int>(std::floor(std::log10(magnitude))), 0, 5);
  return fmt::format("{:.{}f}", value, digits);
}

std::string html_escaped(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    const char* entity = c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '"' ? "&quot;" : nullptr;
    escaped += entity ? std::string(entity) : std::string(1, c);
  }
  return escaped;
}

}  // namespace solenoid
