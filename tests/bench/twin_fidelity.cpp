// Fidelity of a twin: the thesis's hardware tables beside ours, and the criteria its parameters were chosen by.
//
//   bench_twin_fidelity                         the nominal twin, beside the controller's own model
//   bench_twin_fidelity friction.law=model ...  the same with keys of its parameter file set to other values
//   --chapter 5|7|both   --plant twin|model   --seeds N   --quiet (criteria only)   --file twin.toml
//   --search KEY=a,b,c ...   one key at a time, the value of least criterion kept, until none improves

#include "core/config/document.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/embedded.hpp"
#include "experiments/base/result.hpp"
#include "experiments/systems/actuator/thesis/fidelity.hpp"

#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace {

using namespace solenoid;
using Settings = std::map<std::string, std::string>;

/// The parameter file's text with dotted keys set to other values.
TwinParameters twin_with(const std::string& text, const Settings& settings) {
  Document twin = Document::from_text(text, "twin");
  toml::table& document = twin.root();
  for (const auto& [path, value] : settings) {
    const auto dot = path.find('.');
    const std::string section = path.substr(0, dot), key = path.substr(dot + 1);
    if (!document.contains(section)) document.insert(section, toml::table{});
    toml::table& table = *document[section].as_table();
    table.erase(key);
    const toml::table parsed = [&] {
      try {
        return toml::parse("x = " + value);
      } catch (const toml::parse_error&) {
        return toml::parse("x = \"" + value + "\"");
      }
    }();
    parsed["x"].visit([&](const auto& node) { table.insert(key, node); });
    twin.set_by(path, path + "=" + value);
  }
  TableReader reader(std::move(twin));
  return read_twin(reader);
}

std::vector<Cell> chapter(const StandIn& rig, int number) {
  return reproduce(number == 5 ? step_cases(rig) : motion_cases(rig), 2);
}

double criterion_of(const StandIn& rig) { return choice_criterion(chapter(rig, 5)); }

void print_chapter(const StandIn& rig, int number, bool quiet) {
  const std::vector<Cell> cells = chapter(rig, number);
  if (!quiet) fmt::print("{}", result_of(cells).text(false));
  for (const Agreement& a : agreements(cells))
    fmt::print("{} [{}]: |ln {}| {:.3f}\n", a.tables, a.parameters, a.metric, a.mean_abs_ln);
  if (number == 5)
    fmt::print("criterion {:.4f}  overshoot np>=100 {:.2f} %\n", choice_criterion(cells),
               largest_overshoot_percent(cells, 100));
  std::fflush(stdout);
}

void search(StandIn rig, const std::string& text, Settings settings, const std::vector<std::string>& grid) {
  rig.twin = twin_with(text, settings);
  double best = criterion_of(rig);
  fmt::print("start {:.4f}\n", best);
  for (bool improved = true; improved;) {
    improved = false;
    for (const std::string& axis : grid) {
      const auto equals = axis.find('=');
      const std::string key = axis.substr(0, equals);
      std::istringstream values(axis.substr(equals + 1));
      for (std::string value; std::getline(values, value, ',');) {
        if (settings.contains(key) && settings.at(key) == value) continue;
        Settings trial = settings;
        trial[key] = value;
        double criterion = 1e9;
        try {
          rig.twin = twin_with(text, trial);
          criterion = criterion_of(rig);
        } catch (const ConfigError&) {
          continue;  // a combination the reader refuses
        }
        if (!(criterion < best - 1e-9)) continue;
        best = criterion;
        settings = trial;
        improved = true;
        fmt::print("{:.4f}  {} = {}\n", best, key, value);
        std::fflush(stdout);
      }
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Fidelity of the truth plant to the thesis's hardware tables");
  std::vector<std::string> overrides, grid;
  std::string chapter = "both", plant = "twin", file;
  int seeds = 1;
  bool quiet = false;
  app.add_option("settings", overrides, "section.key=value");
  app.add_option("--chapter", chapter)->check(CLI::IsMember({"5", "7", "both"}));
  app.add_option("--plant", plant)->check(CLI::IsMember({"twin", "model"}));
  app.add_option("--seeds", seeds)->check(CLI::Range(1, 100));
  app.add_option("--file", file)->check(CLI::ExistingFile);
  app.add_flag("--quiet", quiet);
  app.add_option("--search", grid);
  CLI11_PARSE(app, argc, argv);

  std::string text(embedded_text("scenarios/twin.toml"));
  if (!file.empty()) {
    std::ostringstream read;
    read << std::ifstream(file).rdbuf();
    text = read.str();
  }
  Settings settings;
  StandIn rig;
  for (const std::string& o : overrides) {
    const std::string key = o.substr(0, o.find('=')), value = o.substr(o.find('=') + 1);
    if (key == "integral_gain")
      rig.integral_gain = std::stod(value);
    else
      settings[key] = value;
  }
  rig.plant = plant;
  rig.name = plant == "model" ? "inferred" : plant;
  rig.step_seeds = rig.motion_seeds = seeds;
  try {
    rig.twin = twin_with(text, settings);
    if (!grid.empty())
      search(rig, text, settings, grid);
    else {
      if (chapter != "7") print_chapter(rig, 5, quiet);
      if (chapter != "5") print_chapter(rig, 7, quiet);
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
  return 0;
}
