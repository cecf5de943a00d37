#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace solenoid {

/// The command line as --help shows it, for what else is made of it: the manual page and completion.
/// Hidden commands and options are left out; the options of a nameless group count as its command's.
std::vector<const CLI::App*> commands_of(const CLI::App& app);
std::vector<const CLI::Option*> options_of(const CLI::App& app);
std::vector<const CLI::Option*> positionals_of(const CLI::App& app);

/// The command's words as they are typed: "solenoid study horizon".
std::string words_of(const CLI::App& app);

bool takes_value(const CLI::Option& option);

/// Whether one mention of the option takes several values, a word each.
bool takes_several(const CLI::Option& option);

/// What kind of value it is: a value_kind, or TEXT, INT, UINT, FLOAT.
std::string kind_of(const CLI::Option& option);

/// The values of an option that has a known set of them; none for one that has not.
std::vector<std::string> allowed_values(const CLI::Option& option);

/// The limits of a number, "1 to 1024" or "more than 0"; empty for one without.
std::string allowed_range(const CLI::Option& option);

}  // namespace solenoid
