#include "controllers/instances/instance_set.hpp"
#include "core/config/reader.hpp"
#include "core/config/whole_file.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <new>
#include <span>

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

// A file's structures are described once, for both directions: Writer and Reader have the same functions, and what a
// Reader requires of a file, a Writer takes for granted.

/// Appends numbers to a string, lowest byte first.
class Writer {
 public:
  static constexpr bool reading = false;
  void require(bool, const char*) const {}
  template <class T>
  void byte(T value) {
    bytes_ += static_cast<char>(value);
  }
  void fixed(std::uint64_t value, int size) {
    for (int i = 0; i < size; ++i) byte(value >> (8 * i));
  }
  void number(double value) { fixed(std::bit_cast<std::uint64_t>(value), 8); }
  /// Seven bits a byte, lowest first; the highest bit of a byte says that another follows.
  void count(std::uint64_t value, std::uint64_t /*most*/) {
    for (; value >= 0x80; value >>= 7) byte(value | 0x80);
    byte(value);
  }
  template <class T, class Each>
  void list(const T& all, std::size_t /*size*/, Each each) {
    count(all.size(), 0);
    for (const auto& item : all) each(item);
  }
  std::string bytes_;
};

/// Reads what Writer wrote; every refusal names file and byte.
class Reader {
 public:
  static constexpr bool reading = true;
  Reader(std::string_view bytes, const std::string& name, std::size_t at) : bytes_(bytes), name_(name), at_(at) {}

  const std::string& name() const { return name_; }
  std::size_t left() const { return bytes_.size() - at_; }
  bool done() const { return at_ == bytes_.size(); }
  [[noreturn]] void fail(const std::string& problem) const {
    throw ConfigError(fmt::format("{}: byte {}: {}", name_, at_, problem));
  }
  void require(bool condition, const char* problem) const {
    if (!condition) fail(problem);
  }
  template <class T>
  void byte(T& value) {
    value = static_cast<T>(next());
  }
  std::uint64_t fixed(int size) {
    std::uint64_t value = 0;
    for (int i = 0; i < size; ++i) value |= static_cast<std::uint64_t>(next()) << (8 * i);
    return value;
  }
  void number(double& value) {
    value = std::bit_cast<double>(fixed(8));
    require(std::isfinite(value), "not a finite number (allowed: finite numbers)");
  }
  template <class T>
  void count(T& value, std::uint64_t most) {
    std::uint64_t all = 0;
    for (int shift = 0;; shift += 7) {
      require(shift < 64, "a count of more than 64 bits (allowed: at most 10 bytes)");
      const std::uint8_t seven = next();
      all |= static_cast<std::uint64_t>(seven & 0x7f) << shift;
      if ((seven & 0x80) == 0) break;
    }
    if (all > most) fail(fmt::format("{} is too large (allowed: at most {})", all, most));
    value = static_cast<T>(all);
  }
  /// Things of at least `size` bytes each: no more than the file can still hold.
  template <class T, class Each>
  void list(T& all, std::size_t size, Each each) {
    std::size_t left = 0;
    for (count(left, (bytes_.size() - at_) / size); left > 0; --left) {
      all.push_back({});
      each(all.back());
    }
  }

 private:
  std::uint8_t next() {
    require(at_ < bytes_.size(), "the file ends too early (allowed: a whole instance file)");
    return static_cast<std::uint8_t>(bytes_[at_++]);
  }

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_;
};

template <class File, class Text>
void text(File& file, Text& text) {
  file.list(text, 1, [&](auto& c) { file.byte(c); });
}

template <class File, class Numbers>
void numbers(File& file, Numbers& all) {
  for (auto& number : all) file.number(number);
}

/// Rows of `width` numbers, after how many there are.
template <class File, class Rows>
void rows(File& file, std::size_t width, Rows& all) {
  std::size_t count = all.size() / width;
  file.count(count, ~std::uint32_t{0});
  if constexpr (File::reading) {
    file.require(count <= file.left() / (8 * width), "more rows than the file holds (allowed: a whole instance file)");
    all.resize(count * width);
  }
  numbers(file, all);
}

