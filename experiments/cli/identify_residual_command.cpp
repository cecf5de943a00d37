#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/result.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/systems/actuator/identify/log_source.hpp"
#include "experiments/systems/actuator/identify/residual.hpp"
#include "experiments/systems/actuator/identify/residual_prediction.hpp"

#include <cmath>
#include <filesystem>
#include <iterator>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

struct ResidualArguments {
  std::vector<std::string> logs, tests;
  std::string variant = "nine_robust", campaign, out, plane = "vertical";
  LogSettings log;
  OutputOptions output;
};

VariantConfig believing(const ResidualArguments& options) {
  VariantConfig v = options.campaign.empty()
                        ? shipped_variant(options.variant)
                        : read_campaign(options.campaign, {.variants = {options.variant}}).variants.front();
  if (system_of(v).description().name != new_variant().system->description().name)
    throw ConfigError(
        fmt::format("--variant: '{}' is not of the actuator (allowed: a variant of the actuator)", v.name));
  if (!estimator_row(v.estimator).finds_load)
    throw ConfigError(
        fmt::format("--variant: '{}' has the estimator '{}', whose disturbance no residual is beside "
                    "(allowed: a variant with ekf, payload_ekf or mhe)",
                    v.name, v.estimator));
  actuator(v).residual = {};
  return v;
}

std::vector<Record> records_of(const std::vector<std::string>& paths, const LogSettings& settings) {
  std::vector<Record> records;
  for (const std::string& path : paths) {
    LogRecords log = read_log_records(path, settings);
    if (!log.told.empty()) fmt::print(stderr, "solenoid: {}: {}\n", path, fmt::join(log.told, "; "));
    records.insert(records.end(), std::make_move_iterator(log.records.begin()),
                   std::make_move_iterator(log.records.end()));
  }
  return records;
}

/// The logs that are predicted in, at least in part. Throws ConfigError where nothing can be predicted.
PredictionError judged_on(const std::vector<std::string>& logs, const std::vector<Record>& records,
                          const VariantConfig& v, const ForceResidual& residual) {
  const PredictionError found = prediction_error(records, v, residual);
  if (found.predictions > 0) return found;
  const int ticks = PredictionError::settled_ticks + PredictionError::ahead_ticks;
  throw ConfigError(
      fmt::format("{}: no prediction can be judged in records such as this of {:.2f} s at {:g} ms (allowed: logs at "
                  "the tick of '{}', {:g} ms, and more than {:g} s of them without a gap)",
                  fmt::join(logs, ", "), records.front().duration_s(), 1e3 * records.front().period_s, v.name,
                  1e3 * v.timing.tick_s, ticks * v.timing.tick_s));
}

/// Names without folders, and one hash of all contents.
ResidualSource source_of(const ResidualArguments& options) {
  std::vector<std::string> names;
  std::string contents;
  for (const std::string& path : options.logs) {
    names.push_back(std::filesystem::path(path).filename().string());
    contents += fingerprint(read_whole_file(path).value());
  }
  return {fmt::format("{}", fmt::join(names, ", ")), fingerprint(contents), options.variant};
}

/// What the held-out samples say, or why there are none.
std::string told_of(const std::optional<HeldOutForce>& held) {
  if (!held) return "no sample was held out: no log has more than 4 s of motion";
  return fmt::format("{:.1f} % of {} held-out samples are inside the 95 % band", 100 * held->inside_95, held->samples);
}

Result result_of(const ResidualFinding& found, const PredictionError& predicted, std::size_t records, bool tested) {
  using Column = Table::Column;
  Table table{.name = "residual",
              .columns = {Column("quantity", "", "<"), Column("without", "without", ".4g"),
                          Column("with", "with", ".4g"), Column("unit", "unit", "<")}};
  const std::optional<HeldOutForce>& held = found.held_out;
  if (held) table.add({"force left in held-out seconds", held->without_n, held->with_n, "N rms"});
  table.add({fmt::format("position after {} ticks", PredictionError::ahead_ticks), 1e3 * predicted.without_m,
             1e3 * predicted.with_m, "mm rms"});
  table.add({"log likelihood", found.without_residual, found.log_likelihood, ""});
  std::vector<std::string> payloads;
  for (const GpValue& p : found.payload_kg)
    payloads.push_back(fmt::format("{:.3f} +- {:.3f}", p.mean, 1.96 * std::sqrt(p.variance)));
  table.notes = {
      fmt::format("{} samples, {:.3g} to {:.3g} m/s, {:.3g} to {:.3g} m; noise {:.2g} N; payload {} kg", found.samples,
                  found.velocity_range_m_s[0], found.velocity_range_m_s[1], found.position_range_m[0],
                  found.position_range_m[1], found.noise_n, fmt::join(payloads, ", ")),
      told_of(held),
      fmt::format("predictions on {}: {}, {:.1f} % of the ticks where no data were",
                  tested ? "the --test logs" : "the same logs", predicted.predictions, 100 * predicted.outside)};
  if (predicted.records < records)
    table.notes.back() += fmt::format("; {} of {} records have another tick or are too short for predictions",
                                      records - predicted.records, records);
  return {.facts = {{"samples", found.samples},
                    {"held_out_inside_95", held ? Json(held->inside_95) : Json()},
                    {"predictions", predicted.predictions},
                    {"outside", predicted.outside}},
          .tables = {table},
          .plot = residual_plot(found)};
}

