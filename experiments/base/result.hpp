#pragma once

#include "experiments/base/plot.hpp"
#include "experiments/base/table.hpp"

namespace solenoid {

/// What a study or a command has found, to be written in every format there is.
///
///     text    title, each shown table with its title and notes, notes
///     JSON    an object: facts, then each named table as an array of objects; tables of one name are one, side by side
///     CSV     `flat`, or the first table, with those of its name beside it
///     Markdown    each shown table
///     HTML    a page of the same as text, the plot in it
struct Result {
  std::string title = {};  ///< for a person
  Json facts = Json::object();
  std::vector<Table> tables = {};
  std::optional<Table> flat = {};       ///< of CSV, where no table is
  std::vector<std::string> notes = {};  ///< for a person, last
  std::optional<Plot> plot = {};

  std::string text(bool colour) const;
  std::string json() const;
  std::string csv() const;
  std::string markdown() const;
  /// One file that asks the network for nothing. `svg`: the plot as it was drawn, or nothing.
  std::string html(const std::string& svg) const;
};

}  // namespace solenoid
