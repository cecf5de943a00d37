#pragma once

#include "solvers/rounding/linear_plant.hpp"
#include "solvers/rounding/modulator.hpp"

#include <array>
#include <span>
#include <vector>

namespace solenoid {

/// Relaxed switch states as modes a step each by the optimal dynamic quantiser of the linearised plant: the error that
/// quantising leaves in the plant's state is known, and the mode is taken that keeps it out of the outputs.
///                                                                                        [theory-relaxed.md, sect. 6]
///
///     xi+ = A xi + B (v - w),    v = argmin over the modes that may be commanded  sum_{i <= L} |C xi(i)|^2_weight
///
/// with w what is wanted in effect, v what is, xi(i) the error i steps on. For a plant of relative degree
/// d whose commands act at once L = d: only the last term then depends on v, and the least of |C A^d xi +
/// C A^(d-1) B (v - w)| is the quantiser of the papers, which no other beats in the largest output error where every
/// level may be had. With delays and dwells L is longer by the steps until a change either way could have been taken
/// back; the candidates go through the edges in flight, each with the best moment for one change more, as in
/// DeltaSigma.
///
/// A change has a price beside the squared errors of the L steps: the edge price times what a step of that switch does
/// to them within d steps. So it means the same as with DeltaSigma.
///
/// State. What a plan so far has left in the plant's state is in the state that the next problem begins with; xi begins
/// anew with what the relaxation cannot know, the on-times that are owed, each as if it had been missing in the last
/// step: xi = -B owed.
///
/// S. Azuma, T. Sugie, "Optimal dynamic quantizers for discrete-valued input control", Automatica 44 (2008) 396-406;
/// "Synthesis of optimal dynamic quantizers for discrete-valued input control", IEEE Transactions on Automatic Control
/// 53 (2008) 2064-2075.
class DynamicQuantiser final : public Modulator {
 public:
  /// A change of mode has to gain this share of the weighted error.
  static constexpr double least_gain = 1e-9;

  /// plant        sized for the problems; filled anew before each round
  /// edge_price   of each change, in squared steps that are owed
  explicit DynamicQuantiser(LinearPlant plant, double edge_price = 0.0)
      : plant_(std::move(plant)), edge_price_(edge_price) {}

  void prepare(const ModeSet& modes, const SwitchTiming& timing, const RelaxedGrid& grid) override;
  void round(const ModeSet& modes, const DelayLines& lines, std::span<const double> weights,
             const ModulatorState& at_begin, std::span<int> mode, std::span<SwitchStates<double>> owed,
             std::span<SwitchStates<double>> owed_sum) noexcept override;
  LinearPlant* plant() noexcept override { return &plant_; }

  /// Steps until each weighted output has felt a switch, at most `most`.
  static int relative_degree(const LinearPlant& plant, int most);

 private:
  /// What a switch can do in the steps ahead beside staying as it is.
  enum class Course : std::uint8_t { changes, changes_and_returns };

  void respond(int degree, int ahead) noexcept;
  void look_ahead(std::size_t step, const DelayLines& lines, int ahead) noexcept;
  void add_up(std::size_t c, std::int64_t stays, std::int64_t course, int ahead, std::size_t effect) noexcept;
  double output(std::size_t o) const noexcept;
  SwitchPattern choose(const ModeSet& modes, const DelayLines& lines, int ahead) const noexcept;
  double error(SwitchPattern changed, Course course, int at, int ahead, double best) const noexcept;
  void advance(std::vector<double>& xi, const SwitchStates<double>& wanted, SwitchPattern in_effect) noexcept;
  /// Where in effects_ those of a course begin.
  std::size_t effect(std::size_t c, Course course, int at) const noexcept {
    const std::size_t courses = 2 * static_cast<std::size_t>(reversal_ + 1);
    return (c * courses + 2 * static_cast<std::size_t>(at) + (course == Course::changes ? 0 : 1)) * base_.size();
  }

  LinearPlant plant_;
  double edge_price_;
  SwitchTiming timing_;
  WantedStates wanted_;
  ModulatorState most_;
  int reversal_ = 0;                          // steps until a change can have been taken back, less one
  std::vector<double> xi_, ahead_xi_, next_;  // states
  std::vector<double> responses_;             // steps x switches x outputs: to a switch that goes on and stays on
  std::array<double, max_switches> price_{};  // of each switch's change
  std::vector<double> base_;                  // steps x outputs: errors ahead if no switch changes any more
  std::vector<double> effects_;               // switches x courses x base_: what each course adds
};

}  // namespace solenoid
