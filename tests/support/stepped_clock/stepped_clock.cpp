// Preloaded into the program: the wall clock jumps back by an hour one second after the first look at it, as when a
// person or NTP sets it. Each look after the jump leaves a line in the file STEPPED_CLOCK_REPORT.
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include <dlfcn.h>
#include <sys/time.h>

namespace {

using Look = int (*)(clockid_t, timespec*);

timespec look(clockid_t clock) {
  static const Look system = reinterpret_cast<Look>(dlsym(RTLD_NEXT, "clock_gettime"));
  timespec now{};
  system(clock, &now);
  return now;
}

timespec stepped_wall_clock() {
  static const timespec begin = look(CLOCK_MONOTONIC);
  const timespec now = look(CLOCK_MONOTONIC);
  timespec wall = look(CLOCK_REALTIME);
  const double passed_s =
      static_cast<double>(now.tv_sec - begin.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec - begin.tv_nsec);
  if (passed_s < 1.0) return wall;
  wall.tv_sec -= 3600;
  if (const char* report = std::getenv("STEPPED_CLOCK_REPORT"))
    if (std::FILE* file = std::fopen(report, "a")) std::fputs("an hour back\n", file), std::fclose(file);
  return wall;
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  *time = clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE ? stepped_wall_clock() : look(clock);
  return 0;
}

extern "C" time_t time(time_t* time) noexcept {
  const time_t now = stepped_wall_clock().tv_sec;
  if (time) *time = now;
  return now;
}

extern "C" int gettimeofday(timeval* time, void*) noexcept {
  const timespec now = stepped_wall_clock();
  *time = {now.tv_sec, now.tv_nsec / 1000};
  return 0;
}
