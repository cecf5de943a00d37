#include "solvers/learned/mlp.hpp"

#include "core/config/reader.hpp"
#include "core/config/whole_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <xsimd/xsimd.hpp>

namespace solenoid {
namespace {

using Register = xsimd::batch<float>;
constexpr int lanes_of_register = static_cast<int>(Register::size);
constexpr int panel = 16;                             // outputs whose sums run together
constexpr int registers = panel / lanes_of_register;  // of a panel
static_assert(panel % lanes_of_register == 0);
constexpr int padded_width = mlp_limits::width + panel;

[[noreturn]] void refuse(const std::string& what) { throw std::invalid_argument("perceptron: " + what); }

void require_within(const char* what, std::size_t value, int least, int most) {
  if (value < static_cast<std::size_t>(least) || value > static_cast<std::size_t>(most))
    refuse(fmt::format("{} {} (allowed: {} to {})", value, what, least, most));
}

void require_finite(const char* what, const std::vector<float>& values) {
  if (!std::ranges::all_of(values, [](float v) { return std::isfinite(v); }))
    refuse(fmt::format("{} that are not finite (allowed: numbers)", what));
}

void check_input(const MlpInput& in, int features) {
  if (in.column < 0 || in.column >= features) refuse(fmt::format("an input of feature {}, of {}", in.column, features));
  if (!(in.knee >= 0.0f) || !std::isfinite(in.knee) || !std::isfinite(in.mean) || !std::isfinite(in.scale))
    refuse("an input that is scaled by no number (allowed: knees of at least 0, finite means and scales)");
}

void check(const MlpData& d) {
  require_within("features", static_cast<std::size_t>(std::max(0, d.features)), 1, mlp_limits::width);
  require_within("inputs", d.inputs.size(), 1, mlp_limits::width);
  require_within("layers", d.layers.size(), 1, mlp_limits::layers);
  require_within("labels", d.labels.size(), 0, mlp_limits::labels);
  if (!(d.log_floor >= 0.0) || !std::isfinite(d.log_floor)) refuse("a floor that is no number from 0 on");
  for (const MlpInput& in : d.inputs) check_input(in, d.features);
  std::size_t before = d.inputs.size(), weights = 0;
  for (const MlpLayer& layer : d.layers) {
    require_within("outputs of a layer", static_cast<std::size_t>(std::max(0, layer.outputs)), 1, mlp_limits::width);
    if (layer.inputs != static_cast<int>(before))
      refuse(fmt::format("a layer of {} inputs behind {} outputs", layer.inputs, before));
    const auto outputs = static_cast<std::size_t>(layer.outputs);
    if (layer.weights.size() != before * outputs || layer.biases.size() != outputs)
      refuse(fmt::format("{} weights and {} biases of a layer of {} x {}", layer.weights.size(), layer.biases.size(),
                         outputs, before));
    require_finite("weights", layer.weights);
    require_finite("biases", layer.biases);
    weights += layer.weights.size();
    before = outputs;
  }
  require_within("weights", weights, 1, mlp_limits::weights);
}

/// One panel of outputs: sums over all inputs, then the activation.
void run_panel(const float* weights, const float* biases, const float* in, int inputs, float* out) {
  Register sum[registers];
  for (int r = 0; r < registers; ++r) sum[r] = Register::load_unaligned(biases + r * lanes_of_register);
  for (int i = 0; i < inputs; ++i, weights += panel) {
    const Register x(in[i]);
    for (int r = 0; r < registers; ++r) sum[r] = sum[r] + Register::load_unaligned(weights + r * lanes_of_register) * x;
  }
  for (int r = 0; r < registers; ++r) sum[r].store_unaligned(out + r * lanes_of_register);
}

void activate(Activation activation, int count, float* values) {
  if (activation == Activation::relu)
    for (int i = 0; i < count; ++i) values[i] = values[i] > 0.0f ? values[i] : 0.0f;
  else
    for (int i = 0; i < count; ++i) values[i] = std::tanh(values[i]);
}

float input_of(const MlpInput& in, std::span<const float> features) {
  const float f = features[static_cast<std::size_t>(in.column)];
  const float g = in.knee > 0.0f ? f / (in.knee + std::abs(f)) : f;
  return (g - in.mean) * in.scale;
}

/// A list of numbers over lines of reasonable length.
template <class T>
std::string list_text(const std::vector<T>& values) {
  std::string text = "[";
  std::size_t line = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::string one = fmt::format("{}", values[i]);
    if (line + one.size() > 110) text += "\n", line = 0;
    text += one + (i + 1 < values.size() ? ", " : "");
    line += one.size() + 2;
  }
  return text + "]";
}

template <class T>
std::vector<T> column_of(const std::vector<MlpInput>& inputs, T MlpInput::*member) {
  std::vector<T> values;
  values.reserve(inputs.size());
  for (const MlpInput& in : inputs) values.push_back(in.*member);
  return values;
}

std::vector<float> floats(TableReader& table, const std::string& key) {
  constexpr double most = 3e38;
  const std::vector<double> numbers = table.numbers(key, Range::between(-most, most));
  std::vector<float> values;
  std::ranges::transform(numbers, std::back_inserter(values), [](double v) { return static_cast<float>(v); });
  return values;
}

std::vector<MlpInput> read_inputs(TableReader& table) {
  const std::vector<int> columns = table.integers("columns", 0, mlp_limits::width - 1);
  const std::vector<float> knees = floats(table, "knees"), means = floats(table, "means"),
                           scales = floats(table, "scales");
  if (knees.size() != columns.size() || means.size() != columns.size() || scales.size() != columns.size())
    table.fail("columns", fmt::format("{} columns, {} knees, {} means, {} scales (allowed: one of each an input)",
                                      columns.size(), knees.size(), means.size(), scales.size()));
  std::vector<MlpInput> inputs;
  for (std::size_t i = 0; i < columns.size(); ++i) inputs.push_back({columns[i], knees[i], means[i], scales[i]});
  return inputs;
}

constexpr int format_of_file = 1;

}  // namespace