/// What a variant's problem looks like, to check records against.
struct Shape {
  int modes = 0, switches = 0;
  bool windowed = false;  // lines remember changes
  std::size_t blocks = 0, steps = 0, setpoints = 0, states = 0, outputs = 0, inputs = 0, load = 0;

  explicit Shape(const AnyProblem& p)
      : modes(p.modes.size()),
        switches(p.modes.switch_count()),
        windowed(SwitchTiming(p.modes, p.horizon.dt_s).windowed != 0),
        blocks(p.horizon.blocks.size()),
        states(p.sizes().states),
        outputs(p.sizes().outputs),
        inputs(p.sizes().inputs),
        load(p.sizes().load) {
    steps = p.reference_values().size() / outputs;
    setpoints = p.setpoint_values().size() / outputs;
  }
};

Shape shape_of(const VariantConfig& v) { return Shape(*system_of(v).problem(v)); }

template <class File, class Modes, class Continuous>
void plan(File& file, const Shape& shape, bool with_continuous, Modes& modes, Continuous& continuous) {
  if constexpr (File::reading) {
    modes.resize(shape.blocks);
    continuous.assign(shape.blocks * shape.inputs, 0.0);
  }
  for (auto& mode : modes) {
    auto number = static_cast<std::uint32_t>(mode);
    file.count(number, ~std::uint32_t{0});
    file.require(number < static_cast<std::uint32_t>(shape.modes),
                 "a mode that the variant's set does not have (allowed: below their number)");
    if constexpr (File::reading) mode = static_cast<int>(number);
  }
  if (with_continuous) numbers(file, continuous);
}

/// A number of either sign as a count: small ones stay small.
std::uint64_t zigzag(std::int64_t value) {
  return (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63);
}
std::int64_t from_zigzag(std::uint64_t value) {
  return static_cast<std::int64_t>(value >> 1) ^ -static_cast<std::int64_t>(value & 1);
}

template <class File, class Lines>
void delay_lines(File& file, const Shape& shape, Lines& lines) {
  SwitchPattern commanded = lines.commanded();
  file.count(commanded, (std::uint64_t{1} << shape.switches) - 1);
  std::array<DelayLines::Line, max_switches> all{};
  for (std::size_t c = 0; c < static_cast<std::size_t>(shape.switches); ++c) {
    all[c] = lines.line(c);
    std::uint64_t states = zigzag(all[c].states);
    file.count(states, ~std::uint64_t{0});
    all[c].states = from_zigzag(states);
    file.count(all[c].age, DelayLines::max_age);
  }
  std::vector<DelayLines::Change> changes;
  if (shape.windowed) {
    if constexpr (!File::reading)
      for (std::size_t i = 0; i < lines.changes(); ++i) changes.push_back(lines.change(i));
    file.list(changes, 2, [&](auto& change) {
      file.count(change.c, static_cast<std::uint64_t>(shape.switches) - 1);
      file.count(change.age, DelayLines::max_age);
    });
    file.require(changes.size() <= max_window_changes, "more changes than windows count (allowed: 64)");
  }
  if constexpr (File::reading) lines = DelayLines::restored(commanded, all, changes);
}

/// Weights in runs of blocks that share a row: the run's length, the row. Then what each switch owes.
template <class File, class Record>
void relaxation(File& file, const Shape& shape, Record& r) {
  const auto width = static_cast<std::size_t>(shape.modes);
  if constexpr (File::reading) r.warm_weights.resize(shape.blocks * width);
  const auto row = [&](std::size_t b) { return std::span(r.warm_weights).subspan(b * width, width); };
  for (std::size_t b = 0, run = 0; b < shape.blocks; b += run) {
    if constexpr (!File::reading)
      for (run = 1; b + run < shape.blocks && std::ranges::equal(row(b), row(b + run));) ++run;
    file.count(run, shape.blocks - b);
    file.require(run > 0, "an empty run of weights (allowed: at least one block)");
    for (auto& weight : row(b)) file.number(weight);
    if constexpr (File::reading)
      for (std::size_t i = 1; i < run; ++i) std::ranges::copy(row(b), row(b + i).begin());
  }
  for (std::size_t c = 0; c < static_cast<std::size_t>(shape.switches); ++c) file.number(r.warm_owed[c]);
}

