#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace solenoid {

/// How large a file may be, by what it is. Files come from anywhere: none is read before it is known to be within.
namespace file_size {
inline constexpr std::size_t megabyte = 1'000'000;          ///< in bytes
inline constexpr std::size_t configuration = 4 * megabyte;  ///< TOML, which takes a hundred times its size in memory
inline constexpr std::size_t record = megabyte;             ///< JSON of one run
inline constexpr std::size_t json = 64 * megabyte;          ///< any other JSON
inline constexpr std::size_t linked = 64 * megabyte;        ///< what TOML names: a trajectory of three million points
inline constexpr std::size_t trace = 64 * megabyte;         ///< compressed; an hour of ticks has 3
inline constexpr std::size_t instances = 64 * megabyte;     ///< eighty times the shipped ones
inline constexpr std::size_t plugin = 512 * megabyte;       ///< a shared object with what debuggers need
inline constexpr std::size_t any = 4096 * megabyte;         ///< what no reader below bounds
}  // namespace file_size

/// Returns the whole of a regular file, or nothing if it is not there or may not be read. Never waits. Throws ConfigError
/// for a device, a pipe, a socket, and for a file of more than `most_bytes`.
std::optional<std::string> read_whole_file(const std::string& path, std::size_t most_bytes = file_size::any);

}  // namespace solenoid
