#include "experiments/python/instance_arrays.hpp"

#include "core/config/reader.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

using Size = py::ssize_t;
using ShapeOf = std::vector<Size>;

constexpr double none = std::numeric_limits<double>::quiet_NaN();  // a number of a record that does not have it

Size whole(std::size_t size) { return static_cast<Size>(size); }

template <class Signals>
std::vector<std::string> names_in(const Signals& signals) {
  std::vector<std::string> names(signals.size());
  std::ranges::transform(signals, names.begin(), [](const auto& signal) { return signal.name; });
  return names;
}

/// The desired outputs that a record's prediction meets: row k of `width` numbers, its own or its motion's.
double reference_at(const InstanceRecord& r, const RecordedMotion& motion, std::size_t i) {
  const std::size_t width = motion.width;
  return r.reference.empty() ? motion.row(r.start + i / width)[i % width] + r.offset[i % width] : r.reference[i];
}
double setpoint_at(const InstanceRecord& r, const RecordedMotion& motion, std::size_t i) {
  const std::size_t width = motion.width;
  return r.reference.empty() ? motion.row(r.start - 1 + i / width)[i % width] : r.setpoint[i];
}

/// Each record's numbers below one another: shape (records, ...), `of(record, i)` the i-th of a record.
template <class T, class Of>
py::array_t<T> stacked(const std::vector<InstanceRecord>& records, const ShapeOf& each, Of of) {
  ShapeOf shape = {whole(records.size())};
  shape.insert(shape.end(), each.begin(), each.end());
  std::size_t width = 1;
  for (const Size size : each) width *= static_cast<std::size_t>(size);
  return filled<T>(shape, [&](std::size_t i) { return of(records[i / width], i % width); });
}

/// Arrays have no room for the moments of changes that windows count.
void require_no_windows(const VariantInstances& v) {
  if (v.config.limits.most_changes > 0)
    throw ConfigError(
        fmt::format("variant '{}': instances with limits.most_changes are not arrays (allowed: without)", v.name));
}

py::dict arrays_of(const InstanceSet& set, const VariantInstances& v) {
  require_no_windows(v);
  const Layout at(v.config);
  const Size blocks = whole(at.blocks.size()), switches = whole(at.switches.size()), modes = whole(at.modes.size()),
             steps = whole(at.steps), setpoints = whole(at.setpoints), states = whole(at.sizes.states),
             outputs = whole(at.sizes.outputs), inputs = whole(at.sizes.inputs), load = whole(at.sizes.load);
  const auto numbers = [&](const ShapeOf& each, auto of) { return stacked<double>(v.records, each, of); };
  const auto integers = [&](const ShapeOf& each, auto of) { return stacked<std::int64_t>(v.records, each, of); };
  using R = InstanceRecord;
  const SystemDescription& system = at.system->description();
  py::dict a;
  a["name"] = v.name;
  a["toml"] = v.toml;
  a["system"] = system.name;
  a["tick_s"] = at.tick_s;
  a["blocks"] = filled<std::int64_t>({blocks}, [&](std::size_t i) { return at.blocks[i]; });
  a["state_names"] = names_in(system.states);
  a["output_names"] = names_in(system.outputs);
  a["mode_names"] = at.modes;
  a["switch_names"] = at.switches;
  a["motion"] = integers({}, [](const R& r, std::size_t) { return r.motion; });
  a["start"] = integers({}, [](const R& r, std::size_t) { return r.start; });
  a["offsets"] = numbers({outputs}, [](const R& r, std::size_t i) { return r.offset[i]; });
  a["own_rows"] = stacked<bool>(v.records, {}, [](const R& r, std::size_t) { return !r.reference.empty(); });
  a["states"] = numbers({states}, [](const R& r, std::size_t i) { return r.initial[i]; });
  a["references"] =
      numbers({steps, outputs}, [&](const R& r, std::size_t i) { return reference_at(r, set.motions[r.motion], i); });
  a["setpoints"] = numbers({setpoints, outputs},
                           [&](const R& r, std::size_t i) { return setpoint_at(r, set.motions[r.motion], i); });
  a["loads"] = numbers({load}, [](const R& r, std::size_t i) { return r.load.empty() ? none : r.load[i]; });
  a["commanded"] = integers({}, [](const R& r, std::size_t) { return r.lines.commanded(); });
  a["lines"] = integers({switches}, [](const R& r, std::size_t c) { return r.lines.line(c).states; });
  a["ages"] = integers({switches}, [](const R& r, std::size_t c) { return r.lines.line(c).age; });
  a["warm_modes"] = integers({blocks}, [](const R& r, std::size_t b) { return r.warm_modes[b]; });
  a["warm_inputs"] = numbers({blocks, inputs}, [](const R& r, std::size_t i) { return r.warm_continuous[i]; });
  a["warm_weights"] = numbers(
      {blocks, modes}, [](const R& r, std::size_t i) { return r.warm_weights.empty() ? none : r.warm_weights[i]; });
  a["warm_owed"] = numbers({switches}, [](const R& r, std::size_t c) { return r.warm_owed[c]; });
  a["plan_modes"] = integers({blocks}, [](const R& r, std::size_t b) { return r.plan_modes[b]; });
  a["plan_inputs"] = numbers({blocks, inputs}, [](const R& r, std::size_t i) { return r.plan_continuous[i]; });
  a["plan_costs"] = numbers({}, [](const R& r, std::size_t) { return r.plan_cost; });
  py::list statuses;
  for (const R& r : v.records) statuses.append(to_string(r.plan_status));
  a["plan_statuses"] = statuses;
  return a;
}

