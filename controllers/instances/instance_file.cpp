#include "controllers/instances/instance_set.hpp"
#include "core/actuator/valves.hpp"
#include "core/config/reader.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr std::string_view magic = "SOLINST\n";
constexpr std::size_t checksum_size = 8;

enum Flag : std::uint8_t { has_offset = 1, has_rows = 2, has_continuous = 4, has_load = 8, has_relaxation = 16 };

std::uint64_t fnv1a(std::string_view bytes) {
  std::uint64_t hash = 14695981039346656037u;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 1099511628211u;
  return hash;
}

/// Appends numbers to a string, lowest byte first.
class Writer {
 public:
  void byte(std::uint8_t value) { bytes_ += static_cast<char>(value); }
  void fixed(std::uint64_t value, int size) {
    for (int i = 0; i < size; ++i) byte(static_cast<std::uint8_t>(value >> (8 * i)));
  }
  void number(double value) { fixed(std::bit_cast<std::uint64_t>(value), 8); }
  /// Seven bits a byte, lowest first; the highest bit of a byte says that another follows.
  void count(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7) byte(static_cast<std::uint8_t>(value | 0x80));
    byte(static_cast<std::uint8_t>(value));
  }
  void text(std::string_view text) {
    count(text.size());
    bytes_ += text;
  }
  void rows(const std::vector<std::array<double, 2>>& rows) {
    count(rows.size());
    for (const auto& row : rows) number(row[0]), number(row[1]);
  }
  std::string bytes_;
};

