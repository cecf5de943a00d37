#pragma once

#include "experiments/logs/column_source.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace solenoid {

/// A number over time, from the messages of one topic; times increase.
struct LoggedSeries {
  std::vector<double> time_s, value;
  std::size_t size() const { return time_s.size(); }
  /// The last value at or before `t`, which is not before the first.
  double held(double t) const;
  /// In a straight line between the neighbours of `t`; no number where they are more than three and a half of the usual
  /// steps apart, or where there is none.
  double straight(double t) const;
  /// The commonest step; found once the series is whole.
  double step_s = 0;
};

/// What an MCAP's JSON channels have, in the order of the sources.
struct JsonSeries {
  std::vector<LoggedSeries> series;
  std::string problem;  ///< why the file is not complete or was changed; empty for one that was closed
};

/// Reads numbers of JSON channels of an MCAP file, whoever wrote it: each source is TOPIC.FIELD with factor and offset, a
/// field in an object below has a dotted path, an element of a list its place from 0. Times are those at which the
/// messages were logged, from the first on. Throws ConfigError, naming the file and the topic or the byte; so too for a
/// source that two channels have, or two fields.
JsonSeries read_json_series(std::string_view bytes, const std::string& path, const std::vector<ColumnSource>& sources);

}  // namespace solenoid
