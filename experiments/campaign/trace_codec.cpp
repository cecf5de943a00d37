#include "core/config/reader.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/campaign/trace.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <zlib.h>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view trace_magic = "SLT2", trace_magic_before = "SLT1";
constexpr std::int64_t no_number = std::int64_t{1} << 46;  // with its differences, exact as a double
constexpr std::size_t most_header = 1'000'000;             // what a file may make of itself in memory
constexpr std::size_t most_body = 128'000'000, most_numbers = 32'000'000;
constexpr std::size_t most_panels = 100;             // of a figure's height
constexpr std::int64_t most_solves = 1'000'000'000;  // of a bin: sums over many runs stay exact
constexpr double largest_factor = 1e12;
constexpr double largest = static_cast<double>(no_number) / 2;

std::int64_t steps_of(double value, double resolution) {
  const double steps = value / resolution;
  if (std::isnan(steps)) return no_number;
  return std::llround(std::clamp(steps, -largest, largest));
}

void append_leb128(std::string& out, std::int64_t value) {
  auto rest = (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
  for (; rest >= 0x80; rest >>= 7) out += static_cast<char>(rest | 0x80);
  out += static_cast<char>(rest);
}

std::string differences(const std::vector<std::int64_t>& steps, int order) {
  std::string out;
  std::int64_t last = 0, last_slope = 0;
  for (const std::int64_t step : steps) {
    const std::int64_t slope = step - last;
    append_leb128(out, order == 1 ? slope : slope - last_slope);
    last = step;
    last_slope = slope;
  }
  return out;
}

std::vector<std::int64_t> from_differences(std::string_view bytes, std::size_t count, int order) {
  std::vector<std::int64_t> steps;
  steps.reserve(count);
  std::uint64_t last = 0, slope = 0;  // of a file: they may wrap
  std::size_t at = 0;
  while (steps.size() < count) {
    std::uint64_t coded = 0;
    for (int shift = 0;; shift += 7) {
      if (at >= bytes.size() || shift > 63) throw std::invalid_argument("a trace's column ends too early");
      const auto byte = static_cast<unsigned char>(bytes[at++]);
      coded |= std::uint64_t{byte & 0x7fu} << shift;
      if (byte < 0x80) break;
    }
    const std::uint64_t difference = (coded >> 1) ^ (0 - (coded & 1));
    slope = order == 1 ? difference : slope + difference;
    last += slope;
    steps.push_back(static_cast<std::int64_t>(last));
  }
  return steps;
}

/// The shorter of first and second differences; its entry in the header is appended to `columns`.
std::string encode_column(const std::string& name, const std::string& unit, double resolution,
                          const std::vector<std::int64_t>& steps, Json& columns) {
  std::string first = differences(steps, 1), second = differences(steps, 2);
  const bool take_second = second.size() < first.size();
  std::string& bytes = take_second ? second : first;
  columns.push_back({{"name", name},
                     {"unit", unit},
                     {"resolution", resolution},
                     {"order", take_second ? 2 : 1},
                     {"bytes", bytes.size()}});
  return std::move(bytes);
}

std::string deflated(const std::string& text) {
  uLongf size = compressBound(static_cast<uLong>(text.size()));
  std::string out(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(text.data()),
                static_cast<uLong>(text.size()), 6) != Z_OK)
    throw std::bad_alloc();
  out.resize(size);
  return out;
}

/// Inflates piece by piece, so that nothing becomes larger than was asked for.
class Inflater {
 public:
  explicit Inflater(std::string_view bytes) {
    if (inflateInit(&stream_) != Z_OK) throw std::bad_alloc();
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream_.avail_in = static_cast<uInt>(bytes.size());
  }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  std::string next(std::size_t size) {
    std::string out(size, '\0');
    if (read(out.data(), size) < size) throw std::invalid_argument("a trace's compressed part is damaged or cut");
    return out;
  }
  /// Whether this is all of it, checksum included.
  bool ends() {
    char more = 0;
    return read(&more, 1) == 0 && status_ == Z_STREAM_END;
  }

