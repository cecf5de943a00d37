// Fidelity of a twin: the thesis's hardware tables beside ours, and the criteria its parameters were chosen by.
//
//   bench_twin_fidelity                         the nominal twin, beside the controller's own model
//   bench_twin_fidelity friction.law=model ...  the same with keys of its parameter file set to other values
//   --chapter 5|7|both   --plant twin|model   --seeds N   --quiet (criteria only)   --file twin.toml
//   --search KEY=a,b,c ...   one key at a time, the value of least criterion kept, until none improves

#include "core/config/reader.hpp"
#include "experiments/embedded.hpp"
#include "experiments/twin/fidelity.hpp"

#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <toml++/toml.h>

namespace {

using namespace solenoid;
using Settings = std::map<std::string, std::string>;

/// The parameter file's text with dotted keys set to other values.
TwinParameters twin_with(const std::string& text, const Settings& settings) {
  toml::table document = toml::parse(text);
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
  }
  std::ostringstream out;
  out << document;
  TableReader reader = TableReader::from_text(out.str(), "twin");
  return read_twin(reader);
}

void print_cells(const std::vector<FidelityCell>& cells) {
  for (const FidelityCell& c : cells)
    fmt::print("{:5} {:32} {:18} thesis {:7.3f}  ours {:7.3f}\n", c.table, c.case_name, c.metric, c.thesis, c.ours);
}

double print_chapter5(const FidelityRig& rig, bool quiet) {
  const auto cells = chapter5_cells(rig);
  if (!quiet) print_cells(cells);
  const auto sse_of = [&](const char* table) {
    return mean_abs_log_ratio(cells, [&](const FidelityCell& c) { return c.table == table && c.metric == "sse_mm"; });
  };
  const double criterion = choice_criterion(cells);
  fmt::print(
      "chapter 5 [{}]: criterion {:.4f}  |ln sse| 5-2 {:.3f} 5-3 {:.3f} 5-4 {:.3f}  overshoot np>=100 {:.2f} %\n",
      rig.plant, criterion, sse_of("5-2"), sse_of("5-3"), sse_of("5-4"), largest_overshoot(cells, 100));
  std::fflush(stdout);
  return criterion;
}

void print_chapter7(const FidelityRig& rig, bool quiet) {
  const auto cells = chapter7_cells(rig);
  if (!quiet) print_cells(cells);
  const auto of = [&](const char* metric) {
    return mean_abs_log_ratio(cells, [&](const FidelityCell& c) { return c.metric == metric; });
  };
  fmt::print("chapter 7 [{}]: |ln ratio| all {:.3f}  rmse {:.3f}  mae {:.3f}  sse {:.3f}  ssa {:.3f}\n", rig.plant,
             mean_abs_log_ratio(cells, [](const FidelityCell&) { return true; }), of("rmse_mm"), of("mae_mm"),
             of("sse_mm"), of("ssa_mm"));
  std::fflush(stdout);
}

void search(FidelityRig rig, const std::string& text, Settings settings, const std::vector<std::string>& grid) {
  rig.twin = twin_with(text, settings);
  double best = choice_criterion(chapter5_cells(rig));
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
          criterion = choice_criterion(chapter5_cells(rig));
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
  FidelityRig rig;
  for (const std::string& o : overrides) {
    const std::string key = o.substr(0, o.find('=')), value = o.substr(o.find('=') + 1);
    if (key == "believed")
      rig.believed = value;
    else if (key == "integral_gain")
      rig.integral_gain = std::stod(value);
    else
      settings[key] = value;
  }
  rig.plant = plant;
  rig.seeds.clear();
  for (int s = 1; s <= seeds; ++s) rig.seeds.push_back(static_cast<std::uint64_t>(s));
  try {
    rig.twin = twin_with(text, settings);
    if (!grid.empty())
      search(rig, text, settings, grid);
    else {
      if (chapter != "7") print_chapter5(rig, quiet);
      if (chapter != "5") print_chapter7(rig, quiet);
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 2;
  }
  return 0;
}
