#include "core/config/reader.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/files.hpp"
#include "experiments/check/checks.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/report/text_table.hpp"

#include <algorithm>
#include <cstdio>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

Check check_campaign(const std::string& path) {
  const Campaign campaign = read_campaign(path);
  return {"campaign", path, "ok",
          fmt::format("{} variants, {} scenarios, {} seeds: {} runs", campaign.variants.size(),
                      campaign.scenarios.size(), campaign.seeds.size(), campaign.runs.size())};
}

std::string text_of(const std::vector<Check>& checks, bool as_json) {
  if (as_json) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const Check& c : checks)
      list.push_back({{"group", c.group}, {"name", c.name}, {"result", c.result}, {"detail", c.detail}});
    return nlohmann::ordered_json{{"checks", list}}.dump(1) + "\n";
  }
  TextTable table({{"group", TextTable::Align::left},
                   {"name", TextTable::Align::left},
                   {"result", TextTable::Align::left},
                   {"detail", TextTable::Align::left}});
  for (const Check& c : checks) table.add_row(std::vector<std::string>{c.group, c.name, c.result, c.detail});
  return table.text(false);
}

/// Files first: one that is refused ends the command, after every other has been looked at.
int check(const std::vector<std::string>& files, bool as_json) {
  std::vector<Check> checks;
  bool refused = false;
  for (const std::string& file : files) {
    try {
      checks.push_back(check_campaign(file));
    } catch (const ConfigError& error) {
      std::fprintf(stderr, "solenoid: %s\n", error.what());
      refused = true;
    }
  }
  if (refused) return bad_input;
  for (auto* look : {check_installation, check_machine, check_model})
    for (Check& c : look()) checks.push_back(std::move(c));
  write_standard_output(text_of(checks, as_json));
  return std::any_of(checks.begin(), checks.end(), [](const Check& c) { return c.result == "failed"; }) ? failure
                                                                                                        : success;
}

}  // namespace

void add_check(CLI::App& app, int& exit_code) {
  struct Options {
    std::vector<std::string> files;
    std::string format = "table";
  };
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("check", "campaign files, the installation, the machine and the model");
  command->add_option("campaigns", options->files, "campaign files to validate");
  command->add_option("--format", options->format, "table or json")->check(CLI::IsMember({"table", "json"}));
  command->callback([options, &exit_code] { exit_code = check(options->files, options->format == "json"); });
}

}  // namespace solenoid
