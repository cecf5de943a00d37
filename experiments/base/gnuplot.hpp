#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace solenoid {

/// Runs `script`, a file in `folder`, with the folder as working directory and without a shell. Throws ConfigError
/// naming the package if gnuplot is not installed, std::runtime_error with its first complaint if it fails.
void run_gnuplot(const std::filesystem::path& folder, const std::string& script);

/// Draws into `path`, whole or not at all: `script` sets its output to 'figure' and finds `files`, text by name, beside
/// it. Throws what run_gnuplot does, and OutputError.
void draw_with_gnuplot(const std::map<std::string, std::string>& files, const std::string& script,
                       const std::string& path);

/// A gnuplot string that stands for `text` and nothing else: no escape, substitution or second line.
std::string gnuplot_quoted(const std::string& text);

}  // namespace solenoid
