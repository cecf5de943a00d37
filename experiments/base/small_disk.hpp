#pragma once

#include <string>

namespace solenoid {

/// A small file system of its own where the system allows it, so that a disk can be full and nobody else's is.
class SmallDisk {
 public:
  /// Mounted on this folder, seen by this process and those it starts.
  explicit SmallDisk(std::string folder);
  ~SmallDisk();
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  bool own() const { return own_; }
  /// Why there is none of its own.
  const std::string& why() const { return why_; }
  void fill() const;
  void give_back() const;

 private:
  std::string folder_, why_;
  bool own_ = false;
};

}  // namespace solenoid
