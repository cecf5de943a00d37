#include "experiments/base/result.hpp"
#include "experiments/cli/commands.hpp"
#include "experiments/cli/output_options.hpp"
#include "experiments/cli/value_kinds.hpp"
#include "experiments/systems/actuator/thesis/reproduce.hpp"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <thread>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

namespace solenoid {
namespace {

struct ReproduceOptions {
  std::vector<std::string> tables;
  OutputOptions output;
  int jobs = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
};

/// On a terminal one line that counts; otherwise a line when all is done.
void show_cases(std::size_t done, std::size_t all) {
  const bool terminal = isatty(STDERR_FILENO) != 0;
  if (terminal) fmt::print(stderr, "\rreproduce: {} of {} runs{}", done, all, done == all ? "\n" : "");
  if (!terminal && done == all) fmt::print(stderr, "reproduce: {} runs done\n", all);
  std::fflush(stderr);
}

void run_reproduce(const ReproduceOptions& options) {
  std::vector<ReproducedCase> cases;
  for (const ReproducibleTable& table : select_tables(options.tables))
    for (ReproducedCase& c : table.cases(table.name)) cases.push_back(std::move(c));
  options.output.write(result_of(reproduce(cases, options.jobs, show_cases)));
}

}  // namespace

void add_reproduce(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("reproduce", "the thesis's tables: ours beside the thesis's");
  const auto options = std::make_shared<ReproduceOptions>();
  std::string known;
  for (const ReproducibleTable& table : reproducible_tables()) known += table.name + ", ";
  command->add_option("tables", options->tables, known + "or all (default)")->type_name(value_kind::table);
  add_output_options(*command, options->output);
  add_jobs_option(*command, options->jobs);
  command->callback([options, &exit_code] {
    run_reproduce(*options);
    exit_code = success;
  });
}

}  // namespace solenoid
