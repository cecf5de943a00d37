#pragma once

#include <utility>
#include <vector>

namespace solenoid::test {

/// What a delay line means, edge by edge: a command schedules its edges, and drops those scheduled at or after them.
class NaiveLine {
 public:
  explicit NaiveLine(bool on) : now_(on), commanded_(on) {}
  void command(bool on, int rise, int fall) {
    if (on == commanded_) return;
    commanded_ = on;
    changed_at_ = time_;
    const int due = time_ + (on ? rise : fall);
    std::erase_if(edges_, [&](const auto& edge) { return edge.first >= due; });
    edges_.push_back({due, on});
    apply();
  }
  void advance() { ++time_, apply(); }
  bool effective(int ahead) const {
    bool state = now_;
    for (const auto& [due, on] : edges_)
      if (due <= time_ + ahead) state = on;
    return state;
  }
  bool free(int dwell) const { return time_ - changed_at_ >= dwell; }
  bool commanded() const { return commanded_; }

 private:
  void apply() {
    while (!edges_.empty() && edges_.front().first <= time_) now_ = edges_.front().second, edges_.erase(edges_.begin());
  }
  int time_ = 0, changed_at_ = -1'000'000;
  bool now_, commanded_;
  std::vector<std::pair<int, bool>> edges_;
};

}  // namespace solenoid::test
