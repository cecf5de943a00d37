#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

namespace solenoid {

/// Queues values from one thread to one other; neither ever waits. When it is full it refuses.
template <class T>
class Ring {
 public:
  explicit Ring(std::size_t capacity) : slots_(capacity + 1) {}

  /// Returns false and keeps nothing when the reader is `capacity` values behind.
  bool push(const T& value) noexcept {
    const std::size_t at = tail_.load(std::memory_order_relaxed), next = after(at);
    if (next == head_.load(std::memory_order_acquire)) return false;
    slots_[at] = value;
    tail_.store(next, std::memory_order_release);
    return true;
  }
  bool pop(T& value) noexcept {
    const std::size_t at = head_.load(std::memory_order_relaxed);
    if (at == tail_.load(std::memory_order_acquire)) return false;
    value = slots_[at];
    head_.store(after(at), std::memory_order_release);
    return true;
  }

 private:
  std::size_t after(std::size_t i) const noexcept { return i + 1 == slots_.size() ? 0 : i + 1; }

  std::vector<T> slots_;
  alignas(64) std::atomic<std::size_t> head_{0};
  alignas(64) std::atomic<std::size_t> tail_{0};
};

}  // namespace solenoid