/// Throws ConfigError for a file that the key would refuse.
void check_out(const std::string& out) {
  if (!out.ends_with(".toml"))
    throw ConfigError(
        fmt::format("--out: '{}' is no file that the key `residual` takes (allowed: a file in .toml)", out));
}

int identify_residual_of(ResidualArguments& options) {
  check_out(options.out);
  const VariantConfig variant = believing(options);
  options.log.plane = options.plane == "vertical" ? Plane::vertical : Plane::horizontal;
  options.log.valves = variant.modes;
  const std::vector<Record> records = records_of(options.logs, options.log),
                            tests = records_of(options.tests, options.log);
  std::vector<std::vector<ResidualSample>> samples;
  for (const Record& r : records)
    samples.push_back(residual_samples(r, actuator(variant).nominal, actuator(variant).estimation.pressure_filter_hz));
  const ResidualFinding found = [&] {
    try {
      return identify_residual(samples);
    } catch (const ConfigError& error) {
      throw ConfigError(fmt::format("{}: {}", fmt::join(options.logs, ", "), error.what()));
    }
  }();
  const ForceResidual residual = found.residual();
  const PredictionError learned = judged_on(options.logs, records, variant, residual);
  if (!learned.better())
    throw ConfigError(fmt::format(
        "{}: the position {} ticks ahead is predicted no better with it, to {:.4f} mm where it was "
        "{:.4f} mm without; no file is written (allowed: logs of motion to and fro, at the "
        "speeds that are wanted)",
        fmt::join(options.logs, ", "), PredictionError::ahead_ticks, 1e3 * learned.with_m, 1e3 * learned.without_m));
  const bool tested = !tests.empty();
  const PredictionError predicted = tested ? judged_on(options.tests, tests, variant, residual) : learned;
  write_file_atomically(options.out, residual_file(found, source_of(options)));
  Result result = result_of(found, predicted, (tested ? tests : records).size(), tested);
  result.notes = {fmt::format("Residual: {0}; a variant takes it as residual = \"{0}\"", options.out)};
  options.output.write(result);
  return success;
}

}  // namespace

void add_identify_residual(CLI::App& identify, int& exit_code) {
  auto options = std::make_shared<ResidualArguments>();
  ResidualArguments& o = *options;
  CLI::App* command =
      identify.add_subcommand("residual", "a force that a model leaves out, from logs: docs/how-to/residual.md");
  command->add_option("log", o.logs, "MCAP logs of run, or CSVs")->type_name(value_kind::file)->required();
  command->add_option("--out", o.out, "the file that the key `residual` of a variant takes")
      ->type_name(value_kind::toml)
      ->required();
  command->add_option("--test", o.tests, "a log that predictions are judged by and nothing is learned from, repeatable")
      ->type_name(value_kind::file)
      ->allow_extra_args(false);
  command->add_option("--variant", o.variant, "whose model and estimator it is for; default nine_robust")
      ->type_name(value_kind::variant);
  command->add_option("--campaign", o.campaign, "where the variant is from; default: the shipped ones")
      ->type_name(value_kind::campaign);
  command->add_option("--column", o.log.columns, "of a CSV or another MCAP, repeatable: as identify --log has it")
      ->allow_extra_args(false);
  command->add_option("--plane", o.plane, "of the logs: vertical (default) or horizontal")
      ->check(CLI::IsMember({"vertical", "horizontal"}));
  add_output_options(*command, o.output);
  add_figure_options(*command, o.output, "samples, band and residual");
  command->callback([options, &exit_code] { exit_code = identify_residual_of(*options); });
}

}  // namespace solenoid