 private:
  std::size_t read(char* out, std::size_t size) {
    stream_.next_out = reinterpret_cast<Bytef*>(out);
    stream_.avail_out = static_cast<uInt>(size);
    while (status_ == Z_OK && stream_.avail_out > 0) status_ = inflate(&stream_, Z_NO_FLUSH);
    return size - stream_.avail_out;
  }

  z_stream stream_{};
  int status_ = Z_OK;
};

Json derived_json(const TraceLayout::Derived& d) {
  return {
      {"name", d.name}, {"unit", d.unit}, {"resolution", d.resolution}, {"constant", d.constant}, {"terms", d.terms}};
}

TraceLayout::Derived derived_from(const Json& json) {
  return {json.at("name"), json.at("unit"), json.at("resolution"), json.at("constant"),
          json.at("terms").get<std::vector<std::pair<std::string, double>>>()};
}

Json panel_json(const TraceLayout::Panel& p) {
  Json curves = Json::array();
  for (const TraceLayout::Curve& c : p.curves)
    curves.push_back({{"signal", c.signal}, {"label", c.label}, {"desired", c.desired}});
  return {{"label", p.label}, {"unit", p.unit}, {"scale", p.scale}, {"curves", std::move(curves)},
          {"modes", p.modes}, {"zero", p.zero}, {"limit", p.limit}, {"choice", p.choice}};
}

TraceLayout::Panel panel_from(const Json& json) {
  TraceLayout::Panel p{.label = json.at("label"),
                       .unit = json.at("unit"),
                       .scale = json.at("scale"),
                       .curves = {},
                       .modes = json.at("modes"),
                       .zero = json.at("zero"),
                       .limit = json.at("limit"),
                       .choice = json.at("choice")};
  for (const Json& curve : json.at("curves"))
    p.curves.push_back({curve.at("signal"), curve.at("label"), curve.at("desired")});
  return p;
}

/// How a header says what is made of the signals, and how they are drawn.
using ReadLayout = void (*)(const Json& header, Trace& trace);

void read_layout(const Json& header, Trace& trace) {
  for (const Json& derived : header.at("derived")) trace.derived.push_back(derived_from(derived));
  for (const Json& panel : header.at("panels")) trace.panels.push_back(panel_from(panel));
}

/// The old format's traces are all of the pneumatic actuator: three numbers of its cylinder's force and the motor's
/// limit say what a layout says now.
void read_layout_before(const Json& header, Trace& trace) {
  const auto force = header.at("cylinder_force").get<std::array<double, 3>>();
  const double motor_limit_n = header.at("motor_limit_n");
  trace.derived = {{"error", "m", 1e-7, 0.0, {{"reference", 1.0}, {"position", -1.0}}},
                   {"cylinder", "N", 1e-3, force[0], {{"pressure_a", force[1]}, {"pressure_b", force[2]}}}};
  trace.panels = {
      {.label = "position",
       .unit = "mm",
       .scale = 1e3,
       .curves = {{"position", "actual"}, {"reference", "desired", true}}},
      {.label = "error", .unit = "mm", .scale = 1e3, .curves = {{"error", "error"}}, .zero = true},
      {.label = "valve mode", .curves = {{"mode", "valve mode"}}, .modes = true},
      {.label = "cylinder force", .unit = "N", .curves = {{"cylinder", "cylinder"}}, .zero = true, .choice = "fourth"},
      {.label = "pressure",
       .unit = "kPa",
       .scale = 1e-3,
       .curves = {{"pressure_a", "pressure A"}, {"pressure_b", "pressure B"}},
       .choice = "fourth"},
      {.label = "motor force",
       .unit = "N",
       .curves = {{"motor", "motor"}},
       .zero = true,
       .limit = std::max(motor_limit_n, 1.0)}};
}

