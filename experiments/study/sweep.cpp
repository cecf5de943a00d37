#include "experiments/study/sweep.hpp"

#include "experiments/base/printed_table.hpp"
#include "experiments/report/headings.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace solenoid {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

StudyFigure figure_named(const SystemDescription& system, const std::string& name) {
  const std::vector<StudyFigure> figures = study_figures(system);
  return *std::ranges::find(figures, name, &StudyFigure::name);
}

double pooled(const StudyFigure& figure, std::span<const Metrics* const> runs) {
  using Pool = StudyFigure::Pool;
  if (runs.empty()) return nan;
  double sum = 0.0, largest = -std::numeric_limits<double>::infinity();
  for (const Metrics* m : runs) {
    const double value = figure.of(*m);
    sum += figure.pool == Pool::geometric_mean  ? std::log(std::max(value, 1e-12))
           : figure.pool == Pool::harmonic_mean ? 1.0 / value
                                                : value;
    largest = std::max(largest, value);
  }
  if (figure.pool == Pool::largest) return largest;
  const double mean = sum / static_cast<double>(runs.size());
  return figure.pool == Pool::geometric_mean ? std::exp(mean) : figure.pool == Pool::harmonic_mean ? 1.0 / mean : mean;
}

StudyPoint point_of(const StudyTable& table, const Study::Member& member, std::optional<double> value,
                    std::span<const RunRecord* const> records) {
  StudyPoint point{.series = member.series, .value = value, .runs = static_cast<int>(records.size())};
  std::vector<const Metrics*> ended;
  for (const RunRecord* r : records)
    if (r->metrics) ended.push_back(&*r->metrics);
  point.bad = point.runs - static_cast<int>(ended.size());
  point.figures.assign(table.figures.size(), nan);
  if (records.empty()) return point;
  const SystemDescription& system = description_of(*records.front());
  for (std::size_t i = 0; i < table.figures.size(); ++i)
    point.figures[i] = pooled(figure_named(system, table.figures[i]), ended);
  return point;
}

bool belongs(const StudyTable& table, const std::string& scenario) {
  return std::ranges::any_of(table.scenarios, [&](const std::string& prefix) { return scenario.starts_with(prefix); });
}

StudyRows printed_rows(const PrintedSeries& printed) {
  const PrintedTable table = PrintedTable::shipped(printed.file);
  StudyRows rows;
  for (std::size_t i = 0; i < table.rows(); ++i) {
    StudyPoint point{.series = printed.name, .value = table.number(i, printed.value).value, .runs = 1};
    for (const std::string& column : printed.columns) point.figures.push_back(table.number(i, column).value);
    rows.push_back(std::move(point));
  }
  return rows;
}

/// Least and greatest of a figure over a series.
struct ValueSpan {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  void add(double value) { low = std::fmin(low, value), high = std::fmax(high, value); }
  /// 0 also for what is better than all of the series; NaN for what is no number.
  double share(double value) const {
    if (std::isnan(value) || high <= low) return value - value;
    return std::max(0.0, (value - low) / (high - low));
  }
};

void mark_knees(const StudyTable& table, StudyRows& rows) {
  const auto at = [&](const std::string& name) {
    return static_cast<std::size_t>(std::ranges::find(table.figures, name) - table.figures.begin());
  };
  const std::size_t x = at(table.knee->x), y = at(table.knee->y);
  std::map<std::string, std::pair<ValueSpan, ValueSpan>> spans;
  for (const StudyPoint& p : rows)
    if (p.value) spans[p.series].first.add(p.figures[x]), spans[p.series].second.add(p.figures[y]);
  const auto first = std::ranges::find_if(rows, [](const StudyPoint& p) { return p.value.has_value(); });
  std::map<std::string, StudyPoint*> nearest;
  for (StudyPoint& p : rows) {
    if (first == rows.end()) return;
    const auto& [across, up] = spans[p.value ? p.series : first->series];
    p.to_best = std::hypot(across.share(p.figures[x]), up.share(p.figures[y]));
    if (!p.value || std::isnan(*p.to_best)) continue;
    if (const auto& among = table.knee->among; !among.empty() && !std::ranges::count(among, *p.value)) continue;
    StudyPoint*& best = nearest[p.series];
    if (!best || *p.to_best < *best->to_best) best = &p;
  }
  for (const auto& [series, point] : nearest) point->knee = true;
}

