#include "experiments/campaign/shard_file.hpp"

#include "controllers/systems.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/base/bytes.hpp"
#include "experiments/base/machine.hpp"

#include <bit>
#include <charconv>
#include <chrono>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

constexpr double most = 1e300, most_whole = 2147483647.0;
constexpr std::uint64_t most_solves = 1'000'000'000'000;

void append_text(std::string& out, std::string_view text) {
  append_little_endian(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}

void append_number(std::string& out, double value) { append_little_endian(out, std::bit_cast<std::uint64_t>(value)); }

/// Reads what is appended above, and never beyond its end.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}

  std::string_view take(std::size_t count) {
    if (count > rest_.size()) throw std::invalid_argument("is cut off");
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }
  template <class T>
  T whole() {
    return little_endian<T>(take(sizeof(T)).data());
  }
  double number() { return std::bit_cast<double>(whole<std::uint64_t>()); }
  /// One that a run can have had.
  double number_within(double low, double high) {
    const double value = number();
    if (!(value >= low && value <= high)) throw std::invalid_argument("has a number that no run has");
    return value;
  }
  std::string_view text() { return take(whole<std::uint32_t>()); }
  bool done() const { return rest_.empty(); }

 private:
  std::string_view rest_;
};

RunHead read_head(ByteReader& in) {
  RunHead head{in.whole<std::uint64_t>(), in.whole<std::uint64_t>(), {}, {}, {}, {}, 0.0};
  for (std::string_view* text : {&head.variant, &head.scenario, &head.trajectory, &head.status}) *text = in.text();
  head.wall_s = in.number();
  return head;
}

SolveHistogram read_histogram(ByteReader& in) {
  SolveHistogram solves;
  solves.first = static_cast<std::int16_t>(in.whole<std::uint16_t>());
  const int bins = in.whole<std::uint16_t>();
  if (bins > 0 && (solves.first < SolveHistogram::least || solves.first + bins - 1 > SolveHistogram::most))
    throw std::invalid_argument("has times that no solve takes");
  for (int i = 0; i < bins; ++i) {
    const auto count = in.whole<std::uint64_t>();
    if (count > most_solves) throw std::invalid_argument("has more solves than any run");  // so that sums have room
    solves.counts.push_back(static_cast<std::int64_t>(count));
  }
  return solves;
}

std::vector<std::string> texts_at(const Json& json, const char* key) {
  return json.at(key).get<std::vector<std::string>>();
}

}  // namespace

std::string encode_run(const KeptRun& run) {
  const RunRecord& r = run.record;
  const SystemDescription& system = description_of(r);
  std::string out;
  append_little_endian(out, hash_number(run.configuration));
  append_little_endian(out, r.seed);
  for (const std::string* text : {&r.variant, &r.scenario, &r.trajectory, &r.status}) append_text(out, *text);
  append_number(out, run.wall_s);
  for (std::size_t i = 0; i < system.conditions.size(); ++i)
    append_number(out, i < r.conditions.size() ? r.conditions[i] : 0.0);
  out += static_cast<char>(r.metrics.has_value());
  if (!r.metrics) return out;
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  for (const MetricColumn& metric : system.metrics)
    append_number(out, r.metrics->has(metric.key) ? r.metrics->number(metric.key) : none);
  for (const SolverColumn& column : solver_columns()) append_number(out, column.value(*r.metrics));
  append_little_endian(out, static_cast<std::uint16_t>(run.solves.first));
  append_little_endian(out, static_cast<std::uint16_t>(run.solves.counts.size()));
  for (const std::int64_t count : run.solves.counts) append_little_endian(out, static_cast<std::uint64_t>(count));
  return out;
}

KeptRun decode_run(std::string_view bytes, const WritingSession& session) {
  ByteReader in(bytes);
  const RunHead head = read_head(in);
  KeptRun run{fmt::format("{:016x}", head.configuration), {}, head.wall_s, {}};
  RunRecord& r = run.record;
  r.system = session.system;
  r.variant = head.variant;
  r.scenario = head.scenario;
  r.trajectory = head.trajectory;
  r.seed = head.seed;
  r.status = head.status;
  for (std::size_t i = 0; i < session.conditions.size(); ++i) r.conditions.push_back(in.number_within(-most, most));
  if (in.whole<std::uint8_t>() != 0) {
    Metrics& m = r.metrics.emplace();
    for (const std::string& name : session.metrics)
      if (const double value = in.number(); value == value) m.set(name, value);
    for (const SolverColumn& column : solver_columns())
      column.set(m, in.number_within(0.0, column.count ? most_whole : most));
    run.solves = read_histogram(in);
  }
  if (!in.done() || (r.ok() && !r.metrics)) throw std::invalid_argument("is no run");
  return run;
}

RunHead decode_head(std::string_view bytes) {
  ByteReader in(bytes);
  return read_head(in);
}

