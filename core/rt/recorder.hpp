#pragma once

#include "core/rt/controller.hpp"

#include <vector>

namespace solenoid {

/// A tick's timing says where its time went [us]; all is zero on a fake clock that nobody moves.
struct TickTiming {
  float late_us = 0;     ///< from the moment it was due to its beginning
  float read_us = 0;     ///< plant.read
  float control_us = 0;  ///< controller and limits
  float write_us = 0;    ///< plant.write
  float total_us() const { return read_us + control_us + write_us; }
};

/// A record holds one tick as it happened.
struct TickRecord {
  Measurement sensors;
  Decision decision;
  Command applied;  ///< after the limits
  TickTiming timing;
  int skipped = 0;  ///< ticks left out before this one
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
