#include "core/config/one_line.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/run_campaign.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/live_options.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/report/comparison.hpp"
#include "experiments/report/live/live_server.hpp"
#include "experiments/report/pareto.hpp"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

constexpr std::size_t most_rows = 80;  // of runs in a table nobody asked for

struct CompareArguments {
  std::string campaign = "default", pareto;
  OutputOptions output;
  CampaignOptions run;
  Selection selection;
  bool details = false, live = false;
  int live_port = 0;
};

void report(const Campaign& campaign, const CampaignResult& result, const CompareArguments& options) {
  if (options.output.format == "csv") return write_standard_output(to_csv(result.records));
  Result found = result_of(result.records, options.details || result.records.size() <= most_rows);
  if (std::string note = real_time_note(campaign.variants); !note.empty()) found.notes.push_back(std::move(note));
  found.notes.push_back("Results: " + result.folder);
  options.output.write(found);
}

/// A page of the campaign's folder, if it is wanted.
std::unique_ptr<LiveServer> serve(const Campaign& campaign, CompareArguments& options) {
  if (!options.live) return nullptr;
  if (options.run.out.empty()) options.run.out = new_results_folder(campaign.name);
  auto server = std::make_unique<LiveServer>(campaign, options.run.out, options.live_port, LiveServer::Earlier::shown);
  std::fprintf(stderr, "solenoid: live page at %s\n", server->url().c_str());
  return server;
}

void tell_left_out(const WithoutPlugins& out) {
  for (const std::string& why : out.plugins) std::fprintf(stderr, "solenoid: %s\n", one_line(why).c_str());
  if (!out.names.empty())
    std::fprintf(stderr, "solenoid: left out without it: %s\n", fmt::format("{}", fmt::join(out.names, ", ")).c_str());
}

int compare(CompareArguments options) {
  options.selection.leaves_out = true;
  const Campaign campaign = read_campaign(options.campaign, options.selection);
  tell_left_out(campaign.without);
  std::optional<InterruptGuard> guard;  // a live page stays until Ctrl-C
  if (options.live) guard.emplace();
  const std::unique_ptr<LiveServer> server = serve(campaign, options);
  const CampaignResult result = run_campaign(campaign, options.run);
  report(campaign, result, options);
  if (result.interrupted) {
    std::fprintf(stderr,
                 "solenoid: interrupted with %zu of %zu runs finished; the same command with --out %s resumes\n",
                 result.records.size(), campaign.runs.size(), result.folder.c_str());
    return interrupted;
  }
  if (!options.pareto.empty()) draw_pareto(result.records, options.pareto);
  if (options.output.format != "table") std::fprintf(stderr, "Results: %s\n", result.folder.c_str());
  const auto failed = std::count_if(result.records.begin(), result.records.end(), [](auto& r) { return r.failed(); });
  if (failed > 0) std::fprintf(stderr, "solenoid: %td runs failed\n", failed);
  if (server) server->stay();
  return failed > 0 || !campaign.without.plugins.empty() ? failure : success;
}

}  // namespace

void add_compare(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<CompareArguments>();
  CLI::App* command = app.add_subcommand("compare", "run variants on scenarios and rank them");
  command->add_option("campaign", options->campaign, "campaign file, or a shipped campaign's name; default: default")
      ->type_name(value_kind::campaign);
  add_out_option(*command, options->run.out);
  add_jobs_option(*command, options->run.jobs);
  command
      ->add_option("--tick-limit", options->run.tick_limit_s,
                   "a run fails that computes longer at one tick; default 600, 0: none does")
      ->type_name("S")
      ->check(CLI::Range(0.0, 1e6));
  add_output_options(*command, options->output);
  command->add_option("--variant", options->selection.variants, "these variants in place of the campaign's")
      ->type_name(value_kind::variant)
      ->delimiter(',');
  command->add_option("--scenario", options->selection.scenarios, "only these scenarios")
      ->type_name(value_kind::scenario)
      ->delimiter(',');
  command
      ->add_option("--model", options->selection.model,
                   "every variant believes this parameter set or file (of identify), in place of its own")
      ->type_name(value_kind::model);
  command->add_option("--pareto", options->pareto, "draw error against switches and air into this .svg or .png")
      ->type_name(value_kind::file)
      ->check([](const std::string& path) {
        const bool figure = path.ends_with(".svg") || path.ends_with(".png");
        return figure ? std::string() : "'" + path + "' (allowed: a file ending in .svg or .png)";
      });
  add_live_options(*command, options->live, options->live_port);
  command->add_flag("--details", options->details, "every run below its scenario, however many");
  command->callback([options, &exit_code] { exit_code = compare(*options); });
}

}  // namespace solenoid
