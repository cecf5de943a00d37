#include "controllers/catalogue.hpp"
#include "core/config/one_line.hpp"
#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/run_campaign.hpp"
#include "experiments/campaign/written_runs.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/live_options.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/slurm_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/report/comparison.hpp"
#include "experiments/report/live/live_server.hpp"
#include "experiments/report/pareto.hpp"
#include "experiments/report/results.hpp"

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
  std::string campaign = "default", pareto, baseline;
  OutputOptions output;
  CampaignOptions run;
  Selection selection;
  std::string shard, traces = "all";
  SlurmOptions slurm;
  bool details = false, live = false;
  int live_port = 0;

  /// CSV is of the runs, unless a comparison is asked for.
  bool runs_as_csv() const { return output.format == "csv" && baseline.empty(); }
};

void add_notes(const Campaign& campaign, const std::string& folder, Result& result) {
  if (std::string note = real_time_note(campaign.variants); !note.empty()) result.notes.push_back(std::move(note));
  result.notes.push_back("Results: " + folder);
}

/// Of more runs than are worth having in memory one by one.
void report_many(const Campaign& campaign, const CampaignResult& result, const CompareArguments& options) {
  const SystemDescription& system = campaign.system->description();
  if (options.runs_as_csv()) return write_csv(*result.kept, system, write_standard_output);
  Result found = result_of(table_of(*result.kept, system), options.baseline);
  add_notes(campaign, result.folder, found);
  if (options.output.format != "json") return options.output.write(found);
  write_json(*result.kept, found.facts, write_standard_output);
  options.output.write_files(found);
}

void report(const Campaign& campaign, const CampaignResult& result, const CompareArguments& options) {
  const bool each = options.details && options.output.format == "table";
  if (result.kept && result.ended > most_listed_runs && !each) return report_many(campaign, result, options);
  const std::vector<RunRecord> records = result.records();
  if (options.runs_as_csv()) return write_standard_output(to_csv(records));
  Result found = result_of(records, options.details || records.size() <= most_rows, options.baseline);
  add_notes(campaign, result.folder, found);
  options.output.write(found);
}

