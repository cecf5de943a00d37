#include "experiments/logs/json_series.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/shown_text.hpp"
#include "experiments/rig/log/json_numbers.hpp"
#include "experiments/rig/log/mcap_reader.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr double widest = 3.5;  // usual steps between two messages that a straight line may bridge
constexpr double longest_series_s = 1e5;
constexpr std::size_t most_messages = 4'000'000;

/// A source, and what was read of it.
struct Wanted {
  const ColumnSource& source;
  ColumnSource::Scaled scaled;
  const McapChannel* channel = nullptr;  ///< which has it; none yet
  std::size_t message = 0;               ///< in which it was last
  LoggedSeries series{};

  bool is(std::string_view prefix, std::string_view field) const {
    return scaled.heading.size() == prefix.size() + field.size() && scaled.heading.starts_with(prefix) &&
           scaled.heading.ends_with(field);
  }
};

class SeriesReader {
 public:
  SeriesReader(const std::string& path, const std::vector<ColumnSource>& sources) : path_(path) {
    wanted_.reserve(sources.size());
    for (const ColumnSource& source : sources) wanted_.push_back({source, source.scaled()});
  }

  void take(const McapMessage& message, const McapContents& so_far) {
    const std::string prefix = message.channel.topic + ".";
    if (std::ranges::none_of(wanted_, [&](const Wanted& w) { return w.scaled.heading.starts_with(prefix); })) return;
    if (message.channel.encoding != "json")
      throw ConfigError(fmt::format("{}: {} (allowed: 'json')", path_, message.channel.text()));
    ++messages_;
    if (!first_ns_) first_ns_ = message.time_ns;
    const double t = 1e-9 * static_cast<double>(static_cast<std::int64_t>(message.time_ns - *first_ns_));
    const auto problem = read_json_numbers(message.data, [&](const std::string& field, double value) {
      for (Wanted& w : wanted_) {
        if (!w.is(prefix, field)) continue;
        if (w.channel && w.channel != &message.channel) refuse_either(w, message.channel, so_far);
        w.channel = &message.channel;
        add(message, w, t, w.scaled.factor * value + w.scaled.offset);
      }
    });
    if (problem) refuse(message, *problem, "a JSON object");
  }

  JsonSeries finished(const McapContents& contents) {
    JsonSeries out{{}, contents.problem};
    out.series.reserve(wanted_.size());
    for (Wanted& w : wanted_) {
      if (w.series.size() < 2) refuse_missing(w.scaled.heading, contents);
      std::vector<double> steps;
      steps.reserve(w.series.size());
      for (std::size_t k = 1; k < w.series.size(); ++k) steps.push_back(w.series.time_s[k] - w.series.time_s[k - 1]);
      std::ranges::nth_element(steps, steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2));
      w.series.step_s = steps[steps.size() / 2];
      out.series.push_back(std::move(w.series));
    }
    return out;
  }

 private:
  void add(const McapMessage& message, Wanted& w, double t, double value) {
    LoggedSeries& s = w.series;
    if (!std::isfinite(value)) refuse(message, shown(w.scaled.heading) + " is no number", "a number");
    if (w.message == messages_) refuse(message, shown(w.scaled.heading) + " twice", "once a message");
    w.message = messages_;
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
  /// Two publishers of a topic are two channels; "/a.b.c" is field "b.c" of "/a" and field "c" of "/a.b".
  [[noreturn]] void refuse_either(const Wanted& w, const McapChannel& other, const McapContents& contents) const {
    const auto meaning = [&](const McapChannel& channel) {
      const auto at = std::ranges::find_if(contents.channels, [&](const auto& c) { return &c.second == &channel; });
      return fmt::format("{} of {}, channel {}", shown(w.scaled.heading.substr(channel.topic.size() + 1)),
                         shown(channel.topic), at->first);
    };
    throw ConfigError(fmt::format("{}: --column {}: could mean {}, or {} (allowed: TOPIC.FIELD of one channel alone)",
                                  path_, shown(w.source.name + "=" + w.source.text), meaning(*w.channel),
                                  meaning(other)));
  }
  [[noreturn]] void refuse_missing(const std::string& heading, const McapContents& contents) const {
    std::string topics;
    std::size_t told = 0;
    for (const auto& [id, channel] : contents.channels)
      if (++told <= 8) topics += (topics.empty() ? "" : ", ") + shown(channel.topic);
    throw ConfigError(fmt::format("{}: fewer than two messages with {}{} (allowed: TOPIC.FIELD, with a topic of {})",
                                  path_, shown(heading), contents.problem.empty() ? "" : ", " + contents.problem,
                                  topics.empty() ? "none" : topics));
  }

  const std::string& path_;
  std::vector<Wanted> wanted_;
  std::optional<std::uint64_t> first_ns_;
  std::size_t messages_ = 0;
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

JsonSeries read_json_series(std::string_view bytes, const std::string& path, const std::vector<ColumnSource>& sources) {
  SeriesReader reader(path, sources);
  const McapContents contents = read_mcap(
      bytes, path, [&](const McapMessage& message, const McapContents& so_far) { reader.take(message, so_far); });
  return reader.finished(contents);
}

}  // namespace solenoid
