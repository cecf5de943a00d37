#pragma once

#include <filesystem>
#include <string>

namespace solenoid {

/// Runs `script`, a file in `folder`, with the folder as working directory and without a shell. Throws ConfigError
/// naming the package if gnuplot is not installed, std::runtime_error with its first complaint if it fails.
void run_gnuplot(const std::filesystem::path& folder, const std::string& script);

/// A gnuplot string that stands for `text` and nothing else: no escape, substitution or second line.
std::string gnuplot_quoted(const std::string& text);

}  // namespace solenoid
