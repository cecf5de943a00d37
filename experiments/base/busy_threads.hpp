#pragma once

#include <thread>
#include <vector>

namespace solenoid {

/// Threads that compute nothing for as long as it lives: other work on the same processors.
class BusyThreads {
 public:
  explicit BusyThreads(int count) {
    threads_.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i)
      threads_.emplace_back([](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
        }
      });
  }

 private:
  std::vector<std::jthread> threads_;
};

}  // namespace solenoid
