#pragma once

namespace CLI {
class App;
}

namespace solenoid {

/// Exit codes of the program.
enum ExitCode : int {
  success = 0,
  failure = 1,        ///< the command ran and found something wrong (a failed run, a failed check)
  bad_input = 2,      ///< configuration or command line refused, or output that cannot be written
  interrupted = 130,  ///< Ctrl-C; what was finished is kept
};

/// The program: reads the command line, runs one command, says on standard error what was wrong. Returns the exit code.
int run_program(int argc, char** argv);

/// Each adds one subcommand to the program; its callback leaves the exit code.
void add_compare(CLI::App& app, int& exit_code);
void add_list(CLI::App& app, int& exit_code);
void add_reproduce(CLI::App& app, int& exit_code);
void add_plot(CLI::App& app, int& exit_code);
void add_check(CLI::App& app, int& exit_code);
void add_report(CLI::App& app, int& exit_code);
void add_merge(CLI::App& app, int& exit_code);
void add_status(CLI::App& app, int& exit_code);
void add_scaling(CLI::App& app, int& exit_code);
void add_profile(CLI::App& app, int& exit_code);
void add_certify(CLI::App& app, int& exit_code);
void add_study(CLI::App& app, int& exit_code);
void add_ledger(CLI::App& app, int& exit_code);
void add_run(CLI::App& app, int& exit_code);
void add_commission(CLI::App& app, int& exit_code);
void add_emulator(CLI::App& app, int& exit_code);
void add_replay(CLI::App& app, int& exit_code);
void add_export(CLI::App& app, int& exit_code);
void add_faults(CLI::App& app, int& exit_code);
void add_chaos(CLI::App& app, int& exit_code);
void add_soak(CLI::App& app, int& exit_code);
void add_tune(CLI::App& app, int& exit_code);
void add_learn(CLI::App& app, int& exit_code);
void add_identify(CLI::App& app, int& exit_code);
void add_identify_residual(CLI::App& identify, int& exit_code);
void add_size(CLI::App& app, int& exit_code);
void add_new(CLI::App& app, int& exit_code);
void add_man(CLI::App& app, int& exit_code);
void add_completion(CLI::App& app, int& exit_code);
void add_complete(CLI::App& app, int& exit_code);  ///< hidden: what completion asks

}  // namespace solenoid