StudyRows rows_of(const Study& study, const StudyTable& table, std::span<const RunRecord> records) {
  std::map<std::string, std::vector<const RunRecord*>> by_variant;
  for (const RunRecord& r : records)
    if (belongs(table, r.scenario)) by_variant[r.variant].push_back(&r);
  StudyRows rows;
  for (std::size_t v = 0; v < study.members.size(); ++v) {
    const Study::Member& member = study.members[v];
    const auto& runs = by_variant[study.campaign.variants[v].name];
    if (runs.empty() || (table.only && member.value && *member.value != *table.only)) continue;
    if (!table.across_conditions) {
      rows.push_back(point_of(table, member, member.value, runs));
      continue;
    }
    std::map<double, std::vector<const RunRecord*>> by_condition;
    for (const RunRecord* r : runs) by_condition[r->conditions.front()].push_back(r);
    for (const auto& [condition, some] : by_condition) rows.push_back(point_of(table, member, condition, some));
  }
  if (table.printed) std::ranges::move(printed_rows(*table.printed), std::back_inserter(rows));
  if (table.knee) mark_knees(table, rows);
  return rows;
}

}  // namespace

std::vector<StudyFigure> study_figures(const SystemDescription& system) {
  std::vector<StudyFigure> all;
  for (const MetricColumn& metric : system.metrics) {
    const std::string label = metric_heading(metric).with_unit();
    const bool judged = metric.key == system.judged.metric;
    const auto of = [key = metric.key](const Metrics& m) { return m.number(key); };
    all.push_back({metric.key, label, of,
                   judged            ? StudyFigure::Pool::geometric_mean
                   : metric.harmonic ? StudyFigure::Pool::harmonic_mean
                                     : StudyFigure::Pool::mean,
                   metric.best_least});
    all.push_back({"worst_" + metric.key, "worst " + label, of, StudyFigure::Pool::largest});
  }
  all.push_back(
      {"solve_p50_us", "median solve, us", [](const Metrics& m) { return m.solve_us.p50; }, StudyFigure::Pool::mean});
  all.push_back({"worst_solve_p99_us", "99th percentile of solves, worst run, us",
                 [](const Metrics& m) { return m.solve_us.p99; }, StudyFigure::Pool::largest});
  return all;
}

std::vector<const StudyPoint*> front_of(const Study& study, const StudyTable& table, const StudyRows& rows,
                                        const std::string& x, const std::string& y) {
  struct Figure {
    std::size_t at;
    double sign;  // less is better of sign times it
    double operator()(const StudyPoint& p) const { return sign * p.figures[at]; }
  };
  const auto figure = [&](const std::string& name) {
    const bool least = figure_named(study.campaign.system->description(), name).best_least;
    return Figure{static_cast<std::size_t>(std::ranges::find(table.figures, name) - table.figures.begin()),
                  least ? 1.0 : -1.0};
  };
  const Figure of_x = figure(x), of_y = figure(y);
  const auto beats = [&](const StudyPoint& a, const StudyPoint& b) {
    return of_x(a) <= of_x(b) && of_y(a) <= of_y(b) && (of_x(a) < of_x(b) || of_y(a) < of_y(b));
  };
  std::vector<const StudyPoint*> front;
  for (const StudyPoint& p : rows)
    if (std::isfinite(of_x(p)) && std::isfinite(of_y(p)) &&
        std::ranges::none_of(rows, [&](const StudyPoint& other) { return beats(other, p); }))
      front.push_back(&p);
  std::ranges::sort(front, {}, [&](const StudyPoint* p) { return of_x(*p); });
  return front;
}

std::optional<double> read_at(const StudyTable& table, const StudyRows& rows, const std::string& series, double x) {
  const auto figure = [&](const std::string& name) {
    return static_cast<std::size_t>(std::ranges::find(table.figures, name) - table.figures.begin());
  };
  std::vector<std::pair<double, double>> points;
  for (const StudyPoint& p : rows) {
    const double px = p.figures[figure(table.at->x)], py = p.figures[figure(table.at->y)];
    if (p.series == series && px > 0 && py > 0) points.push_back({std::log(px), std::log(py)});
  }
  std::ranges::sort(points);
  for (std::size_t i = 1; i < points.size(); ++i) {
    const auto [x0, y0] = points[i - 1];
    const auto [x1, y1] = points[i];
    if (!(x0 <= std::log(x) && std::log(x) <= x1) || x0 == x1) continue;
    return std::exp(y0 + (y1 - y0) * (std::log(x) - x0) / (x1 - x0));
  }
  return std::nullopt;
}

std::vector<StudyRows> study_rows(const Study& study, std::span<const RunRecord> records) {
  std::vector<StudyRows> all;
  for (const StudyTable& table : study.tables) all.push_back(rows_of(study, table, records));
  return all;
}

}  // namespace solenoid