/// What of a record is not as in an empty one.
std::uint8_t flags_of(const InstanceRecord& r) {
  const auto is_zero = [](double v) { return std::bit_cast<std::uint64_t>(v) == 0; };
  const bool continuous =
      !std::ranges::all_of(r.warm_continuous, is_zero) || !std::ranges::all_of(r.plan_continuous, is_zero);
  const bool offset = !std::ranges::all_of(r.offset, is_zero);
  return static_cast<std::uint8_t>((offset ? has_offset : 0) | (r.reference.empty() ? 0 : has_rows) |
                                   (continuous ? has_continuous : 0) | (r.load.empty() ? 0 : has_load) |
                                   (r.warm_weights.empty() ? 0 : has_relaxation));
}

/// `known`: flags of the file's version.
template <class File, class Record>
void record(File& file, std::uint32_t version, const Shape& shape, int known,
            const std::vector<RecordedMotion>& motions, Record& r) {
  file.require(!motions.empty(), "records without motions (allowed: at least one)");
  std::uint8_t flags = flags_of(r);
  file.byte(flags);
  file.require((flags & ~known) == 0,
               "an unknown kind of record (allowed: flags 1, 2, 4, from version 2 on 8, from 3 on 16)");
  file.count(r.motion, motions.size() - 1);
  file.count(r.start, 0xffffffffu);
  if (flags & has_offset)
    for (std::size_t i = 0; i < (version < 4 ? 1 : shape.outputs); ++i) file.number(r.offset[i]);
  for (std::size_t i = 0; i < shape.states; ++i) file.number(r.initial[i]);
  delay_lines(file, shape, r.lines);
  plan(file, shape, (flags & has_continuous) != 0, r.warm_modes, r.warm_continuous);
  plan(file, shape, (flags & has_continuous) != 0, r.plan_modes, r.plan_continuous);
  file.number(r.plan_cost);
  file.byte(r.plan_status);
  file.require(usable(r.plan_status) && r.plan_status <= Status::iteration_limit,
               "a status without a plan (allowed: 0 to 3)");
  if (flags & has_rows) {
    rows(file, shape.outputs, r.reference);
    rows(file, shape.outputs, r.setpoint);
    file.require(
        r.reference.size() == shape.outputs * shape.steps && r.setpoint.size() == shape.outputs * shape.setpoints,
        "rows that are not the horizon's (allowed: one a step)");
  } else {
    file.require(r.start >= 1 && r.start + shape.steps <= motions[r.motion].size(),
                 "a window outside its motion's rows (allowed: start >= 1, start + steps <= rows)");
  }
  if constexpr (File::reading)
    if (flags & has_load) r.load.resize(shape.load);
  if (flags & has_load) numbers(file, r.load);
  if (flags & has_relaxation) relaxation(file, shape, r);
}

/// Before version 4 there was one system, whose motions had one of two planes and two outputs.
constexpr std::array old_settings = {"vertical", "horizontal"};

template <class File, class Motion>
void motion(File& file, std::uint32_t version, Motion& m) {
  text(file, m.name);
  if (version < 4) {
    if constexpr (File::reading) {
      std::uint8_t plane = 0;
      file.byte(plane);
      file.require(plane < old_settings.size(), "an unknown plane (allowed: 0 vertical, 1 horizontal)");
      m.setting = old_settings[plane];
    }
  } else {
    text(file, m.setting);
    file.count(m.width, max_states);
    file.require(m.width > 0, "a motion of no outputs (allowed: at least one)");
  }
  rows(file, m.width, m.rows);
}