Mlp::Mlp(MlpData data) : data_(std::move(data)) {
  check(data_);
  for (const MlpLayer& layer : data_.layers) packed_.push_back(pack(layer));
}

Mlp::Packed Mlp::pack(const MlpLayer& layer) {
  Packed p{layer.inputs, layer.outputs, (layer.outputs + panel - 1) / panel, {}, {}};
  const auto width = static_cast<std::size_t>(p.panels * panel);
  p.biases.assign(width, 0.0f);
  std::ranges::copy(layer.biases, p.biases.begin());
  p.weights.assign(width * static_cast<std::size_t>(layer.inputs), 0.0f);
  for (int o = 0; o < layer.outputs; ++o)
    for (int i = 0; i < layer.inputs; ++i)
      p.weights[static_cast<std::size_t>((o / panel * layer.inputs + i) * panel + o % panel)] =
          layer.weights[static_cast<std::size_t>(o * layer.inputs + i)];
  return p;
}

void Mlp::evaluate(std::span<const float> features, std::span<float> outputs) const noexcept {
  float rows[2][padded_width];
  float *in = rows[0], *out = rows[1];
  for (std::size_t i = 0; i < data_.inputs.size(); ++i) in[i] = input_of(data_.inputs[i], features);
  for (std::size_t l = 0; l < packed_.size(); ++l, std::swap(in, out)) {
    const Packed& p = packed_[l];
    for (int k = 0; k < p.panels; ++k)
      run_panel(&p.weights[static_cast<std::size_t>(k * p.inputs * panel)],
                &p.biases[static_cast<std::size_t>(k * panel)], in, p.inputs, out + k * panel);
    if (l + 1 < packed_.size()) activate(data_.activation, p.outputs, out);
  }
  std::copy_n(in, outputs.size(), outputs.begin());
}

std::string mlp_text(const MlpData& d) {
  std::string text =
      fmt::format("format = {}\nkind = \"{}\"\nlayout = \"{}\"\nfeatures = {}\nactivation = \"{}\"\n", format_of_file,
                  d.kind, d.layout, d.features, d.activation == Activation::relu ? "relu" : "tanh");
  text += fmt::format("layers = {}\nlabels = {}\nlog_floor = {}\n", d.layers.size(), list_text(d.labels), d.log_floor);
  text +=
      fmt::format("columns = {}\nknees = {}\nmeans = {}\nscales = {}\n",
                  list_text(column_of(d.inputs, &MlpInput::column)), list_text(column_of(d.inputs, &MlpInput::knee)),
                  list_text(column_of(d.inputs, &MlpInput::mean)), list_text(column_of(d.inputs, &MlpInput::scale)));
  for (const MlpLayer& layer : d.layers)
    text += fmt::format("\n[[layer]]\noutputs = {}\nbiases = {}\nweights = {}\n", layer.outputs,
                        list_text(layer.biases), list_text(layer.weights));
  return text;
}

MlpData read_mlp(const std::string& text, const std::string& name) {
  if (text.size() > file_size::configuration)
    throw ConfigError(fmt::format("{}: {} bytes (allowed: at most {})", name, text.size(), file_size::configuration));
  TableReader table = TableReader::from_text(text, name);
  MlpData d;
  table.integer("format", format_of_file, format_of_file);
  d.kind = table.text("kind");
  d.layout = table.text("layout");
  d.features = table.integer("features", 1, mlp_limits::width);
  d.activation = table.text("activation", {"relu", "tanh"}) == "relu" ? Activation::relu : Activation::tanh;
  d.labels = table.integers("labels", 0, INT32_MAX);
  d.log_floor = table.number("log_floor", Range::non_negative());
  d.inputs = read_inputs(table);
  std::size_t inputs = d.inputs.size();
  const auto layers = static_cast<std::size_t>(table.integer("layers", 1, mlp_limits::layers));
  for (TableReader& layer : table.tables("layer")) {
    MlpLayer one{static_cast<int>(inputs), layer.integer("outputs", 1, mlp_limits::width), floats(layer, "weights"),
                 floats(layer, "biases")};
    layer.finish();
    inputs = static_cast<std::size_t>(one.outputs);
    d.layers.push_back(std::move(one));
  }
  table.finish();
  if (d.layers.size() != layers)
    table.fail("layers", fmt::format("{}, and there are {} (allowed: as many as there are)", layers, d.layers.size()));
  try {
    check(d);
  } catch (const std::invalid_argument& wrong) {
    throw ConfigError(fmt::format("{}: {}", name, wrong.what()));
  }
  return d;
}

}  // namespace solenoid
