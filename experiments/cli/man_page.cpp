#include "experiments/cli/man_page.hpp"

#include "experiments/cli/command_tree.hpp"
#include "experiments/cli/commands.hpp"

#include <set>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

namespace solenoid {
namespace {

/// Text as roff prints it: nothing in it is a request, a minus stays one, quotes stay straight.
std::string roff(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    const bool line_begins = escaped.empty() || escaped.back() == '\n';
    escaped += c == '\\'                 ? "\\e"
               : c == '-'                ? "\\-"
               : c == '\''               ? "\\(aq"
               : c == '`'                ? "\\(ga"
               : c == '^'                ? "\\(ha"
               : c == '~'                ? "\\(ti"
               : c == '.' && line_begins ? "\\&."
                                         : std::string(1, c);
  }
  return escaped;
}

std::string bold(const std::string& text) { return "\\fB" + roff(text) + "\\fR"; }
std::string italic(const std::string& text) { return "\\fI" + roff(text) + "\\fR"; }

std::string paragraph(const std::string& text) { return ".P\n" + roff(text) + "\n"; }
std::string entry(const std::string& label, const std::string& text) {
  return ".TP\n" + label + "\n" + roff(text) + "\n";
}
std::string code(const std::string& lines) { return ".P\n.RS\n.nf\n" + roff(lines) + "\n.fi\n.RE\n"; }

/// "--svg, --png" of an option group or of what an option excludes.
template <class Options>
std::string names_of(const Options& options) {
  std::set<std::string> names;
  for (const CLI::Option* option : options) names.insert(option->get_name());
  return fmt::format("{}", fmt::join(names, ", "));
}

/// What --help says of an option in brackets and capitals, as sentences.
std::string conditions_of(const CLI::Option& option) {
  std::string text;
  if (const auto values = allowed_values(option); !values.empty())
    text += fmt::format(" Allowed: {}.", fmt::join(values, ", "));
  if (const std::string range = allowed_range(option); !range.empty()) text += fmt::format(" Allowed: {}.", range);
  if (option.get_delimiter() != '\0') text += fmt::format(" Several, with '{}' between them.", option.get_delimiter());
  if (option.get_required() && option.nonpositional()) text += " Required.";
  if (!option.get_needs().empty()) text += fmt::format(" Only with {}.", names_of(option.get_needs()));
  if (!option.get_excludes().empty()) text += fmt::format(" Not with {}.", names_of(option.get_excludes()));
  return text;
}

std::string description_of(const CLI::Option& option) {
  const std::string& text = option.get_description();
  const std::string more = conditions_of(option);
  return text + (!more.empty() && !text.ends_with('.') ? "." : "") + more;
}

std::string label_of(const CLI::Option& option) {
  if (option.get_positional()) return italic(option.get_name(true)) + " (" + roff(kind_of(option)) + ")";
  std::string label;
  for (const std::string& name : option.get_snames()) label += bold("-" + name) + ", ";
  for (const std::string& name : option.get_lnames()) label += bold("--" + name) + ", ";
  label.resize(label.size() - 2);
  if (takes_value(option)) label += " " + italic(kind_of(option));
  return label + (takes_several(option) ? " ..." : "");
}

/// The command's options but --help, which every command has.
std::vector<const CLI::Option*> own_options(const CLI::App& command) {
  std::vector<const CLI::Option*> options = options_of(command);
  std::erase(options, command.get_help_ptr());
  return options;
}

std::string usage_of(const CLI::App& command) {
  std::string usage = bold(words_of(command));
  if (!own_options(command).empty()) usage += " [" + italic("OPTIONS") + "]";
  for (const CLI::Option* positional : positionals_of(command)) {
    const std::string name = italic(positional->get_name(true)) + (takes_several(*positional) ? "..." : "");
    usage += positional->get_required() ? " " + name : " [" + name + "]";
  }
  return usage + (commands_of(command).empty() ? "" : " " + italic("COMMAND"));
}

std::string section_of(const CLI::App& command) {
  std::string text = ".SS " + usage_of(command) + "\n" + roff(command.get_description()) + "\n";
  for (const CLI::Option* positional : positionals_of(command))
    text += entry(label_of(*positional), description_of(*positional));
  for (const CLI::Option* option : own_options(command)) text += entry(label_of(*option), description_of(*option));
  for (const CLI::App* group : command.get_subcommands([](const CLI::App* part) { return part->get_name().empty(); }))
    if (group->get_require_option_min() > 0)
      text +=
          paragraph(fmt::format("{} of {} is required.", group->get_require_option_max() == 1 ? "One" : "At least one",
                                names_of(own_options(*group))));
  if (const std::string footer = command.get_footer(); !footer.empty()) text += paragraph(footer);
  for (const CLI::App* inner : commands_of(command)) text += section_of(*inner);
  return text;
}

std::string beginning(const CLI::App& app, const std::string& version) {
  const std::string about = app.get_description();
  return fmt::format(
             ".TH SOLENOID 1 \"\" \"solenoid {}\" \"User Commands\"\n.nh\n.ad l\n.SH NAME\nsolenoid \\- {}\n.SH "
             "SYNOPSIS\n{} {}\n",
             roff(version), roff(about.substr(about.find(": ") + 2)), usage_of(app), italic("[ARGUMENTS]")) +
         ".SH DESCRIPTION\n" +
         roff(
             "Solenoid compares controllers of actuators whose inputs switch: on/off valves, alone or beside a "
             "continuous "
             "input. It runs them in simulation or in real time, ranks them, reports on the runs, and reproduces the "
             "tables of the thesis that its first system, a pneumatic cylinder helped by a motor, comes from.\n") +
         paragraph(
             "Results go to standard output, progress and errors to standard error. What a word stands for: a "
             "VARIANT is a controller with its numbers, a SCENARIO a task with its plant, a CAMPAIGN variants times "
             "scenarios; `solenoid list` shows those that are shipped. A file that is refused is named with its "
             "line, its key and what is allowed.");
}

std::string global_options(const CLI::App& app) {
  std::string text = ".SH OPTIONS\n";
  for (const CLI::Option* option : options_of(app)) text += entry(label_of(*option), description_of(*option));
  return text + paragraph("Every command has --help.");
}

std::string exit_status() {
  const auto code = [](ExitCode value, const char* meaning) { return entry(bold(std::to_string(value)), meaning); };
  return ".SH EXIT STATUS\n" + code(success, "The command did what it was asked.") +
         code(failure, "The command ran and found something wrong: a failed run, a failed check, a slower profile.") +
         code(bad_input, "The command line or a file was refused, or output could not be written. Nothing was run.") +
         code(interrupted, "Ctrl-C. What was finished is kept, and the same command with --out resumes.");
}

std::string surroundings() {
  return ".SH ENVIRONMENT\n" + entry(bold("NO_COLOR"), "If it is set, tables on a terminal have no colours.") +
         entry(bold("PATH"), "Where gnuplot is looked for, which draws figures (--svg, --png, --pareto).") +
         ".SH FILES\n" +
         entry(bold("results/") + italic("NAME") + roff("-") + italic("TIME"),
               "A command's results unless --out names another folder: resolved.toml, manifest.json, runs in shards/, "
               "and "
               "runs.csv once all have ended.") +
         entry(bold("share/doc/solenoid/docs"),
               "Below the installation's prefix: the pages that are cited here as docs/..., among them every key of "
               "campaign files, docs/reference/configuration.md.") +
         entry(bold("libcomedi.so.0"), "Loaded for --plant comedi alone.");
}

std::string ending() {
  return ".SH EXAMPLES\n" +
         roff("The shipped variants on the shipped scenarios, ranked, and a page of it to open in a browser:\n") +
         code("solenoid compare --out results/mine\nsolenoid report results/mine") +
         paragraph("Two variants on one scenario, as CSV:") +
         code("solenoid compare --variant thesis_pd,nine_state --scenario sine --format csv") +
         paragraph("A variant in real time on the simulated twin:") + code("solenoid run nine_state --plant sim") +
         paragraph("What a campaign file of one's own says, checked without running it:") +
         code("solenoid check mine.toml") + ".SH SEE ALSO\n" + ".BR gnuplot (1),\n.BR bash (1)\n";
}

}  // namespace

std::string man_page(const CLI::App& app, const std::string& version) {
  std::string commands = ".SH COMMANDS\n";
  for (const CLI::App* command : commands_of(app)) commands += section_of(*command);
  return beginning(app, version) + global_options(app) + commands + exit_status() + surroundings() + ending();
}

}  // namespace solenoid
