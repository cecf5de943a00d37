#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace solenoid {

/// What can stand at the end of `words`, those after the program's name; the last one is begun, or empty. Each is a word
/// to put in its place, or one of
///
///     :files ENDING     files with that ending (all, if it is empty)
///     :folders
///
/// for the shell, which knows its files best. After "--option=" it is what follows the "=".
std::vector<std::string> completions(const CLI::App& app, const std::vector<std::string>& words);

}  // namespace solenoid