/// The arrays of a variant, checked one by one: every refusal names the variant, the array and what is allowed.
class Arrays {
 public:
  Arrays(const py::dict& arrays, std::string name, std::size_t records)
      : arrays_(arrays), name_(std::move(name)), records_(records) {}

  [[noreturn]] void fail(const char* key, const std::string& problem) const {
    throw ConfigError(fmt::format("instances of '{}': {}: {}", name_, key, problem));
  }

  /// Finite numbers of shape (records, ...); `maybe`: a record may have NaN throughout, for none.
  std::vector<double> numbers(const char* key, ShapeOf each, bool maybe = false) const {
    const auto array = checked<double>(key, std::move(each), "iuf", "numbers");
    std::vector<double> values(array.data(), array.data() + array.size());
    const std::size_t width = records_ == 0 ? 0 : values.size() / records_;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::isfinite(values[i])) continue;
      const std::size_t r = i / width;
      const auto first = values.begin() + static_cast<std::ptrdiff_t>(r * width);
      if (maybe &&
          std::all_of(first, first + static_cast<std::ptrdiff_t>(width), [](double v) { return std::isnan(v); }))
        continue;
      fail(key, fmt::format("{} in instance {} (allowed: finite numbers{})", values[i], r,
                            maybe ? ", or NaN throughout" : ""));
    }
    return values;
  }
  /// Whole numbers from `low` to `high`.
  std::vector<std::int64_t> integers(const char* key, ShapeOf each, std::int64_t low, std::int64_t high) const {
    const auto array = checked<std::int64_t>(key, std::move(each), "iu", "whole numbers");
    std::vector<std::int64_t> values(array.data(), array.data() + array.size());
    for (std::size_t i = 0; i < values.size(); ++i)
      if (values[i] < low || values[i] > high)
        fail(key, fmt::format("{} in instance {} (allowed: {} to {})", values[i], i / (values.size() / records_), low,
                              high));
    return values;
  }
  std::vector<bool> flags(const char* key) const {
    const auto array = checked<bool>(key, {}, "b", "truth values");
    return std::vector<bool>(array.data(), array.data() + array.size());
  }
  std::vector<Status> statuses(const char* key) const {
    std::vector<Status> all;
    std::vector<std::string_view> known;
    for (int s = 0; s <= static_cast<int>(Status::iteration_limit); ++s)
      known.push_back(to_string(static_cast<Status>(s)));
    const py::list texts(arrays_[key]);
    if (texts.size() != records_) fail(key, fmt::format("{} of them (allowed: {})", texts.size(), records_));
    for (const auto& text : texts) {
      const auto name = text.cast<std::string>();
      const auto found = std::ranges::find(known, std::string_view(name));
      if (found == known.end()) fail(key, fmt::format("'{}' (allowed: {})", name, fmt::join(known, ", ")));
      all.push_back(static_cast<Status>(found - known.begin()));
    }
    return all;
  }

 private:
  template <class T>
  py::array_t<T, py::array::c_style | py::array::forcecast> checked(const char* key, ShapeOf each,
                                                                    std::string_view kinds, const char* what) const {
    const py::array given = py::module_::import("numpy").attr("asarray")(arrays_[key]);
    each.insert(each.begin(), whole(records_));
    const ShapeOf shape(given.shape(), given.shape() + given.ndim());
    const auto written = [](const ShapeOf& s) {
      return fmt::format("({}{})", fmt::join(s, ", "), s.size() == 1 ? "," : "");
    };
    if (shape != each) fail(key, fmt::format("shape {} (allowed: {})", written(shape), written(each)));
    if (kinds.find(given.dtype().kind()) == std::string_view::npos && given.size() > 0)
      fail(key, fmt::format("{} (allowed: {})", py::str(given.dtype()).cast<std::string>(), what));
    return given;
  }

  const py::dict& arrays_;
  std::string name_;
  std::size_t records_;
};

