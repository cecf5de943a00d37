#pragma once

#include "core/config/open_file.hpp"
#include "core/config/whole_file.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace solenoid {

/// Something that cannot be written: one line with the file and the system's reason.
class OutputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Whether a file is for its owner alone, or for all who share it.
enum class FileLock { alone, shared };
/// Locks a file until it is closed; false if another process has it. True too where the file system has no locks.
bool take_lock(const OpenFile& file, FileLock lock);

/// Throws OutputError for a pipe, a device or a socket, on which a writer would wait, or do something else than write.
void require_no_device(const std::string& path);

/// Who may write a file at the same time: one process, or several, on other machines too, that write the same.
enum class Writers { one, several };

/// Replaces a file whole or not at all: writes a temporary neighbour, syncs and renames it. Throws OutputError.
void write_file_atomically(const std::string& path, std::string_view text, Writers writers = Writers::one);

/// A file that is written piece by piece and appears under its name whole, or not at all, when it is closed.
class AtomicFile {
 public:
  /// Throws OutputError.
  explicit AtomicFile(std::string path, Writers writers = Writers::one);
  /// Has it be a program once it is closed.
  void make_executable();
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Throws OutputError.
  void write(std::string_view text);
  /// Syncs and renames it. Throws OutputError.
  void close();

 private:
  void flush();

  std::string path_, temporary_, buffer_;
  OpenFile file_;
};

/// Creates a folder and its parents. Throws OutputError.
void create_folder(const std::string& path);

/// A folder of its own for temporary files, removed with everything in it at the end of its life.
class TemporaryFolder {
 public:
  /// Throws OutputError if none can be made.
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Writes to standard output and checks that it arrived. Throws OutputError.
void write_standard_output(std::string_view text);

/// 64-bit FNV-1a of texts one after another: names a configuration, no defence against forgery.
class Fingerprint {
 public:
  void add(std::string_view text) {
    for (const char c : text) hash_ = (hash_ ^ static_cast<unsigned char>(c)) * 1099511628211u;
  }
  /// In hexadecimal.
  std::string text() const;

 private:
  std::uint64_t hash_ = 14695981039346656037u;
};

/// That of one text.
std::string fingerprint(std::string_view text);

}  // namespace solenoid
