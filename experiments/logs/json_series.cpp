#include "experiments/logs/json_series.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/shown_text.hpp"
#include "experiments/rig/log/json_numbers.hpp"
#include "experiments/rig/log/mcap_reader.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double widest = 3.5;  // usual steps between two messages that a straight line may bridge
constexpr double longest_series_s = 1e5;
constexpr std::size_t most_messages = 4'000'000;

class SeriesReader {
 public:
  SeriesReader(const std::string& path, const std::vector<ColumnSource>& sources)
      : path_(path), series_(sources.size()) {
    wanted_.reserve(sources.size());
    for (const ColumnSource& source : sources) wanted_.push_back(source.scaled());
  }

  void take(const McapMessage& message) {
    const std::string prefix = message.channel.topic + ".";
    if (std::ranges::none_of(wanted_, [&](const auto& w) { return w.heading.starts_with(prefix); })) return;
    if (message.channel.encoding != "json")
      throw ConfigError(fmt::format("{}: {} (allowed: 'json')", path_, message.channel.text()));
    if (first_ns_ == 0) first_ns_ = message.time_ns;
    const double t = 1e-9 * static_cast<double>(static_cast<std::int64_t>(message.time_ns - first_ns_));
    const auto problem = read_json_numbers(message.data, [&](const std::string& field, double value) {
      for (std::size_t i = 0; i < wanted_.size(); ++i)
        if (wanted_[i].heading.size() == prefix.size() + field.size() && wanted_[i].heading.ends_with(field) &&
            wanted_[i].heading.starts_with(prefix))
          add(message, i, t, wanted_[i].factor * value + wanted_[i].offset);
    });
    if (problem) refuse(message, *problem, "a JSON object");
  }

  std::vector<LoggedSeries> finished(const McapContents& contents) {
    for (std::size_t i = 0; i < series_.size(); ++i) {
      if (series_[i].size() < 2) refuse_missing(wanted_[i].heading, contents);
      std::vector<double> steps;
      steps.reserve(series_[i].size());
      for (std::size_t k = 1; k < series_[i].size(); ++k)
        steps.push_back(series_[i].time_s[k] - series_[i].time_s[k - 1]);
      std::ranges::nth_element(steps, steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2));
      series_[i].step_s = steps[steps.size() / 2];
    }
    return std::move(series_);
  }

 private:
  void add(const McapMessage& message, std::size_t i, double t, double value) {
    LoggedSeries& s = series_[i];
    if (!std::isfinite(value)) refuse(message, wanted_[i].heading + " is no number", "a number");
    if (!(std::abs(t) <= longest_series_s) || (s.size() > 0 && !(t > s.time_s.back())))
      refuse(message, fmt::format("logged at {} s", t), "times that increase, 100000 s in all");
    if (s.size() == most_messages) refuse(message, "one message more", fmt::format("{}", most_messages));
    s.time_s.push_back(t);
    s.value.push_back(value);
  }
  [[noreturn]] void refuse(const McapMessage& message, const std::string& what, const std::string& allowed) const {
    throw ConfigError(fmt::format("{}: a message of {} ({}): {} (allowed: {})", path_, shown(message.channel.topic),
                                  message.where(), what, allowed));
  }
  [[noreturn]] void refuse_missing(const std::string& heading, const McapContents& contents) const {
    std::string topics;
    std::size_t told = 0;
    for (const auto& [id, channel] : contents.channels)
      if (++told <= 8) topics += (topics.empty() ? "" : ", ") + shown(channel.topic);
    throw ConfigError(fmt::format("{}: fewer than two messages with {} (allowed: TOPIC.FIELD, with a topic of {})",
                                  path_, shown(heading), topics.empty() ? "none" : topics));
  }

  const std::string& path_;
  std::vector<ColumnSource::Scaled> wanted_;
  std::vector<LoggedSeries> series_;
  std::uint64_t first_ns_ = 0;
};

}  // namespace

double LoggedSeries::held(double t) const {
  const auto after = std::ranges::upper_bound(time_s, t);
  return value[static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, after - time_s.begin() - 1))];
}

double LoggedSeries::straight(double t) const {
  const auto after = static_cast<std::size_t>(std::ranges::lower_bound(time_s, t) - time_s.begin());
  if (after < size() && time_s[after] == t) return value[after];
  if (after == 0 || after == size() || time_s[after] - time_s[after - 1] > widest * step_s)
    return std::numeric_limits<double>::quiet_NaN();
  const double share = (t - time_s[after - 1]) / (time_s[after] - time_s[after - 1]);
  return value[after - 1] + share * (value[after] - value[after - 1]);
}

std::vector<LoggedSeries> read_json_series(std::string_view bytes, const std::string& path,
                                           const std::vector<ColumnSource>& sources) {
  SeriesReader reader(path, sources);
  const McapContents contents =
      read_mcap(bytes, path, [&](const McapMessage& message, const McapContents&) { reader.take(message); });
  return reader.finished(contents);
}

}  // namespace solenoid
