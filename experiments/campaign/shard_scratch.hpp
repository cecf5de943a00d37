#pragma once

#include "core/config/open_file.hpp"

#include <string>

namespace solenoid {

/// A shard's files near the processor, until they are put into the folder that all shards share. They lie in a place of
/// this user's own, which this object has to itself.
class ShardScratch {
 public:
  /// `file`: the shard's files in that folder, without ending. What an earlier process of this machine has left below
  /// `scratch`, which did not come to put it back, is taken up. Throws OutputError.
  ShardScratch(const std::string& scratch, const std::string& file);
  ~ShardScratch();
  ShardScratch(const ShardScratch&) = delete;
  ShardScratch& operator=(const ShardScratch&) = delete;

  /// The files here, without ending.
  const std::string& path() const { return path_; }
  /// Whether something was left here.
  bool left_before() const { return left_before_; }
  /// Appends what is here to the shard's files in the folder, and leaves nothing here. While another process has those, it
  /// goes beside them, under this machine's name. `written`: something must be here. Throws OutputError saying where the
  /// work is now.
  void put_back(bool written);

 private:
  std::string file_, path_;
  OpenFile lock_;
  bool left_before_ = false;
};

}  // namespace solenoid