/// Every signal that something is made of, or that is drawn, must be there.
void require_signals(const Trace& trace) {
  const auto require = [](bool there, const std::string& name) {
    if (!there) throw std::invalid_argument("a trace's signal '" + name + "' is missing");
  };
  for (const TraceLayout::Derived& derived : trace.derived)
    for (const auto& [name, factor] : derived.terms) require(trace.has(name), name);
  for (const TraceLayout::Panel& panel : trace.panels)
    for (const TraceLayout::Curve& curve : panel.curves)
      require(
          trace.has(curve.signal) || std::ranges::count(trace.derived, curve.signal, &TraceLayout::Derived::name) > 0,
          curve.signal);
}

void require_between(const char* what, double value, double low, double high) {
  if (!(value >= low && value <= high))
    throw std::invalid_argument(fmt::format("a trace's {} of {:g} is not from {:g} to {:g}", what, value, low, high));
}

void require_resolution(double resolution) { require_between("resolution", resolution, 1e-15, largest_factor); }

void require_panel(const TraceLayout::Panel& panel, const Trace& trace) {
  require_between("scale", panel.scale, -largest_factor, largest_factor);
  require_between("limit", panel.limit, 0.0, largest_factor);
  if (panel.curves.empty()) throw std::invalid_argument("a trace's panel has no curve");
  if (panel.modes && trace.modes.empty()) throw std::invalid_argument("a trace's panel of modes has no modes");
}

/// Whoever draws multiplies all of these, and the products must be numbers.
void require_drawable(const Trace& trace) {
  require_between("tick_s", trace.tick_s, 1e-9, 3600.0);
  for (const Trace::Signal& signal : trace.signals) require_resolution(signal.resolution);
  for (const TraceLayout::Derived& derived : trace.derived) {
    require_resolution(derived.resolution);
    require_between("constant", derived.constant, -largest_factor, largest_factor);
    for (const auto& [name, factor] : derived.terms) require_between("factor", factor, -largest_factor, largest_factor);
  }
  if (trace.panels.size() > most_panels) throw std::invalid_argument("a trace has too many panels");
  for (const TraceLayout::Panel& panel : trace.panels) require_panel(panel, trace);
}

SolveHistogram solves_of(const Json& json) {
  SolveHistogram solves;
  json.at("first").get_to(solves.first);
  json.at("counts").get_to(solves.counts);
  constexpr std::size_t bins = SolveHistogram::most - SolveHistogram::least + 1;
  if (solves.first < SolveHistogram::least || solves.first > SolveHistogram::most ||
      solves.counts.size() > bins - static_cast<std::size_t>(solves.first - SolveHistogram::least))
    throw std::invalid_argument("a trace's solver times are outside of its bins");
  for (const std::int64_t count : solves.counts)
    if (count < 0 || count > most_solves) throw std::invalid_argument("a trace's solves are too many, or below 0");
  return solves;
}

/// Whoever draws divides time into spans.
void require_in_order(const std::vector<std::int64_t>& ticks) {
  for (std::size_t i = 0; i < ticks.size(); ++i)
    if (ticks[i] < 0 || ticks[i] > no_number || (i > 0 && ticks[i] < ticks[i - 1]))
      throw std::invalid_argument("a trace's ticks go back, or begin before 0");
}

/// Bytes of all columns, once header and bounds agree.
std::size_t body_size(const Json& header) {
  const auto samples = header.at("samples").get<std::size_t>();
  std::size_t size = 0, columns = 0;
  for (const Json& column : header.at("columns")) {
    const auto bytes = column.at("bytes").get<std::size_t>();
    if (samples > bytes) throw std::invalid_argument("a trace's column is missing");
    if (bytes > most_body - size) throw std::invalid_argument("a trace is too large");
    size += bytes;
    ++columns;
  }
  if (samples * columns > most_numbers) throw std::invalid_argument("a trace is too large");
  return size;
}

