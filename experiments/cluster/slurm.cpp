#include "experiments/cluster/slurm.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/bounded_json.hpp"
#include "experiments/base/child_process.hpp"
#include "experiments/base/files.hpp"
#include "experiments/campaign/results_folder.hpp"
#include "experiments/campaign/shards.hpp"
#include "experiments/cluster/command.hpp"
#include "experiments/plugin/load_plugin.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* client_package = "slurm-client";
constexpr double usual_task_s = 600.0;
constexpr int usual_array_size = 1001, most_restarts = 20;

std::string jobs_file(const std::string& folder) { return folder + "/slurm/jobs.json"; }

/// Runs of a shard that no file has, by shard from 1 (entry 0 is none).
std::vector<std::size_t> missing_by_shard(const Campaign& campaign, const StoredRuns& kept, int shards) {
  std::vector<std::size_t> missing(static_cast<std::size_t>(shards) + 1);
  const std::vector<std::uint32_t> owners = shards_of_runs(campaign, shards);
  for (std::size_t run = 0; run < owners.size(); ++run)
    missing[owners[run]] += kept.ending(run) <= StoredRuns::Ending::failed;
  return missing;
}

/// "1-40", "3,7,9-12".
std::string ranges_text(const std::vector<int>& numbers) {
  std::string text;
  for (std::size_t i = 0; i < numbers.size();) {
    std::size_t last = i;
    while (last + 1 < numbers.size() && numbers[last + 1] == numbers[last] + 1) ++last;
    text += fmt::format("{}{}", text.empty() ? "" : ",", numbers[i]);
    if (last > i) text += fmt::format("-{}", numbers[last]);
    i = last + 1;
  }
  return text;
}

/// Lines of options that both scripts begin with.
std::string head_of(const std::string& name, const SlurmSettings& s) {
  std::string plain = name;
  for (char& c : plain)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '.' && c != '_' && c != '-') c = '_';
  std::string text = fmt::format("#!/bin/bash\n#SBATCH --job-name=solenoid-{}\n", plain);
  if (!s.partition.empty()) text += fmt::format("#SBATCH --partition={}\n", s.partition);
  for (const std::string& option : s.sbatch) text += fmt::format("#SBATCH {}\n", option);
  return text;
}

std::string limits_of(const SlurmSettings& s) {
  std::string text;
  if (!s.time.empty()) text += fmt::format("#SBATCH --time={}\n", s.time);
  if (!s.memory.empty()) text += fmt::format("#SBATCH --mem={}\n", s.memory);
  return text;
}

/// The absolute path of the folder, which nodes know by the same name.
std::string absolute(const std::string& folder) { return fs::weakly_canonical(fs::absolute(folder)).string(); }

/// As an argument: in the script a folder's name may not have a space. Slurm replaces what follows a '%'.
std::vector<std::string> output_option(const std::string& folder, const std::string& name) {
  std::string place;
  for (const char c : absolute(folder)) place += c == '%' ? std::string("%%") : std::string(1, c);
  return {fmt::format("--output={}/slurm/{}", place, name)};
}

std::int64_t submit_script(const std::string& script, const std::vector<std::string>& options) {
  std::vector<std::string> words = {"--parsable"};
  words.insert(words.end(), options.begin(), options.end());
  words.push_back(script);
  const CommandOutput out = run_command("sbatch", words, client_package);
  std::smatch id;
  static const std::regex number("(?:^|\n)([0-9]+)(?:;[^\n]*)?(?:\n|$)");  // among what a site's own scripts say
  if (!out.ok() || !std::regex_search(out.text, id, number))
    throw ConfigError(fmt::format("sbatch refused {}: {}", script, out.line()));
  return std::stoll(id[1]);
}

/// Of an array: tasks of several have the same numbers.
std::string log_name(int first) { return first == 0 ? "%a.log" : fmt::format("%a-from-{}.log", first); }

std::string program_of(const std::string& folder, const SlurmSettings& settings) {
  return absolute(settings.program.empty() ? folder + "/slurm/solenoid" : settings.program);
}

