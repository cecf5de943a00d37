#include "experiments/campaign/trace.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <nlohmann/json.hpp>
#include <zlib.h>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view magic = "SLT1";
constexpr std::int64_t no_number = std::int64_t{1} << 46;  // with its differences, exact as a double
constexpr double largest = static_cast<double>(no_number / 2);

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
  std::int64_t last = 0, slope = 0;
  std::size_t at = 0;
  while (steps.size() < count) {
    std::uint64_t coded = 0;
    for (int shift = 0;; shift += 7) {
      if (at >= bytes.size() || shift > 63) throw std::invalid_argument("a trace's column ends too early");
      const auto byte = static_cast<unsigned char>(bytes[at++]);
      coded |= std::uint64_t{byte & 0x7fu} << shift;
      if (byte < 0x80) break;
    }
    const auto difference = static_cast<std::int64_t>((coded >> 1) ^ (0 - (coded & 1)));
    slope = order == 1 ? difference : slope + difference;
    last += slope;
    steps.push_back(last);
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

std::string inflated(std::string_view bytes) {
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) throw std::bad_alloc();
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  std::string out;
  int status = Z_OK;
  while (status == Z_OK) {
    char buffer[65536];
    stream.next_out = reinterpret_cast<Bytef*>(buffer);
    stream.avail_out = sizeof buffer;
    status = inflate(&stream, Z_NO_FLUSH);
    out.append(buffer, sizeof buffer - stream.avail_out);
    if (status == Z_BUF_ERROR) break;
  }
  inflateEnd(&stream);
  if (status != Z_STREAM_END) throw std::invalid_argument("a trace's compressed part is damaged");
  return out;
}

Json header_of(const Trace& trace) {
  return {{"samples", trace.ticks.size()},
          {"tick_s", trace.tick_s},
          {"modes", trace.modes},
          {"cylinder_force", trace.cylinder_force},
          {"motor_limit_n", trace.motor_limit_n},
          {"measured", trace.measured},
          {"solves", {{"first", trace.solves.first}, {"counts", trace.solves.counts}}}};
}

Trace trace_of(const Json& header, std::string_view body) {
  Trace trace;
  const auto samples = header.at("samples").get<std::size_t>();
  header.at("tick_s").get_to(trace.tick_s);
  header.at("modes").get_to(trace.modes);
  header.at("cylinder_force").get_to(trace.cylinder_force);
  header.at("motor_limit_n").get_to(trace.motor_limit_n);
  header.at("measured").get_to(trace.measured);
  header.at("solves").at("first").get_to(trace.solves.first);
  header.at("solves").at("counts").get_to(trace.solves.counts);
  std::size_t at = 0;
  for (const Json& column : header.at("columns")) {
    const auto size = column.at("bytes").get<std::size_t>();
    if (samples > size || size > body.size() - at) throw std::invalid_argument("a trace's column is missing");
    const auto steps = from_differences(body.substr(at, size), samples, column.at("order").get<int>());
    at += size;
    if (column.at("name") == "tick") {
      trace.ticks = steps;
      continue;
    }
    Trace::Signal signal{column.at("name"), column.at("unit"), column.at("resolution"), {}};
    for (const std::int64_t step : steps)
      signal.values.push_back(step == no_number ? std::numeric_limits<double>::quiet_NaN()
                                                : static_cast<double>(step) * signal.resolution);
    trace.signals.push_back(std::move(signal));
  }
  return trace;
}

}  // namespace

std::string encode_trace(const Trace& trace) {
  Json header = header_of(trace), columns = Json::array();
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
  return std::string(magic) + deflated(length + text + body);
}

Trace decode_trace(std::string_view bytes) {
  if (!bytes.starts_with(magic)) throw std::invalid_argument("no trace: it does not begin with SLT1");
  const std::string all = inflated(bytes.substr(magic.size()));
  std::size_t length = 0;
  for (std::size_t byte = 0; byte < 4 && byte < all.size(); ++byte)
    length |= std::size_t{static_cast<unsigned char>(all[byte])} << (8 * byte);
  if (all.size() < 4 || length > all.size() - 4) throw std::invalid_argument("a trace's header is cut off");
  const std::string_view rest = std::string_view(all).substr(4);
  try {
    return trace_of(Json::parse(rest.substr(0, length)), rest.substr(length));
  } catch (const Json::exception& error) {
    throw std::invalid_argument(std::string("a trace's header: ") + error.what());
  }
}

}  // namespace solenoid
