#include "experiments/base/files.hpp"

#include "experiments/base/machine.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace solenoid {
namespace {

[[noreturn]] void refuse(const std::string& path, int error) {
  throw OutputError(fmt::format("{}: cannot be written: {}", path, std::strerror(error)));
}

/// 0, or the errno of the first failure.
int write_all(int file, std::string_view text) {
  while (!text.empty()) {
    const ssize_t n = ::write(file, text.data(), text.size());
    if (n > 0)
      text.remove_prefix(static_cast<std::size_t>(n));
    else if (n == 0 || errno != EINTR)
      return n == 0 ? EIO : errno;
  }
  return 0;
}

/// The same.
int sync_and_close(OpenFile file) {
  int error = ::fsync(file.descriptor()) != 0 && errno != EINVAL ? errno : 0;
  if (::close(file.release()) != 0 && error == 0) error = errno;
  return error;
}

std::string temporary_of(const std::string& path, Writers writers) {
  if (writers == Writers::one) return path + ".tmp";
  return fmt::format("{}.{}-{}.tmp", path, machine_name(), ::getpid());
}

/// So that a file's new name outlasts a loss of power; where folders cannot be synced nothing is asked.
void sync_folder_of(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const OpenFile file(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (file) ::fsync(file.descriptor());
}

}  // namespace

bool take_lock(const OpenFile& file, FileLock lock) {
  const int wanted = lock == FileLock::alone ? LOCK_EX : LOCK_SH;
  return ::flock(file.descriptor(), wanted | LOCK_NB) == 0 || errno != EWOULDBLOCK;
}

void require_no_device(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || S_ISREG(status.st_mode) || S_ISDIR(status.st_mode)) return;
  const char* kind = S_ISFIFO(status.st_mode) ? "a pipe" : S_ISSOCK(status.st_mode) ? "a socket" : "a device";
  throw OutputError(fmt::format("{}: is {} (allowed: a regular file)", path, kind));
}

void write_file_atomically(const std::string& path, std::string_view text, Writers writers) {
  AtomicFile file(path, writers);
  file.write(text);
  file.close();
}

AtomicFile::AtomicFile(std::string path, Writers writers)
    : path_(std::move(path)), temporary_(temporary_of(path_, writers)) {
  require_no_device(temporary_);
  file_ = OpenFile(::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (!file_) refuse(path_, errno);
}

AtomicFile::~AtomicFile() {
  if (file_) ::unlink(temporary_.c_str());
}

void AtomicFile::write(std::string_view text) {
  constexpr std::size_t at_once = 1 << 16;
  if (buffer_.size() + text.size() < at_once) {
    buffer_ += text;
    return;
  }
  flush();
  if (const int error = write_all(file_.descriptor(), text)) refuse(path_, error);
}

void AtomicFile::flush() {
  if (const int error = write_all(file_.descriptor(), buffer_)) refuse(path_, error);
  buffer_.clear();
}

void AtomicFile::close() {
  flush();
  int error = sync_and_close(std::move(file_));
  if (error == 0 && std::rename(temporary_.c_str(), path_.c_str()) != 0) error = errno;
  if (error == 0) return sync_folder_of(path_);
  ::unlink(temporary_.c_str());
  refuse(path_, error);
}

void AtomicFile::make_executable() {
  if (::fchmod(file_.descriptor(), 0755) != 0) refuse(path_, errno);
}

void create_folder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (!error && !std::filesystem::is_directory(path, error)) error = std::make_error_code(std::errc::not_a_directory);
  if (error) throw OutputError(fmt::format("{}: folder cannot be made: {}", path, error.message()));
}

TemporaryFolder::TemporaryFolder() {
  std::error_code error;
  std::filesystem::path base = std::filesystem::temp_directory_path(error);
  if (error) base = "/tmp";
  const std::string pattern = (base / "solenoid-XXXXXX").string();
  std::vector<char> name(pattern.begin(), pattern.end());
  name.push_back('\0');
  if (mkdtemp(name.data()) == nullptr)
    throw OutputError(fmt::format("no temporary folder in {}: {}", base.string(), std::strerror(errno)));
  path_ = name.data();
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

void write_standard_output(std::string_view text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), stdout) == text.size();
  if (!written || std::fflush(stdout) != 0) refuse("standard output", errno);
}

std::string Fingerprint::text() const { return fmt::format("{:016x}", hash_); }

std::string fingerprint(std::string_view text) {
  Fingerprint of_one;
  of_one.add(text);
  return of_one.text();
}

}  // namespace solenoid