/// The copy of a plug-in beside that of the program; none of one that is in no file.
std::string plugin_file(const std::string& program, const LoadedPlugin& plugin) {
  if (plugin.path.empty()) return {};
  return (fs::path(program).parent_path() / (plugin.name + ".so")).string();
}

/// Options that have the program load what this one has loaded.
std::string plugin_options(const std::string& program) {
  std::string options;
  for (const LoadedPlugin& plugin : loaded_plugins())
    if (const std::string file = plugin_file(program, plugin); !file.empty())
      options += " --plugin " + shell_quoted(file);
  return options;
}

/// Writes which jobs there are. One that nobody knows of would be submitted again: if that fails it is cancelled.
void keep_known(const SlurmJobs& jobs, const std::string& folder) {
  try {
    jobs.write(folder);
  } catch (...) {
    run_command("scancel", {std::to_string(jobs.arrays.back().id)}, client_package);
    throw;
  }
}

}  // namespace

bool SlurmTask::over() const {
  constexpr std::array ends = {"BOOT_FAIL", "CANCELLED",     "COMPLETED", "DEADLINE", "FAILED",
                               "NODE_FAIL", "OUT_OF_MEMORY", "PREEMPTED", "REVOKED",  "TIMEOUT"};
  return std::ranges::any_of(ends, [&](const char* end) { return state.starts_with(end); });
}

SlurmJobs SlurmJobs::of(const std::string& folder) {
  const std::string path = jobs_file(folder);
  SlurmJobs jobs;
  const auto text = read_whole_file(path, file_size::json);
  if (!text) return jobs;
  try {
    const Json json = parse_json(*text, path);
    jobs.shards = json.at("shards").get<int>();
    jobs.cores = json.at("cores").get<int>();
    for (const Json& array : json.at("arrays"))
      jobs.arrays.push_back({array.at("id").get<std::int64_t>(), array.at("first").get<int>()});
    jobs.finish = json.at("finish").get<std::int64_t>();
    return jobs;
  } catch (const Json::exception& error) {
    throw ConfigError(
        fmt::format("{}: {} (allowed: what `solenoid compare --slurm` wrote)", path, problem_with_json(error)));
  }
}

void SlurmJobs::write(const std::string& folder) const {
  Json json = {{"shards", shards}, {"cores", cores}, {"arrays", Json::array()}, {"finish", finish}};
  for (const Array& array : arrays) json["arrays"].push_back({{"id", array.id}, {"first", array.first}});
  write_file_atomically(jobs_file(folder), json.dump(1) + "\n");
}

std::map<int, SlurmTask> SlurmJobs::tasks(std::set<std::int64_t>* known) const {
  std::map<int, SlurmTask> tasks;
  if (arrays.empty()) return tasks;
  std::map<std::int64_t, int> firsts;
  for (const Array& array : arrays) firsts[array.id] = array.first;
  std::string ids;
  for (const auto& [id, first] : firsts) ids += fmt::format("{}{}", ids.empty() ? "" : ",", id);
  const CommandOutput out = run_command(
      "squeue",
      {"-h", "-r", "-t", "all", "-j", ids, "-O", "ArrayJobID:|,ArrayTaskID:|,State:|,NodeList:|,RestartCnt:|,Reason:|"},
      client_package);
  if (!out.ok() && out.text.find("Invalid job id") != std::string::npos) return tasks;  // over so long: all forgotten
  if (!out.ok()) throw ConfigError(fmt::format("squeue does not tell what is at work: {}", out.line()));
  std::map<int, std::int64_t> latest;  // by shard: the job that its state is of
  std::istringstream lines(out.text);
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, '|');) cells.push_back(cell);
    const auto number = [&](std::size_t cell) { return std::strtoll(cells[cell].c_str(), nullptr, 10); };
    if (cells.size() < 6 || !firsts.contains(number(0))) continue;
    if (known) known->insert(number(0));
    const int shard = firsts[number(0)] + static_cast<int>(number(1));
    if (number(1) <= 0 || number(0) < latest[shard]) continue;
    latest[shard] = number(0);
    tasks[shard] = {cells[2], cells[3], cells[5], static_cast<int>(number(4))};
  }
  return tasks;
}

