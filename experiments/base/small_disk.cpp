#include "experiments/base/small_disk.hpp"

#include "experiments/base/files.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>

#include <sched.h>
#include <sys/mount.h>
#include <unistd.h>

namespace solenoid {

SmallDisk::SmallDisk(std::string folder) : folder_(std::move(folder)) {
  create_folder(folder_);
  own_ = ::unshare(CLONE_NEWNS) == 0 && ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
         ::mount("tmpfs", folder_.c_str(), "tmpfs", 0, "size=96m") == 0;
  if (!own_) why_ = std::strerror(errno);
}

SmallDisk::~SmallDisk() {
  if (own_) ::umount2(folder_.c_str(), MNT_DETACH);
}

void SmallDisk::fill() const {
  std::ofstream out(folder_ + "/filler", std::ios::binary);
  const std::string block(1 << 16, 'x');
  while (out.write(block.data(), std::ssize(block)).flush()) {
  }
}

void SmallDisk::give_back() const { ::unlink((folder_ + "/filler").c_str()); }

}  // namespace solenoid