/// The variant that its table describes.
void read_config(const Reader& in, const InstanceSet& set, VariantInstances& v) {
  in.require(std::ranges::count(set.variants, v.name, &VariantInstances::name) == 1,
             "a variant twice (allowed: each once)");
  TableReader table = TableReader::from_text(v.toml, fmt::format("{}: variant {}", in.name(), v.name));
  v.config = read_variant(table, v.name);
}

/// What motions tell a controller must be something that its system is told.
void require_tasks(const Reader& in, const InstanceSet& set, const VariantConfig& variant) {
  try {
    for (const RecordedMotion& m : set.motions) told(variant, m);
  } catch (const ConfigError& error) {
    in.fail(error.what());
  }
}

/// Everything between version and checksum.
template <class File, class Set>
void body(File& file, std::uint32_t version, Set& set) {
  const int known =
      has_offset | has_rows | has_continuous | (version >= 2 ? has_load : 0) | (version >= 3 ? has_relaxation : 0);
  file.list(set.motions, 3, [&](auto& m) { motion(file, version, m); });
  file.list(set.variants, 3, [&](auto& v) {
    text(file, v.name);
    text(file, v.toml);
    if constexpr (File::reading) read_config(file, set, v);
    if constexpr (File::reading) require_tasks(file, set, v.config);
    const Shape shape = shape_of(v.config);
    for (const RecordedMotion& m : set.motions)
      file.require(m.width == shape.outputs, "motions of other outputs than the variant's (allowed: one system a set)");
    file.list(v.records, 20, [&](auto& r) { record(file, version, shape, known, set.motions, r); });
  });
}

/// A reader of what is behind the version, once that and the checksum have been looked at.
Reader opened(std::string_view bytes, const std::string& name, std::uint32_t& version) {
  if (!bytes.starts_with(magic))
    throw ConfigError(fmt::format("{}: byte 0: no instance file (allowed: a file that begins with SOLINST)", name));
  const std::size_t end = std::max(magic.size() + 4, bytes.size() - checksum_size);
  Reader in(bytes.substr(0, end), name, magic.size());
  version = static_cast<std::uint32_t>(in.fixed(4));
  if (version < 1 || version > instance_format_version)
    in.fail(fmt::format("an instance file of version {} (allowed: 1 to {})", version, instance_format_version));
  if (Reader(bytes, name, end).fixed(checksum_size) != fnv1a(bytes.substr(0, end)))
    in.fail("damaged or cut short: the checksum does not match (allowed: a whole instance file)");
  return in;
}

}  // namespace

std::string instance_bytes(const InstanceSet& set) {
  Writer out;
  out.bytes_ = magic;
  out.fixed(instance_format_version, 4);
  body(out, instance_format_version, set);
  out.fixed(fnv1a(out.bytes_), checksum_size);
  return std::move(out.bytes_);
}

InstanceSet parse_instances(std::string_view bytes, const std::string& name) {
  std::uint32_t version = 0;
  Reader in = opened(bytes, name, version);
  try {
    InstanceSet set;
    body(in, version, set);
    in.require(in.done(), "more bytes than the set has (allowed: nothing behind the last record)");
    return set;
  } catch (const std::bad_alloc&) {
    in.fail("does not fit into memory (allowed: fewer records)");
  }
}

VariantConfig told(VariantConfig variant, const RecordedMotion& motion) {
  system_of(variant).tell(variant, motion.setting);
  return variant;
}

InstanceSet read_instances(const std::string& path) {
  const auto bytes = read_whole_file(path, file_size::instances);
  if (!bytes) throw ConfigError(fmt::format("{}: cannot be read (allowed: a readable instance file)", path));
  return parse_instances(*bytes, path);
}

}  // namespace solenoid
