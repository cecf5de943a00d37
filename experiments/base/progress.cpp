#include "experiments/base/progress.hpp"

#include <algorithm>
#include <cstdio>

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr int bar_width = 24;

std::size_t terminal_columns() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace

Progress::Progress(std::size_t total, std::size_t reused, int between_lines_s)
    : terminal_(::isatty(STDERR_FILENO) != 0),
      between_lines_(between_lines_s),
      total_(total),
      done_(reused),
      reused_(reused) {
  if (reused > 0) std::fprintf(stderr, "%zu of %zu runs are there already\n", reused, total);
}

Progress::~Progress() { close(); }

std::string Progress::eta() const {
  const std::size_t fresh = done_ - reused_;
  if (fresh == 0) return "-:--";
  const double elapsed_s = std::chrono::duration<double>(Clock::now() - begin_).count();
  const auto left_s = static_cast<long>(elapsed_s / static_cast<double>(fresh) * static_cast<double>(total_ - done_));
  return fmt::format("{}:{:02}", left_s / 60, left_s % 60);
}

void Progress::started(const std::string& run) {
  current_ = run;
  tick();
}

void Progress::ended(const std::string& run, const std::string& status) {
  ++done_;
  const auto now = Clock::now();
  const bool troubled = status != "ok";
  if (terminal_ && troubled) {
    close();
    std::fprintf(stderr, "%s: %s\n", run.c_str(), status.c_str());
  } else if (!terminal_ && (troubled || done_ == total_ || now - last_line_ >= between_lines_)) {
    last_line_ = now;
    std::fprintf(stderr, "%zu/%zu, %s left: %s %s\n", done_, total_, eta().c_str(), run.c_str(), status.c_str());
  }
  tick();
}

void Progress::tick() {
  if (!terminal_) return;
  const std::size_t filled = bar_width * done_ / std::max<std::size_t>(total_, 1);
  std::string line = fmt::format("[{:#<{}}{:.<{}}] {}/{}  {} left  {}", "", filled, "", bar_width - filled, done_,
                                 total_, eta(), current_);
  if (const std::size_t columns = terminal_columns(); line.size() >= columns) line.resize(columns - 1);
  std::fprintf(stderr, "\r\033[K%s", line.c_str());
  std::fflush(stderr);
  open_ = true;
}

void Progress::close() {
  if (open_) std::fputs("\r\033[K", stderr);
  open_ = false;
}

}  // namespace solenoid