int max_array_size() {
  const CommandOutput out = run_command("scontrol", {"show", "config"}, client_package);
  if (!out.ok()) throw ConfigError(fmt::format("scontrol does not reach the cluster: {}", out.line()));
  std::smatch found;
  const std::regex line("MaxArraySize\\s*=\\s*([0-9]+)");
  return std::regex_search(out.text, found, line) ? std::stoi(found[1]) : usual_array_size;
}

int usual_shards(const Campaign& campaign, const SlurmSettings& settings) {
  const double tasks = std::ceil(expected_core_s(campaign) / settings.cores / usual_task_s);
  const auto most = static_cast<double>(std::min<std::size_t>(campaign.runs.size(), usual_array_size - 1));
  return static_cast<int>(std::clamp(tasks, 1.0, most));
}

SlurmPlan plan_slurm(const Campaign& campaign, const std::string& folder, const SlurmSettings& settings) {
  SlurmPlan plan{.before = SlurmJobs::of(folder), .arrays = {}};
  SlurmJobs& before = plan.before;
  if (settings.nodes > 0 && before.shards > 0 && settings.nodes != before.shards)
    throw ConfigError(fmt::format("--nodes: {} is parted into {} already (allowed: {}, or a new folder)", folder,
                                  before.shards, before.shards));
  plan.shards = before.shards > 0    ? before.shards
                : settings.nodes > 0 ? settings.nodes
                                     : usual_shards(campaign, settings);
  plan.runs = campaign.runs.size();
  StoredRuns kept(folder, campaign);
  kept.refresh();
  const std::vector<std::size_t> missing = missing_by_shard(campaign, kept, plan.shards);
  std::set<std::int64_t> known;
  const std::map<int, SlurmTask> tasks = before.tasks(&known);
  std::erase_if(before.arrays, [&](const SlurmJobs::Array& array) { return !known.contains(array.id); });
  const int most = max_array_size() - 1;
  for (int shard = 1; shard <= plan.shards; ++shard) {
    const std::size_t left = missing[static_cast<std::size_t>(shard)];
    plan.missing += left;
    if (left == 0) continue;
    const auto task = tasks.find(shard);
    if (task != tasks.end() && !task->second.over()) {
      ++plan.at_work;
      continue;
    }
    const int first = (shard - 1) / most * most;
    if (plan.arrays.empty() || plan.arrays.back().first != first) plan.arrays.push_back({first, {}});
    plan.arrays.back().tasks.push_back(shard - first);
  }
  return plan;
}

std::string array_script(const std::string& name, const std::string& folder, const SlurmSettings& s, int shards,
                         const SlurmArray& array) {
  const std::string place = absolute(folder);
  std::string text = head_of(name, s);
  text += fmt::format("#SBATCH --array={}{}\n", ranges_text(array.tasks),
                      s.throttle > 0 ? fmt::format("%{}", s.throttle) : "");
  text += limits_of(s);
  text += fmt::format("#SBATCH --nodes=1 --ntasks=1 --cpus-per-task={}\n", s.cores);
  text += "#SBATCH --requeue --open-mode=append --signal=B:USR1@60\n";
  text += "\n";
  text += fmt::format("export SOLENOID_SHARDS={} SOLENOID_FIRST_SHARD={}\n", shards, array.first);
  const std::string scratch = s.scratch.empty() ? "${TMPDIR:-/tmp}" : shell_quoted(s.scratch);
  text += fmt::format("scratch={}\n", s.scratch.empty() ? "\"" + scratch + "\"" : scratch);
  text += fmt::format(R"(again() {{  # what a task did stays; the rest is done when it runs again
  [ "${{SLURM_RESTART_COUNT:-0}}" -lt {} ] && scontrol requeue "${{SLURM_ARRAY_JOB_ID}}_$SLURM_ARRAY_TASK_ID"
}}
late= cancelled=
program=
trap 'late=yes; [ -z "$program" ] || kill -TERM "$program"' USR1       # a minute before its time is over
trap '[ -n "$late" ] || cancelled=yes; [ -z "$program" ] || kill -TERM "$program"' TERM  # scancel
{} compare {} --shard auto --out {} --scratch "$scratch" --jobs {} --traces {} --tick-limit {:g}{} &
program=$!
[ -z "$late$cancelled" ] || kill -TERM "$program"
wait "$program"; code=$?
while kill -0 "$program" 2>/dev/null; do wait "$program"; code=$?; done  # a signal ended the first wait
if [ -z "$cancelled" ] && {{ [ -n "$late" ] || [ "$code" -gt 130 ]; }}; then again; fi
exit "$code"
)",
                      most_restarts, shell_quoted(program_of(folder, s)), shell_quoted(place + "/resolved.toml"),
                      shell_quoted(place), s.cores, s.traces, s.tick_limit_s, plugin_options(program_of(folder, s)));
  return text;
}

