#pragma once

#include <chrono>
#include <string>

namespace solenoid {

/// Progress of a campaign on standard error: one moving line on a terminal, else plain lines, not more often than every so
/// many seconds.
class Progress {
 public:
  Progress(std::size_t total, std::size_t reused, int between_lines_s = 1);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void started(const std::string& run);
  void ended(const std::string& run, const std::string& status);
  /// Redraws the moving line.
  void tick();
  /// Ends the moving line.
  void close();

 private:
  using Clock = std::chrono::steady_clock;
  std::string eta() const;

  bool terminal_;
  std::chrono::seconds between_lines_;
  std::size_t total_, done_, reused_;
  std::string current_;
  Clock::time_point begin_ = Clock::now(), last_line_{};
  bool open_ = false;
};

}  // namespace solenoid
