#pragma once

#include "core/rt/controller.hpp"

#include <vector>

namespace solenoid {

/// One tick as it happened.
struct TickRecord {
  Sensors sensors;
  Decision decision;
  Command applied;  ///< after the limits
};

/// Keeps ticks in memory, sized once; full, it counts what it drops.
class MemoryRecorder {
 public:
  explicit MemoryRecorder(std::size_t capacity) { records_.reserve(capacity); }
  void record(const TickRecord& tick) noexcept {
    if (records_.size() < records_.capacity())
      records_.push_back(tick);
    else
      ++dropped_;
  }
  const std::vector<TickRecord>& records() const { return records_; }
  std::size_t dropped() const { return dropped_; }

 private:
  std::vector<TickRecord> records_;
  std::size_t dropped_ = 0;
};

}  // namespace solenoid
