#pragma once

#include <cstddef>
#include <cstdlib>
#include <memory>
#include <vector>

namespace solenoid::qp {

/// Zeroed doubles on cache-line boundaries, padded to whole vectors; owned by the solver that carved them at setup.
class Workspace {
 public:
  static int padded(int size) { return (size + 7) / 8 * 8; }

  double* carve(int size, double value = 0.0) {
    const auto count = static_cast<std::size_t>(padded(size) + 8);
    blocks_.emplace_back(static_cast<double*>(::operator new(count * sizeof(double), alignment)));
    for (std::size_t i = 0; i < count; ++i) blocks_.back()[i] = value;
    return blocks_.back().get();
  }
  void clear() { blocks_.clear(); }

 private:
  static constexpr std::align_val_t alignment{64};
  struct Release {
    void operator()(double* block) const { ::operator delete(block, alignment); }
  };
  std::vector<std::unique_ptr<double[], Release>> blocks_;
};

}  // namespace solenoid::qp