/// The i-th of rows of `width` numbers.
template <class T>
std::vector<T> row(const std::vector<T>& all, std::size_t i, std::size_t width) {
  const auto first = all.begin() + static_cast<std::ptrdiff_t>(i * width);
  return {first, first + static_cast<std::ptrdiff_t>(width)};
}

/// The same of numbers that a record may lack.
std::vector<double> row_or_none(const std::vector<double>& all, std::size_t i, std::size_t width) {
  std::vector<double> found = row(all, i, width);
  if (!found.empty() && std::isnan(found.front())) found.clear();
  return found;
}

}  // namespace

py::dict dictionary_of(const InstanceSet& set) {
  py::list motions, variants;
  for (const RecordedMotion& m : set.motions) {
    py::dict motion;
    motion["name"] = m.name;
    motion["setting"] = m.setting;
    motion["rows"] = filled<double>({whole(m.size()), whole(m.width)}, [&](std::size_t i) { return m.rows[i]; });
    motions.append(motion);
  }
  for (const VariantInstances& v : set.variants) variants.append(arrays_of(set, v));
  py::dict all;
  all["motions"] = motions;
  all["variants"] = variants;
  return all;
}

bool is_window(const InstanceRecord& r, const RecordedMotion& motion) {
  InstanceRecord window = r;
  window.reference.clear();
  const std::size_t rows = r.reference.size() / motion.width, setpoints = r.setpoint.size() / motion.width;
  if (r.start < 1 || r.start + std::max(rows, setpoints) > motion.size()) return false;
  for (std::size_t i = 0; i < r.reference.size(); ++i)
    if (r.reference[i] != reference_at(window, motion, i)) return false;
  for (std::size_t i = 0; i < r.setpoint.size(); ++i)
    if (r.setpoint[i] != setpoint_at(window, motion, i)) return false;
  return true;
}

