#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace solenoid {

/// How the points of an ensemble lie in the unit cube.
///
/// shuffled         a Latin hypercube of one stream of random numbers, made whole: what every ensemble was before there
///                  was a choice, kept so that published figures can be had again
/// sobol            the sequence of Sobol' with the direction numbers of Joe and Kuo (SIAM J. Sci. Comput. 30, 2008),
///                  each dimension scrambled as Owen does (1995), and so their order (Burley, JCGT 9, 2020): every
///                  first 2^m points are a net. A point does not depend on how many there are
/// latin_hypercube  each of n equal slices of each dimension holds one of n points (McKay, Beckman, Conover 1979)
enum class Sampling { shuffled, sobol, latin_hypercube };

/// Their names, in the enumeration's order.
const std::vector<std::string>& sampling_names();

/// Points in [0, 1)^d, the same on every machine. Those of `sobol` and `latin_hypercube` are functions of method, seed,
/// d, n and their own number: no other point is made for one.
class Sampler {
 public:
  static constexpr std::size_t most_shuffled = 999;  ///< all of them are kept
  /// Of any method: their runs' records are 10 GB for each variant. It is also as far as `latin_hypercube` keeps every
  /// point in its slice; `sobol` would go on to 2^32.
  static constexpr std::size_t most_points = 10'000'000;

  /// Throws std::invalid_argument without points, or with more than the method has: `most_points`, `most_shuffled`, and
  /// for `sobol` the table's 3667 dimensions.
  Sampler(Sampling method, std::uint64_t seed, std::size_t dimensions, std::size_t points);

  std::size_t dimensions() const { return keys_.size(); }
  std::size_t points() const { return points_; }
  /// The coordinates of a point, counted from 0.
  std::vector<double> at(std::size_t point) const;

 private:
  Sampling method_;
  std::size_t points_;
  std::uint64_t order_key_;                // sobol
  std::vector<std::uint64_t> keys_;        // one a dimension, of the seed
  std::vector<std::uint32_t> directions_;  // sobol: 32 a dimension
  std::vector<double> shuffled_;           // by dimension, then point
};

/// Point `point` of the sequence of Sobol' as Joe and Kuo print it, in 32 binary digits, unscrambled: the exclusive or
/// of those `directions` that the digits of its Gray code name.
std::uint32_t sobol_digits(const std::uint32_t* directions, std::size_t point);
/// The 32 direction numbers of each dimension.
std::vector<std::uint32_t> sobol_directions(std::size_t dimensions);
/// Owen's scrambling: each digit is turned over or not, at random, for all numbers whose digits before it are the same.
std::uint32_t scrambled(std::uint32_t digits, std::uint64_t key);
/// Where `place` of 0 to n - 1 goes under the permutation of this key.
std::size_t permuted(std::size_t place, std::size_t n, std::uint64_t key);

}  // namespace solenoid