std::string encode_frame(const RunFrame& frame) {
  std::string content(1, static_cast<char>(FrameKind::run));
  append_little_endian(content, frame.session);
  append_little_endian(content, frame.trace);
  append_little_endian(content, frame.trace_checksum);
  content += frame.run;
  return content;
}

std::optional<RunFrame> run_frame(std::string_view content) {
  if (content.empty() || content.front() != static_cast<char>(FrameKind::run)) return std::nullopt;
  constexpr std::size_t before = 1 + 4 + 8 + 4;
  if (content.size() < before) throw std::invalid_argument("is cut off");
  return RunFrame{little_endian<std::uint32_t>(content.data() + 1), little_endian<std::uint64_t>(content.data() + 5),
                  little_endian<std::uint32_t>(content.data() + 13), content.substr(before)};
}

std::optional<std::string_view> session_frame(std::string_view content) {
  if (content.empty() || content.front() != static_cast<char>(FrameKind::session)) return std::nullopt;
  return content.substr(1);
}

std::uint64_t hash_number(const std::string& hexadecimal) {
  std::uint64_t value = 0;
  std::from_chars(hexadecimal.data(), hexadecimal.data() + hexadecimal.size(), value, 16);
  return value;
}

WritingSession session_of(const Campaign& campaign) {
  const SystemDescription& system = campaign.system->description();
  WritingSession session{campaign.maker, system.name, {}, {}, machine_name(), 0, false};
  for (const Signal& condition : system.conditions) session.conditions.push_back(condition.key);
  for (const MetricColumn& metric : system.metrics) session.metrics.push_back(metric.key);
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  session.began_ms = std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
  return session;
}

std::string encode_session(const WritingSession& s) {
  Json json = {{"format", 1},          {"maker", s.maker},        {"system", s.system}, {"conditions", s.conditions},
               {"metrics", s.metrics}, {"solver", Json::array()}, {"host", s.host},     {"began_ms", s.began_ms},
               {"logged", s.logged}};
  for (const SolverColumn& column : solver_columns()) json["solver"].push_back(column.name);
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

WritingSession decode_session(std::string_view text) {
  try {
    const Json json = parse_json(text, "session");
    WritingSession s{json.at("maker").get<std::string>(), json.at("system").get<std::string>(),
                     texts_at(json, "conditions"),        texts_at(json, "metrics"),
                     json.at("host").get<std::string>(),  json.at("began_ms").get<std::int64_t>(),
                     json.at("logged").get<bool>()};
    std::vector<std::string> solver;
    for (const SolverColumn& column : solver_columns()) solver.push_back(column.name);
    if (json.at("format") != 1 || texts_at(json, "solver") != solver)
      throw std::invalid_argument("is of another version's format");
    return s;
  } catch (const Json::exception&) {
    throw std::invalid_argument("is no session");
  } catch (const ConfigError&) {
    throw std::invalid_argument("is no session");
  }
}

namespace {

/// The trace of a run of these files; none if it is not as it was written.
std::optional<std::string> whole_trace(const std::string& shard, const RunFrame& run) {
  try {
    std::string trace = read_frame(shard + ".traces", run.trace);
    return crc32(trace) == run.trace_checksum ? std::optional(std::move(trace)) : std::nullopt;
  } catch (const ConfigError&) {
    return std::nullopt;
  }
}

}  // namespace

std::size_t append_shard(const std::string& from, const std::string& to) {
  FrameReader frames(from + ".runs");
  FrameWriter runs(to + ".runs");
  std::optional<FrameWriter> traces;
  std::size_t count = 0;
  while (frames.next()) {
    auto frame = run_frame(frames.content());
    if (!frame) {
      runs.append(frames.content());  // a session
      continue;
    }
    if (frame->trace != no_trace) {
      const auto trace = whole_trace(from, *frame);
      if (!trace) continue;  // nobody would believe the run: it is done again, or was
      if (!traces) traces.emplace(to + ".traces");
      frame->trace = traces->append(*trace);
    }
    runs.append(encode_frame(*frame));
    ++count;
  }
  if (traces) traces->sync();
  runs.sync();
  return count;
}

ShardWriter::ShardWriter(std::string path, const WritingSession& session)
    : path_(std::move(path)), runs_(path_ + ".runs") {
  const std::string text = encode_session(session);
  session_ = crc32(text);
  runs_.append(static_cast<char>(FrameKind::session) + text);
}

void ShardWriter::add(std::string_view encoded, std::string_view trace) {
  if (!trace.empty() && !traces_) traces_ = std::make_unique<FrameWriter>(path_ + ".traces");
  const std::uint64_t at = trace.empty() ? no_trace : traces_->append(trace);
  runs_.append(encode_frame({session_, at, crc32(trace), encoded}));
}

void ShardWriter::sync() {
  if (traces_) traces_->sync();  // first: a record may not outlast its trace
  runs_.sync();
}

}  // namespace solenoid
