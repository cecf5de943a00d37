#pragma once

#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace solenoid {

using Json = nlohmann::ordered_json;

/// A table of results, written as text, JSON, CSV or HTML.
///
///     columns   C of them: what a number is called, in data and for a person
///     rows      R x C cells: number, text, yes or no, list, object; or missing: null, or a number that is none
///
/// How a cell is written:
///
///                  text, HTML                          JSON                CSV
///     missing      -                                   null                nothing
///     number       by the column's format              all its digits      all its digits
///     yes, no      yes, no                             true, false         1, 0
///     list         a; b; c, numbers a b c              array               a b c
///     marked       value*, bold where there is colour  as any              as any
struct Table {
  enum class Data { both, json, csv };
  struct Column {
    /// The key of JSON and heading of CSV, its unit at the end: "rmse_mm". A dot nests objects, "cold.us_p50", and is _
    /// in CSV, but for a column of CSV alone. A '?' at the end: JSON leaves out what is missing. Empty: only for a
    /// person.
    std::string name;
    std::string heading;  ///< for a person: meaning and unit. Empty: only data
    /// How a number reads, as in fmt: ".3f", with a '%' at the end a hundred times as large, as per cent of its share.
    /// Empty: whole numbers as they are, others by short_number. A '<' at the front: the column is aligned left.
    std::string format;
    Data data;

    Column(std::string n, std::string h = {}, std::string f = {}, Data d = Data::both)
        : name(std::move(n)), heading(std::move(h)), format(std::move(f)), data(d) {}
  };
  struct Cell {
    Json value;
    bool marked = false;

    template <class T>
    requires(!std::is_same_v<std::remove_cvref_t<T>, Cell> && std::is_constructible_v<Json, T>)
        Cell(T&& v, bool mark = false)
        : value(std::forward<T>(v)), marked(mark) {}
    template <class T>
    Cell(const std::optional<T>& v, bool mark = false) : value(v ? Json(*v) : Json()), marked(mark) {}
  };
  using Row = std::vector<Cell>;

  std::string name = {};   ///< its key in a result's JSON; empty: only for a person
  std::string title = {};  ///< a line above it
  std::vector<Column> columns = {};
  std::vector<Row> rows = {};
  std::vector<std::string> notes = {};  ///< lines below it

  void add(Row row) { rows.push_back(std::move(row)); }
  /// Whether a person is shown it: some column has a heading.
  bool shown() const;
  /// Title, headings and rows in aligned columns, notes.
  std::string text(bool colour) const;
  /// An array with an object a row.
  Json json() const;
  /// A heading line and a line a row. Cells with a comma, quote or line's end are quoted.
  std::string csv() const;
  /// A heading, a <table> and paragraphs.
  std::string html() const;
  /// The rows as a table of a Markdown page, the first column as code.
  std::string markdown() const;
};

/// Whether standard output is a terminal that wants colour (NO_COLOR unset).
bool colour_wanted();

/// A number for a person: three significant digits, no exponent between 0.001 and a million.
std::string short_number(double value);

/// Text that is no markup.
std::string html_escaped(const std::string& text);

}  // namespace solenoid