Trace trace_of(const Json& header, std::string_view body, ReadLayout read_layout_of) {
  Trace trace;
  const auto samples = header.at("samples").get<std::size_t>();
  header.at("tick_s").get_to(trace.tick_s);
  header.at("modes").get_to(trace.modes);
  header.at("measured").get_to(trace.measured);
  trace.solves = solves_of(header.at("solves"));
  read_layout_of(header, trace);
  std::size_t at = 0;
  for (const Json& column : header.at("columns")) {
    const auto size = column.at("bytes").get<std::size_t>();
    const auto steps = from_differences(body.substr(at, size), samples, column.at("order").get<int>());
    at += size;
    if (column.at("name") == "tick") {
      trace.ticks = steps;
      continue;
    }
    Trace::Signal signal{column.at("name"), column.at("unit"), column.at("resolution"), {}};
    signal.values.reserve(steps.size());
    for (const std::int64_t step : steps)
      signal.values.push_back(step == no_number ? std::numeric_limits<double>::quiet_NaN()
                                                : static_cast<double>(step) * signal.resolution);
    trace.signals.push_back(std::move(signal));
  }
  require_in_order(trace.ticks);
  require_signals(trace);
  require_drawable(trace);
  return trace;
}

}  // namespace

Json trace_header(const Trace& trace) {
  Json json = {{"samples", trace.ticks.size()},
               {"tick_s", trace.tick_s},
               {"modes", trace.modes},
               {"measured", trace.measured},
               {"derived", Json::array()},
               {"panels", Json::array()},
               {"solves", {{"first", trace.solves.first}, {"counts", trace.solves.counts}}}};
  for (const TraceLayout::Derived& derived : trace.derived) json["derived"].push_back(derived_json(derived));
  for (const TraceLayout::Panel& panel : trace.panels) json["panels"].push_back(panel_json(panel));
  return json;
}

std::string encode_trace(const Trace& trace) {
  Json header = trace_header(trace), columns = Json::array();
  std::string body = encode_column("tick", "", 1.0, trace.ticks, columns);
  for (const Trace::Signal& signal : trace.signals) {
    std::vector<std::int64_t> steps;
    steps.reserve(signal.values.size());
    for (const double value : signal.values) steps.push_back(steps_of(value, signal.resolution));
    body += encode_column(signal.name, signal.unit, signal.resolution, steps, columns);
  }
  header["columns"] = std::move(columns);
  const std::string text = header.dump();
  std::string length;
  for (int byte = 0; byte < 4; ++byte) length += static_cast<char>(text.size() >> (8 * byte) & 0xff);
  return std::string(trace_magic) + deflated(length + text + body);
}

Trace decode_trace(std::string_view bytes) {
  const bool before = bytes.starts_with(trace_magic_before);
  if (!before && !bytes.starts_with(trace_magic)) throw std::invalid_argument("no trace: it does not begin with SLT2");
  Inflater inflater(bytes.substr(trace_magic.size()));
  std::size_t length = 0;
  const std::string length_bytes = inflater.next(4);
  for (std::size_t byte = 0; byte < 4; ++byte)
    length |= std::size_t{static_cast<unsigned char>(length_bytes[byte])} << (8 * byte);
  if (length > most_header) throw std::invalid_argument("a trace's header is too large");
  try {
    const Json header = parse_json(inflater.next(length), "a trace's header");
    const std::string body = inflater.next(body_size(header));
    if (!inflater.ends()) throw std::invalid_argument("a trace has more bytes than its header tells");
    return trace_of(header, body, before ? read_layout_before : read_layout);
  } catch (const Json::exception& error) {
    throw std::invalid_argument("a trace's header: " + problem_with_json(error));
  } catch (const ConfigError& error) {
    throw std::invalid_argument(error.what());
  } catch (const std::bad_alloc&) {
    throw std::invalid_argument("a trace does not fit into memory");
  }
}

}  // namespace solenoid