std::string finish_script(const std::string& name, const std::string& folder, const SlurmSettings& s) {
  const std::string place = absolute(folder);
  std::vector<std::string> words = s.finish.empty() ? std::vector<std::string>{"merge", place} : s.finish;
  std::string before;  // what finishes otherwise would do by itself what is missing
  if (!s.finish.empty())
    before = fmt::format("{} status {} --whole{} || exit\n", shell_quoted(program_of(folder, s)), shell_quoted(place),
                         plugin_options(program_of(folder, s)));
  for (std::string& word : words) word = shell_quoted(word);
  return head_of(name + "-merge", s) + limits_of(s) +
         fmt::format("#SBATCH --nodes=1 --ntasks=1 --cpus-per-task={0} --open-mode=append\n\n{5}exec {1} {2}{3} >{4}\n",
                     s.cores, shell_quoted(program_of(folder, s)), fmt::join(words, " "),
                     plugin_options(program_of(folder, s)), shell_quoted(place + "/slurm/result.txt"), before);
}

std::string program_copy(const std::string& folder) {
  std::string copy = folder + "/slurm/solenoid";
  create_folder(folder + "/slurm");
  const auto copy_unless_same = [](const std::string& from, const std::string& to, bool executable) {
    const auto wanted = read_whole_file(from);
    if (!wanted) throw OutputError(fmt::format("{}: cannot be read", from));
    if (read_whole_file(to) == wanted) return;
    AtomicFile file(to, Writers::several);
    if (executable) file.make_executable();
    file.write(*wanted);
    file.close();
  };
  for (const LoadedPlugin& plugin : loaded_plugins())
    if (const std::string file = plugin_file(copy, plugin); !file.empty()) copy_unless_same(plugin.path, file, false);
  copy_unless_same(this_program(), copy, true);
  return copy;
}

SlurmJobs submit(const Campaign& campaign, const std::string& folder, const SlurmSettings& settings,
                 const SlurmPlan& plan) {
  create_folder(folder + "/slurm");
  prepare_for_shards(campaign, folder, plan.shards);
  if (settings.program.empty()) program_copy(folder);
  SlurmJobs jobs = plan.before;
  jobs.shards = plan.shards;
  jobs.cores = settings.cores;
  for (const SlurmArray& array : plan.arrays) {
    const std::string script = fmt::format("{}/slurm/array-{}.sh", folder, array.first);
    write_file_atomically(script, array_script(campaign.name, folder, settings, plan.shards, array));
    jobs.arrays.push_back({submit_script(script, output_option(folder, log_name(array.first))), array.first});
    keep_known(jobs, folder);
  }
  if (!settings.finishes) return jobs;
  std::string after = "--dependency=afterany";
  for (const SlurmJobs::Array& array : jobs.arrays) after += fmt::format(":{}", array.id);
  if (jobs.finish > 0)
    run_command("scancel", {std::to_string(jobs.finish)}, client_package);  // that of the arrays before
  const std::string script = folder + "/slurm/finish.sh";
  write_file_atomically(script, finish_script(campaign.name, folder, settings));
  std::vector<std::string> options = output_option(folder, "finish.log");
  options.push_back(after);
  jobs.finish = submit_script(script, options);
  jobs.write(folder);
  return jobs;
}

}  // namespace solenoid
