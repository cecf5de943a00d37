#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace solenoid {

/// How a filter takes values that were measured before the tick they arrive in: it stands at the tick that the newest
/// of them were of, and what it says of the present is its prediction from there under the inputs that have acted
/// since.
///
///     a value of age tau = a ticks    belongs to the tick k - m, m the whole number next to a
///     the filter                      is predicted to k - m, and corrected there: z - h' x[k - m] + (a - m) h' dx,
///                                     dx the change of its last tick: the rest of the age, at most half a tick
///     the present                     m ticks of the model further, the mean alone
///
/// For whole ages and values that come in the order in which they were measured (which is what an I/O with a clock of
/// its own gives: the newest, or nothing) this is the optimal filter, that of the system augmented with its past: no
/// value is older than the last, so nothing has to be taken back (what is to be done otherwise: Bar-Shalom, IEEE Trans.
/// Aerospace and Electronic Systems 38 (2002) 769). To correct the present by the old innovation with the gain of the
/// present (Alexander 1991; Larsen, Andersen, Ravn and Poulsen, CDC 1998, with M = I) is cheaper and was tried: it does
/// for the position, 9 % above the optimum at 3 ms, and fails for pressures behind an eighth-order filter of 50 Hz,
/// whose transition over 2 ms is nothing like the identity. Age 0: the filter stands at the present, to the last bit as
/// without this.
///
/// This is the bookkeeping: how far behind the filter stands, and the inputs of the ticks between.
///
/// promise   no allocation, lock or exception
template <class Inputs>
class LateValues {
 public:
  /// Values that are older than so many ticks say nothing any more.
  static constexpr int most_ticks = 16;

  /// What is usual is the greatest age of so many values, or of up to twice as many: a single late one is forgotten.
  static constexpr int usual_values = 256;

  /// The tick that an age belongs to: so many ticks back.
  static int whole_ticks(double age_ticks) noexcept {
    return static_cast<int>(std::min(std::round(std::max(0.0, age_ticks)), 1.0 * most_ticks));
  }
  /// Begins anew, so many ticks before the present, fewer than most_ticks: where the values are of that start it.
  void start(int behind = 0) noexcept {
    behind_ = recent_ = behind;
    earlier_ = counted_ = 0;
  }
  /// These inputs acted in the tick that has passed, whether or not the filter goes on from where it stood.
  void remember(const Inputs& inputs) noexcept {
    newest_ = (newest_ + 1) % most_ticks;
    inputs_[static_cast<std::size_t>(newest_)] = inputs;
  }
  /// A tick has passed under these inputs.
  void passed(const Inputs& inputs) noexcept {
    remember(inputs);
    ++behind_;
  }
  /// Where a tick's values belong: so many ticks back. `age_ticks`: theirs; `any`: whether there are any. Those that
  /// are older than what the filter has seen are none. Without values the filter stays as far behind as they usually
  /// are.
  int aim(double age_ticks, bool any) noexcept {
    const int whole = whole_ticks(age_ticks);
    const bool known = any && whole < most_ticks;
    if (known) count(whole);  // also where the filter began too late for them
    taken_ = known && whole <= behind_;
    const int back = taken_ ? whole : std::min(behind_, std::max(recent_, earlier_));
    rest_ = taken_ ? std::max(0.0, age_ticks) - whole : 0.0;
    return back;
  }
  /// Whether the values of the last aim() are to be used, and the rest of their age [ticks].
  bool taken() const noexcept { return taken_; }
  double rest() const noexcept { return rest_; }

  /// How many ticks the filter stands behind the present.
  int behind() const noexcept { return behind_; }
  /// The inputs of the tick that begins `ticks` before the present.
  const Inputs& inputs(int ticks) const noexcept {
    return inputs_[static_cast<std::size_t>((newest_ - (ticks - 1) + most_ticks) % most_ticks)];
  }
  /// The filter has been predicted by a tick.
  void caught_up() noexcept { --behind_; }

 private:
  void count(int age) noexcept {
    recent_ = std::max(recent_, age);
    if (++counted_ < usual_values) return;
    earlier_ = recent_;
    recent_ = counted_ = 0;
  }

  std::array<Inputs, most_ticks> inputs_{};
  int newest_ = 0, behind_ = 0;
  int recent_ = 0, earlier_ = 0, counted_ = 0;  // greatest ages of the values being counted, and of those before
  double rest_ = 0.0;
  bool taken_ = false;
};

}  // namespace solenoid
