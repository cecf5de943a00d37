#include "experiments/campaign/shard_scratch.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/files.hpp"
#include "experiments/base/machine.hpp"
#include "experiments/campaign/shard_file.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

namespace solenoid {
namespace {

namespace fs = std::filesystem;

/// A folder of that name that is this user's alone; where somebody else has taken the name, another.
fs::path own_folder(const fs::path& wanted) {
  struct stat status {};
  const bool made = ::mkdir(wanted.c_str(), 0700) == 0 || errno == EEXIST;
  if (made && ::lstat(wanted.c_str(), &status) == 0 && S_ISDIR(status.st_mode) && status.st_uid == ::geteuid() &&
      (status.st_mode & 0077) == 0)
    return wanted;
  std::string pattern = wanted.string() + "-XXXXXX";
  if (::mkdtemp(pattern.data()) == nullptr)
    throw OutputError(fmt::format("{}: folder cannot be made: {}", wanted.string(), std::strerror(errno)));
  return pattern;
}

/// Locks a file that is made for it; none: somebody else has it.
OpenFile lock_of(const std::string& path) {
  OpenFile file(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (!file) throw OutputError(fmt::format("{}: cannot be written: {}", path, std::strerror(errno)));
  return take_lock(file, FileLock::alone) ? std::move(file) : OpenFile();
}

}  // namespace

ShardScratch::ShardScratch(const std::string& scratch, const std::string& file) : file_(file) {
  create_folder(scratch);
  const std::string whose = fingerprint(fs::weakly_canonical(fs::absolute(file)).string());
  const fs::path place = own_folder(fs::path(scratch) / fmt::format("solenoid-{}-{}", ::geteuid(), whose));
  path_ = (place / fs::path(file).filename()).string();
  lock_ = lock_of(path_ + ".lock");
  if (!lock_) {  // a process that is at the same shard, here and now
    path_ += fmt::format("-{}", ::getpid());
    lock_ = lock_of(path_ + ".lock");
  }
  left_before_ = fs::exists(path_ + ".runs");
}

ShardScratch::~ShardScratch() {
  std::error_code ignored;
  if (!fs::exists(path_ + ".runs", ignored)) ::unlink((path_ + ".lock").c_str());
  fs::remove(fs::path(path_).parent_path(), ignored);  // if nobody else is in it
}

void ShardScratch::put_back(bool written) {
  const std::string runs = path_ + ".runs";
  if (!fs::exists(runs)) {
    if (!written) return;
    throw OutputError(fmt::format("{}: is gone, and with it what was done (on {})", runs, machine_name()));
  }
  try {
    try {
      append_shard(path_, file_);
    } catch (const FileInUse&) {
      append_shard(path_, fmt::format("{}.{}-{}", file_, machine_name(), ::getpid()));
    }
  } catch (const std::exception& error) {
    throw OutputError(fmt::format("{}; what was done is in {} on {}", error.what(), runs, machine_name()));
  }
  for (const char* ending : {".traces", ".runs"}) ::unlink((path_ + ending).c_str());
}

}  // namespace solenoid
