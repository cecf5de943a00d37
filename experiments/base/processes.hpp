#pragma once

#include <functional>
#include <span>
#include <string>

namespace solenoid {

/// How one piece of work ended.
struct Outcome {
  bool done = false;
  std::string text;  ///< what the work returned, or why there is nothing
};

/// What a pool calls back, all of it in the calling process.
struct PoolEvents {
  std::function<void(std::size_t item, const Outcome& outcome)> ended;
  std::function<void(std::size_t item)> started = [](std::size_t) {};
  std::function<void()> waiting = [] {};  ///< a few times a second
  std::function<bool()> interrupted;      ///< asked between events; true ends the workers
  double most_silence_s = 600.0;          ///< a worker that does not say for so long that it goes on is ended; 0: never
};

/// What a program inside another, whose threads and locks no fork may break, does around the fork of a worker.
struct ForkHooks {
  std::function<void()> before, in_parent, in_child;
  std::function<void()> child_ends;  ///< in the worker, its work done
};
/// From now on around every fork.
void around_forks(ForkHooks hooks);

/// Work says that it goes on, and is not stuck; nothing outside of a worker.
void work_goes_on() noexcept;

/// Does work(item) for each of `items`, each in a process of its own, at most `jobs` at a time: an exception, a crash
/// or silence is that item's outcome and no other's. Returns whether all was done; false when interrupted. What `ended` throws
/// ends the workers and is thrown on. No process outlives the call.
bool work_in_processes(std::span<const std::size_t> items, int jobs,
                       const std::function<std::string(std::size_t item)>& work, const PoolEvents& events);

}  // namespace solenoid
