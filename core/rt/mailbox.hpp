#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace solenoid {

/// Hands the newest value from one thread to one other; neither ever waits. A value that nobody took before the next
/// was put is lost, which is the purpose: an old plan is of no use beside a newer one.
///
///     writer   box.back() = ...; box.put();                    reader   if (box.take()) ... box.front() ...
///
/// There are three copies of T: the writer's, the reader's, and the one between them, exchanged by one atomic
/// operation.
template <class T>
class Mailbox {
 public:
  /// Every copy starts as `value`, and so sized: assigning into it need not allocate.
  explicit Mailbox(const T& value = {}) : copies_{value, value, value} {}

  T& back() noexcept { return copies_[back_]; }
  void put() noexcept { back_ = between_.exchange(back_ | fresh, std::memory_order_acq_rel) & index; }

  /// Returns whether there was something new; it is in front() until the next take().
  bool take() noexcept {
    if (!(between_.load(std::memory_order_relaxed) & fresh)) return false;
    front_ = between_.exchange(front_, std::memory_order_acq_rel) & index;
    return true;
  }
  const T& front() const noexcept { return copies_[front_]; }
  T& front() noexcept { return copies_[front_]; }

 private:
  static constexpr std::uint32_t fresh = 4, index = 3;
  std::array<T, 3> copies_;
  alignas(64) std::atomic<std::uint32_t> between_{1};
  alignas(64) std::uint32_t back_ = 0;
  alignas(64) std::uint32_t front_ = 2;
};

}  // namespace solenoid
