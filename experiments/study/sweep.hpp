#pragma once

#include "experiments/campaign/run_campaign.hpp"
#include "experiments/campaign/run_record.hpp"

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace solenoid {

struct Result;

/// A figure of a group of runs, the unstable ones left out.
struct StudyFigure {
  enum class Pool { mean, geometric_mean, harmonic_mean, largest };
  std::string name;
  std::string label;                         ///< of a plot's axis
  std::function<double(const Metrics&)> of;  ///< a run
  Pool pool;
  bool best_least = true;
};
/// Of each metric of a system its mean under its own name, of the judged one the geometric mean, of a time between events
/// the harmonic one, and as worst_NAME the largest; then what solves took, solve_p50_us and worst_solve_p99_us.
std::vector<StudyFigure> study_figures(const SystemDescription& system);

/// One number of the variants, varied with everything else equal.
struct Sweep {
  std::string key;                    ///< below [variant.NAME]: "horizon.steps"
  std::string label;                  ///< of a plot's axis
  std::vector<double> values, drawn;  ///< `drawn`: where on that axis
  std::vector<std::string> variants;  ///< those it is varied in; the campaign's others run as they are
};

/// What a knee is looked for in: the compromise of two figures that are both better small.
///
///     d(v) = | ((x(v) - min x) / (max x - min x), (y(v) - min y) / (max y - min y)) |
///
/// over a series' values v: the distance to the point that is best in both (which is none of them), each figure in
/// units of its range. The knee is the value of least d.
struct KneeOf {
  std::string x, y;
  std::vector<double> among;  ///< the values it may be; empty: all
};

/// One figure read off at equal values of another, between two neighbours of a series: both in their logarithms.
struct ReadAt {
  std::string x, y;
  std::vector<double> values;  ///< of x
};

/// The points of a table that no other point beats in both of two figures: not worse in either, and better in one.
struct FrontOf {
  std::vector<std::string> x;  ///< a front each
  std::string y;
};

/// A printed table of the thesis as one more series.
struct PrintedSeries {
  std::string name, file, value;
  std::vector<std::string> columns;  ///< of the table's figures, in their order
};

/// One table of a study.
struct StudyTable {
  std::string name, title;
  std::vector<std::string> scenarios;  ///< pooled are those whose names begin with one of these
  std::vector<std::string> figures;
  bool across_conditions = false;  ///< a row for each first condition, in place of one for each value
  std::optional<double> only;      ///< of the values
  std::optional<KneeOf> knee;
  std::optional<ReadAt> at;
  std::optional<FrontOf> fronts;
  std::optional<PrintedSeries> printed;
};

/// One plot of a study's figure: two figures of a table, or one against the value or condition (`x` = "value").
struct StudyPanel {
  std::string table, x, y, log;  ///< log: "", "x", "y" or "xy"
};

/// A study as data: a campaign file with a table [study] (docs/how-to/studies.md).
struct Study {
  std::string name, title;
  Sweep sweep;
  std::vector<StudyTable> tables;
  std::vector<StudyPanel> panels;
  Campaign campaign;  ///< with a variant for each value, and the variants that are not swept
  /// Of each of the campaign's variants: what it is a point of, and where.
  struct Member {
    std::string series;
    std::optional<double> value;
  };
  std::vector<Member> members;
};

/// Reads a study's file, or the shipped one of that name. Throws ConfigError with file, line, key and what is allowed.
Study read_study(const std::string& path);

/// A row of a table: the runs of a series with one value, or condition.
struct StudyPoint {
  std::string series;
  std::optional<double> value;         ///< of the key, or the scenarios' first condition; none for a variant not swept
  int runs = 0, bad = 0;               ///< bad: not ended well
  std::vector<double> figures = {};    ///< of the table, in its order; NaN if no run ended well
  std::optional<double> to_best = {};  ///< d above; of a variant not swept, in the units of the first series swept
  bool knee = false;
};
using StudyRows = std::vector<StudyPoint>;

/// The rows of each table.
std::vector<StudyRows> study_rows(const Study& study, std::span<const RunRecord> records);

/// What a series has of y where its x is this, or nothing where no two neighbours in x enclose it.
std::optional<double> read_at(const StudyTable& table, const StudyRows& rows, const std::string& series, double x);

/// Of these rows those on the front of two of the table's figures, in the order of x; points without numbers are on none.
std::vector<const StudyPoint*> front_of(const Study& study, const StudyTable& table, const StudyRows& rows,
                                        const std::string& x, const std::string& y);

/// JSON: {"study", "title", "key", "tables": [{name, title, rows: [{variant, value, runs, bad, FIGURE..., to_best,
/// knee}], at: {x, y, rows: [{variant, at, y}]}, fronts: [{x, y, points: [{variant, value, x, y}]}]}]}. CSV: table,variant,value,runs,bad,figure,number, a line a number. Drawn are the panels.
Result result_of(const Study& study, std::span<const StudyRows> rows);

}  // namespace solenoid