/// Reads what Writer wrote; every refusal names file and byte.
class Reader {
 public:
  Reader(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  [[noreturn]] void fail(const std::string& problem) const {
    throw ConfigError(fmt::format("{}: byte {}: {}", name_, at_, problem));
  }
  void require(bool condition, const char* problem) const {
    if (!condition) fail(problem);
  }
  std::string_view take(std::size_t size) {
    require(size <= bytes_.size() - at_, "the file ends too early (allowed: a whole instance file)");
    at_ += size;
    return bytes_.substr(at_ - size, size);
  }
  std::uint8_t byte() { return static_cast<std::uint8_t>(take(1)[0]); }
  std::uint64_t fixed(int size) {
    std::uint64_t value = 0;
    for (int i = 0; i < size; ++i) value |= static_cast<std::uint64_t>(byte()) << (8 * i);
    return value;
  }
  double number() {
    const double value = std::bit_cast<double>(fixed(8));
    require(std::isfinite(value), "not a finite number (allowed: finite numbers)");
    return value;
  }
  std::uint64_t count(std::uint64_t most) {
    std::uint64_t value = 0;
    for (int shift = 0;; shift += 7) {
      require(shift < 64, "a count of more than 64 bits (allowed: at most 10 bytes)");
      const std::uint8_t next = byte();
      value |= static_cast<std::uint64_t>(next & 0x7f) << shift;
      if ((next & 0x80) == 0) break;
    }
    if (value > most) fail(fmt::format("{} is too large (allowed: at most {})", value, most));
    return value;
  }
  /// A number of things of at least `size` bytes each: no more than the file can still hold.
  std::size_t count_of(std::size_t size) { return count((bytes_.size() - at_) / size); }
  std::string text() { return std::string(take(count_of(1))); }
  std::vector<std::array<double, 2>> rows() {
    std::vector<std::array<double, 2>> all(count_of(16));
    for (auto& row : all) row = {number(), number()};
    return all;
  }
  bool done() const { return at_ == bytes_.size(); }

 private:
  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
};

std::uint64_t zigzag(std::int64_t value) {
  return (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
}
std::int64_t from_zigzag(std::uint64_t value) {
  return static_cast<std::int64_t>(value >> 1) ^ -static_cast<std::int64_t>(value & 1);
}

void write_plan(Writer& out, const std::vector<int>& modes, const std::vector<double>& continuous, bool with) {
  for (const int mode : modes) out.byte(static_cast<std::uint8_t>(mode));
  if (with)
    for (const double force : continuous) out.number(force);
}

/// Weights in runs of blocks that share a row: the run's length, the row.
void write_relaxation(Writer& out, const InstanceRecord& r, int switches) {
  const std::size_t blocks = r.warm_modes.size(), width = r.warm_weights.size() / blocks;
  const auto row = [&](std::size_t b) { return std::span(r.warm_weights).subspan(b * width, width); };
  for (std::size_t b = 0, next = 0; b < blocks; b = next) {
    for (next = b + 1; next < blocks && std::ranges::equal(row(b), row(next));) ++next;
    out.count(next - b);
    for (const double weight : row(b)) out.number(weight);
  }
  for (int c = 0; c < switches; ++c) out.number(r.warm_owed[static_cast<std::size_t>(c)]);
}

void write_record(Writer& out, const InstanceRecord& r, int switches) {
  const auto any = [](const std::vector<double>& all) {
    return std::any_of(all.begin(), all.end(), [](double v) { return std::bit_cast<std::uint64_t>(v) != 0; });
  };
  const bool offset = std::bit_cast<std::uint64_t>(r.offset_m) != 0, own = !r.reference.empty();
  const bool continuous = any(r.warm_continuous) || any(r.plan_continuous);
  out.byte(static_cast<std::uint8_t>((offset ? has_offset : 0) | (own ? has_rows : 0) |
                                     (continuous ? has_continuous : 0) | (r.load ? has_load : 0) |
                                     (r.warm_weights.empty() ? 0 : has_relaxation)));
  out.count(r.motion);
  out.count(r.start);
  if (offset) out.number(r.offset_m);
  for (const double x : r.initial) out.number(x);
  out.count(r.lines.commanded());
  for (int c = 0; c < switches; ++c) {
    const DelayLines::Line line = r.lines.line(static_cast<std::size_t>(c));
    out.count(zigzag(line.states));
    out.count(static_cast<std::uint64_t>(line.age));
  }
  write_plan(out, r.warm_modes, r.warm_continuous, continuous);
  write_plan(out, r.plan_modes, r.plan_continuous, continuous);
  out.number(r.plan_cost);
  out.byte(static_cast<std::uint8_t>(r.plan_status));
  if (own) out.rows(r.reference), out.rows(r.setpoint);
  if (r.load) out.number(r.load->payload_kg), out.number(r.load->external_force_n);
  if (!r.warm_weights.empty()) write_relaxation(out, r, switches);
}

/// What a variant's problem looks like, to check records against.
struct Shape {
  int modes = 0, switches = 0;
  std::size_t blocks = 0, steps = 0, setpoints = 0;
  int flags = has_offset | has_rows | has_continuous | has_load | has_relaxation;  ///< of records

  template <HybridModel Model>
  explicit Shape(const Problem<Model>& p)
      : modes(p.modes.size()),
        switches(p.modes.switch_count()),
        blocks(p.horizon.blocks.size()),
        steps(p.reference.size()),
        setpoints(p.setpoint.size()) {}
};

Shape shape_of(const VariantConfig& v) {
  if (v.predicts_motor()) return Shape(make_problem<PrestabilisedActuator>(v, Plane::vertical));
  return Shape(make_problem<PneumaticActuator>(v, Plane::vertical));
}

void read_plan(Reader& in, const Shape& shape, bool with, std::vector<int>& modes, std::vector<double>& continuous) {
  modes.resize(shape.blocks);
  continuous.assign(shape.blocks, 0.0);
  for (int& mode : modes) {
    mode = in.byte();
    in.require(mode < shape.modes, "a mode that the variant's valves do not have (allowed: below their number)");
  }
  if (with)
    for (double& force : continuous) force = in.number();
}

void read_lines(Reader& in, const Shape& shape, InstanceRecord& r) {
  const auto commanded = static_cast<SwitchPattern>(in.count((std::uint64_t{1} << shape.switches) - 1));
  std::array<DelayLines::Line, max_switches> lines{};
  for (int c = 0; c < shape.switches; ++c) {
    DelayLines::Line& line = lines[static_cast<std::size_t>(c)];
    line.states = from_zigzag(in.count(~std::uint64_t{0}));
    line.age = static_cast<int>(in.count(DelayLines::max_age));
  }
  r.lines = DelayLines::restored(commanded, lines);
}

void read_relaxation(Reader& in, const Shape& shape, InstanceRecord& r) {
  const auto width = static_cast<std::size_t>(shape.modes);
  while (r.warm_weights.size() < shape.blocks * width) {
    const std::size_t blocks = in.count(shape.blocks - r.warm_weights.size() / width);
    in.require(blocks > 0, "an empty run of weights (allowed: at least one block)");
    std::vector<double> row(width);
    for (double& weight : row) weight = in.number();
    for (std::size_t b = 0; b < blocks; ++b) r.warm_weights.insert(r.warm_weights.end(), row.begin(), row.end());
  }
  for (int c = 0; c < shape.switches; ++c) r.warm_owed[static_cast<std::size_t>(c)] = in.number();
}

InstanceRecord read_record(Reader& in, const Shape& shape, const std::vector<RecordedMotion>& motions) {
  InstanceRecord r;
  const std::uint8_t flags = in.byte();
  in.require((flags & ~shape.flags) == 0,
             "an unknown kind of record (allowed: flags 1, 2, 4, from version 2 on 8, from 3 on 16)");
  r.motion = static_cast<std::uint32_t>(in.count(motions.size() - 1));
  r.start = static_cast<std::uint32_t>(in.count(0xffffffffu));
  if (flags & has_offset) r.offset_m = in.number();
  for (double& x : r.initial) x = in.number();
  read_lines(in, shape, r);
  read_plan(in, shape, (flags & has_continuous) != 0, r.warm_modes, r.warm_continuous);
  read_plan(in, shape, (flags & has_continuous) != 0, r.plan_modes, r.plan_continuous);
  r.plan_cost = in.number();
  const std::uint8_t status = in.byte();
  in.require(usable(static_cast<Status>(status)) && status <= static_cast<std::uint8_t>(Status::iteration_limit),
             "a status without a plan (allowed: 0 to 3)");
  r.plan_status = static_cast<Status>(status);
  if (flags & has_rows) {
    r.reference = in.rows();
    r.setpoint = in.rows();
    in.require(r.reference.size() == shape.steps && r.setpoint.size() == shape.setpoints,
               "rows that are not the horizon's (allowed: one a step)");
  } else {
    in.require(r.start >= 1 && r.start + shape.steps <= motions[r.motion].rows.size(),
               "a window outside its motion's rows (allowed: start >= 1, start + steps <= rows)");
  }
  if (flags & has_load) r.load = {in.number(), in.number()};
  if (flags & has_relaxation) read_relaxation(in, shape, r);
  return r;
}

VariantInstances read_variant_instances(Reader& in, const std::string& name, std::uint32_t version,
                                        const InstanceSet& set) {
  VariantInstances v;
  v.name = in.text();
  v.toml = in.text();
  for (const VariantInstances& other : set.variants)
    in.require(other.name != v.name, "a variant twice (allowed: each once)");
  TableReader table = TableReader::from_text(v.toml, fmt::format("{}: variant {}", name, v.name));
  v.config = read_variant(table, v.name);
  Shape shape = shape_of(v.config);
  if (version < 2) shape.flags &= ~has_load;
  if (version < 3) shape.flags &= ~has_relaxation;
  const std::size_t records = in.count_of(44);
  in.require(records == 0 || !set.motions.empty(), "records without motions (allowed: at least one)");
  v.records.reserve(records);
  for (std::size_t i = 0; i < records; ++i) v.records.push_back(read_record(in, shape, set.motions));
  return v;
}

RecordedMotion read_motion(Reader& in) {
  RecordedMotion s;
  s.name = in.text();
  const std::uint8_t plane = in.byte();
  in.require(plane <= 1, "an unknown plane (allowed: 0 vertical, 1 horizontal)");
  s.plane = plane == 0 ? Plane::vertical : Plane::horizontal;
  s.rows = in.rows();
  return s;
}

/// The part between version and checksum, once both have been looked at.
std::string_view body_of(std::string_view bytes, const std::string& name, std::uint32_t& version) {
  const std::size_t head = magic.size() + 4;
  if (!bytes.starts_with(magic))
    throw ConfigError(fmt::format("{}: byte 0: no instance file (allowed: a file that begins with SOLINST)", name));
  Reader in(bytes, name);
  in.take(magic.size());
  version = static_cast<std::uint32_t>(in.fixed(4));
  if (version < 1 || version > instance_format_version)
    in.fail(fmt::format("an instance file of version {} (allowed: 1 to {})", version, instance_format_version));
  in.require(bytes.size() >= head + checksum_size, "the file ends too early (allowed: a whole instance file)");
  Reader tail(bytes.substr(bytes.size() - checksum_size), name);
  if (tail.fixed(checksum_size) != fnv1a(bytes.substr(0, bytes.size() - checksum_size)))
    in.fail("damaged or cut short: the checksum does not match (allowed: a whole instance file)");
  return bytes.substr(head, bytes.size() - head - checksum_size);
}

}  // namespace

std::string instance_bytes(const InstanceSet& set) {
  Writer out;
  out.bytes_ = magic;
  out.fixed(instance_format_version, 4);
  out.count(set.motions.size());
  for (const RecordedMotion& s : set.motions) {
    out.text(s.name);
    out.byte(s.plane == Plane::vertical ? 0 : 1);
    out.rows(s.rows);
  }
  out.count(set.variants.size());
  for (const VariantInstances& v : set.variants) {
    out.text(v.name);
    out.text(v.toml);
    out.count(v.records.size());
    const int switches = shape_of(v.config).switches;
    for (const InstanceRecord& r : v.records) write_record(out, r, switches);
  }
  out.fixed(fnv1a(out.bytes_), checksum_size);
  return std::move(out.bytes_);
}

InstanceSet parse_instances(std::string_view bytes, const std::string& name) {
  std::uint32_t version = 0;
  Reader in(body_of(bytes, name, version), name);
  InstanceSet set;
  for (std::size_t left = in.count_of(3); left > 0; --left) set.motions.push_back(read_motion(in));
  for (std::size_t left = in.count_of(3); left > 0; --left)
    set.variants.push_back(read_variant_instances(in, name, version, set));
  in.require(in.done(), "more bytes than the set has (allowed: nothing behind the last record)");
  return set;
}

InstanceSet read_instances(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (!file.is_open() || file.bad())
    throw ConfigError(fmt::format("{}: cannot be read (allowed: a readable instance file)", path));
  return parse_instances(bytes, path);
}

}  // namespace solenoid