std::vector<InstanceRecord> records_of(const py::dict& from, const std::vector<RecordedMotion>& motions,
                                       const VariantInstances& v, bool windows) {
  require_no_windows(v);
  const Layout at(v.config);
  const py::array states_array = py::module_::import("numpy").attr("asarray")(from["states"]);
  const std::size_t n = states_array.ndim() > 0 ? static_cast<std::size_t>(states_array.shape(0)) : 0;
  const Arrays arrays(from, v.name, n);
  const ModelSizes& size = at.sizes;
  const std::size_t blocks = at.blocks.size(), switches = at.switches.size(), modes = at.modes.size();
  const Size b = whole(blocks), c = whole(switches);
  const auto last = [](std::size_t count) { return static_cast<std::int64_t>(count) - 1; };
  const auto motion = arrays.integers("motion", {}, 0, last(motions.size()));
  for (const std::int64_t m : motion)
    if (const RecordedMotion& of = motions[static_cast<std::size_t>(m)]; of.width != size.outputs)
      arrays.fail("motion", fmt::format("'{}' has rows of {} numbers (allowed: {})", of.name, of.width, size.outputs));
  const auto start = arrays.integers("start", {}, 0, std::numeric_limits<std::uint32_t>::max());
  const auto offsets = arrays.numbers("offsets", {whole(size.outputs)});
  const auto own_rows = arrays.flags("own_rows");
  const auto states = arrays.numbers("states", {whole(size.states)});
  const auto references = arrays.numbers("references", {whole(at.steps), whole(size.outputs)});
  const auto setpoints = arrays.numbers("setpoints", {whole(at.setpoints), whole(size.outputs)});
  const auto loads = arrays.numbers("loads", {whole(size.load)}, true);
  const auto commanded = arrays.integers("commanded", {}, 0, (std::int64_t{1} << switches) - 1);
  const auto lines =
      arrays.integers("lines", {c}, std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max());
  const auto ages = arrays.integers("ages", {c}, 0, DelayLines::max_age);
  const auto warm_modes = arrays.integers("warm_modes", {b}, 0, last(modes));
  const auto warm_inputs = arrays.numbers("warm_inputs", {b, whole(size.inputs)});
  const auto weights = arrays.numbers("warm_weights", {b, whole(modes)}, true);
  const auto owed = arrays.numbers("warm_owed", {c});
  const auto plan_modes = arrays.integers("plan_modes", {b}, 0, last(modes));
  const auto plan_inputs = arrays.numbers("plan_inputs", {b, whole(size.inputs)});
  const auto costs = arrays.numbers("plan_costs", {});
  const auto statuses = arrays.statuses("plan_statuses");
  std::vector<InstanceRecord> records(n);
  for (std::size_t i = 0; i < n; ++i) {
    InstanceRecord& r = records[i];
    r.motion = static_cast<std::uint32_t>(motion[i]);
    r.start = static_cast<std::uint32_t>(start[i]);
    std::ranges::copy(row(offsets, i, size.outputs), r.offset.begin());
    std::ranges::copy(row(states, i, size.states), r.initial.begin());
    r.reference = row(references, i, at.steps * size.outputs);
    r.setpoint = row(setpoints, i, at.setpoints * size.outputs);
    r.load = row_or_none(loads, i, size.load);
    std::vector<DelayLines::Line> all(switches);
    for (std::size_t s = 0; s < switches; ++s)
      all[s] = {lines[i * switches + s], static_cast<int>(ages[i * switches + s])};
    r.lines = DelayLines::restored(static_cast<SwitchPattern>(commanded[i]), all);
    for (const std::int64_t mode : row(warm_modes, i, blocks)) r.warm_modes.push_back(static_cast<int>(mode));
    r.warm_continuous = row(warm_inputs, i, blocks * size.inputs);
    r.warm_weights = row_or_none(weights, i, blocks * modes);
    std::ranges::copy(row(owed, i, switches), r.warm_owed.begin());
    for (const std::int64_t mode : row(plan_modes, i, blocks)) r.plan_modes.push_back(static_cast<int>(mode));
    r.plan_continuous = row(plan_inputs, i, blocks * size.inputs);
    r.plan_cost = costs[i];
    r.plan_status = statuses[i];
    if (windows && !own_rows[i] && is_window(r, motions[r.motion])) r.reference.clear(), r.setpoint.clear();
  }
  return records;
}

std::vector<RecordedMotion> motions_of(const py::list& from) {
  std::vector<RecordedMotion> motions;
  for (const auto& one : from) {
    const auto motion = one.cast<py::dict>();
    const auto rows = motion["rows"].cast<py::array_t<double, py::array::c_style | py::array::forcecast>>();
    const auto name = motion["name"].cast<std::string>();
    if (rows.ndim() != 2)
      throw ConfigError(fmt::format("motion '{}': rows (allowed: a matrix, steps x outputs)", name));
    motions.push_back({name,
                       motion["setting"].cast<std::string>(),
                       static_cast<std::size_t>(rows.shape(1)),
                       {rows.data(), rows.data() + rows.size()}});
  }
  return motions;
}

VariantInstances variant_of(const py::dict& from) {
  VariantInstances v;
  v.name = from["name"].cast<std::string>();
  v.toml = from["toml"].cast<std::string>();
  TableReader table = TableReader::from_text(v.toml, "variant " + v.name);
  v.config = read_variant(table, v.name);
  return v;
}

InstanceSet set_of(const py::dict& from) {
  InstanceSet set;
  set.motions = motions_of(from["motions"]);
  for (const auto& one : from["variants"].cast<py::list>()) {
    const auto arrays = one.cast<py::dict>();
    VariantInstances v = variant_of(arrays);
    v.records = records_of(arrays, set.motions, v, true);
    set.variants.push_back(std::move(v));
  }
  return set;
}

}  // namespace solenoid