void draw_pareto(const Campaign& campaign, const CampaignResult& result, const std::string& path) {
  if (result.kept) draw_ranked(rank_variants(table_of(*result.kept, campaign.system->description())), path);
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

/// The share that is asked for, or that of the array's task which this is. Throws ConfigError.
Shard shard_of(const CompareArguments& options) {
  const bool asked = !options.shard.empty() && options.shard != "auto";
  const std::optional<Shard> shard = asked ? parse_shard(options.shard) : shard_of_array_task();
  if (!shard && !options.shard.empty()) throw ConfigError("--shard: auto outside of an array job (allowed: I/N)");
  if (shard && !shard->alone && options.run.out.empty())
    throw ConfigError(
        fmt::format("--out: missing (allowed: the folder that all shards share; this is {}, and --shard "
                    "1/1 is the whole campaign)",
                    shard->text()));
  return shard.value_or(Shard{});
}

/// How fast it went.
void tell_throughput(const CampaignResult& result) {
  if (result.done == 0 || !(result.wall_s > 0)) return;
  std::fprintf(stderr, "solenoid: %zu runs in %.1f s, %.1f a second\n", result.done, result.wall_s,
               static_cast<double>(result.done) / result.wall_s);
}

/// A share of a campaign, whose result `merge` makes.
int compare_shard(const Campaign& campaign, const CompareArguments& options) {
  const CampaignResult result = run_campaign(campaign, options.run);
  tell_throughput(result);
  std::fprintf(stderr, "solenoid: shard %s: %zu of %zu runs are done, %zu failed%s\n", options.run.shard.text().c_str(),
               result.ended, result.runs, result.failed, result.interrupted ? "; interrupted" : "");
  write_standard_output("Results: " + result.folder + "\n");
  return result.interrupted ? interrupted : result.failed > 0 ? failure : success;
}

/// Has a cluster do a campaign.
int compare_on_slurm(const Campaign& campaign, CompareArguments options, bool traces_chosen) {
  if (options.run.out.empty()) options.run.out = new_results_folder(campaign.name);
  options.slurm.settings.cores = std::max(options.run.jobs, 1);
  options.slurm.settings.scratch = options.run.scratch;
  options.slurm.settings.tick_limit_s = options.run.tick_limit_s;
  if (traces_chosen) options.slurm.settings.traces = options.traces;
  return submit_campaign(campaign, options.run.out, options.slurm);
}

/// What makes no sense of a part of a campaign, or of one that is submitted.
void refuse_beside_parts(const CompareArguments& options) {
  const bool parted = options.slurm.wanted || !options.run.shard.alone;
  if (options.slurm.wanted && !options.shard.empty())
    throw ConfigError("--shard: --slurm parts the campaign itself (allowed: one of them)");
  if (parted && (options.live || !options.pareto.empty() || !options.output.html.empty() || !options.baseline.empty()))
    throw ConfigError(
        fmt::format("{}: the campaign is not done here (allowed: without --shard and --slurm; `merge` makes a "
                    "report)",
                    options.live                   ? "--live"
                    : !options.pareto.empty()      ? "--pareto"
                    : !options.output.html.empty() ? "--html"
                                                   : "--against"));
}

int compare(CompareArguments options, bool traces_chosen) {
  options.run.traces = TraceKeeping::of(options.traces);
  if (!options.slurm.wanted) options.run.shard = shard_of(options);
  refuse_beside_parts(options);
  if (!options.run.scratch.empty() && options.run.shard.alone && !options.slurm.wanted)
    throw ConfigError("--scratch: the campaign is not parted (allowed: with --shard or --slurm)");
  options.selection.leaves_out = true;
  const Campaign campaign = read_campaign(options.campaign, options.selection);
  tell_left_out(campaign.without);
  require_baseline(names_of(campaign.variants), options.baseline, "--against");
  if (options.slurm.wanted) {
    const int submitted = compare_on_slurm(campaign, std::move(options), traces_chosen);
    return campaign.without.plugins.empty() ? submitted : failure;
  }
  if (!options.run.shard.alone) return compare_shard(campaign, options);
  std::optional<InterruptGuard> guard;  // a live page stays until Ctrl-C
  if (options.live) guard.emplace();
  const std::unique_ptr<LiveServer> server = serve(campaign, options);
  const CampaignResult result = run_campaign(campaign, options.run);
  tell_throughput(result);
  if (result.interrupted) options.baseline.clear();  // it may have no run yet
  report(campaign, result, options);
  if (result.interrupted) {
    std::fprintf(stderr,
                 "solenoid: interrupted with %zu of %zu runs finished; the same command with --out %s resumes\n",
                 result.ended, campaign.runs.size(), result.folder.c_str());
    return interrupted;
  }
  if (!options.pareto.empty()) draw_pareto(campaign, result, options.pareto);
  if (options.output.format != "table") std::fprintf(stderr, "Results: %s\n", result.folder.c_str());
  if (result.failed > 0) std::fprintf(stderr, "solenoid: %zu runs failed\n", result.failed);
  if (server) server->stay();
  return result.failed > 0 || !campaign.without.plugins.empty() ? failure : success;
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
  add_against_option(*command, options->baseline, "; with --format csv this comparison in place of the runs");
  add_live_options(*command, options->live, options->live_port);
  command->add_option(
      "--traces", options->traces,
      "runs whose every tick is kept: all, none, worst:N of each variant; default all, with --slurm none");
  command
      ->add_option(
          "--shard", options->shard,
          "do this share of the runs, I/N, into --out, for `merge`; default: the whole campaign, or in a task of "
          "an array job (auto) its share")
      ->type_name("I/N");
  command
      ->add_option(
          "--scratch", options->run.scratch,
          "a folder near the processor that a shard grows in, put into --out when it ends; with --slurm of each "
          "node, default its TMPDIR or /tmp")
      ->type_name(value_kind::folder);
  add_slurm_options(*command, options->slurm, true);
  command->add_flag("--details", options->details, "every run below its scenario, however many");
  command->callback([options, command, &exit_code] {
    options->slurm.require_slurm(*command);
    exit_code = compare(*options, command->count("--traces") > 0);
  });
}

}  // namespace solenoid
