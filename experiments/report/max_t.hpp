#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace solenoid {

/// Several means, each of values that belong to it alone or to units that all have in common, and how far each may lie
/// from what it estimates: the studentised bootstrap, "bootstrap-t" (B. Efron, R. J. Tibshirani: An Introduction to the
/// Bootstrap, 1993, section 12.5), and over several means its largest |t|, which holds for all of them together (J. P.
/// Romano, M. Wolf: Exact and Approximate Stepdown Methods for Multiple Hypothesis Testing, JASA 100, 2005, single
/// step).
///
///     k values x, k draws x* of them   t* = (mean(x*) - mean(x)) / s(x*),  s(x)^2 = sum (x - mean(x))^2 / (k (k - 1))
///     interval of a mean               mean(x) -+ c s(x), where |t*| <= c in 95 % of the resamples
///     intervals of several             the same with the largest |t*| of each resample
///
/// Why not percentiles or BCa: of means of few values these are too short (of 400 samples of ten normal values the 95 %
/// interval had the mean in 88 % and 87 %, this one in 95 %), and only what is studentised can be compared over several
/// means, so that intervals, p-values and verdicts are one.
///
/// Means of the same number of values are drawn together, value by value, which keeps what they have in common; the
/// order of values is to be the same in each. The same means in the same order have the same numbers.
///
/// A resample of values that are all one has no finite t*. Of values of which k - j are one, as of two variants that
/// differ in j of k scenarios, these are (1 - j / k)^k of the resamples: 37 % of j = 1 of many, 11 % of 2 of 10, and of
/// more than 5 % there is no interval. Nor has any a family that such a mean is in: bounded_family().
class MaxT {
 public:
  static constexpr std::size_t resamples = 10'000;
  /// Values below which there is no interval: too many resamples have one value alone.
  static constexpr std::size_t least_values = 5;

  /// `centred`: of each mean its values less itself, at least least_values of them and not all zero.
  explicit MaxT(const std::vector<std::vector<double>>& centred);

  /// What |t| of a mean stays below in 95 % of the resamples; infinity where it is infinite in more than 5 %.
  double critical(std::size_t mean) const;
  /// The largest |t| of each resample over some of the means, which is at least one.
  class Family {
   public:
    explicit Family(std::vector<float> largest);
    /// What all |t| stay below in 95 % of the resamples; infinity where one of them is infinite in more than 5 %.
    double critical() const;
    /// How likely a |t| as large is in the family while nothing differs: at most 0.05 if and only if it is above
    /// critical().
    double p(double t) const;

   private:
    std::vector<float> largest_;  // increasing
  };
  Family family(std::span<const std::size_t> means) const;
  /// Of those whose critical value together is finite; the others leave `means`, which may become empty: the ones that
  /// have more than 5 % of infinite |t| by themselves, then, halving this share until it is enough, the ones with most.
  /// Of a mean that leaves nothing may be said, so that no false statement is made of it.
  Family bounded_family(std::vector<std::size_t>& means) const;

 private:
  std::vector<std::vector<float>> t_;   // of a mean, of a resample
  std::vector<std::size_t> unbounded_;  // of a mean: resamples whose |t| is infinite
};

}  // namespace solenoid
