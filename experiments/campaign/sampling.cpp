#include "experiments/campaign/sampling.hpp"

#include "core/signal/mixed_bits.hpp"

#include <algorithm>
#include <bit>
#include <random>
#include <stdexcept>
#include <utility>

#include <boost/random/sobol.hpp>
#include <fmt/format.h>

namespace solenoid {
namespace {

constexpr std::size_t digits_kept = 32;

/// Uniform in [0, 1), the same with every standard library.
double unit(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1p-53; }

/// One point in each of n equal slices of [0, 1), in random order.
std::vector<double> shuffled_slices(std::size_t n, std::mt19937_64& random) {
  std::vector<double> points(n);
  for (std::size_t i = 0; i < n; ++i) points[i] = (static_cast<double>(i) + unit(random)) / static_cast<double>(n);
  for (std::size_t i = n - 1; i > 0; --i)
    std::swap(points[i], points[static_cast<std::size_t>(unit(random) * static_cast<double>(i + 1))]);
  return points;
}

/// Somewhere in the slice of [0, 1) that a permutation gives the point. The place inside has 24 digits, with which no
/// rounding carries a point of 10 million into the next slice.
double in_slice(std::size_t point, std::size_t n, std::uint64_t key) {
  const double inside = static_cast<double>(mixed_bits(~key ^ point) >> 40) * 0x1p-24;
  return (static_cast<double>(permuted(point, n, key)) + inside) / static_cast<double>(n);
}

}  // namespace

const std::vector<std::string>& sampling_names() {
  static const std::vector<std::string> names = {"shuffled", "sobol", "latin_hypercube"};
  return names;
}

Sampler::Sampler(Sampling method, std::uint64_t seed, std::size_t dimensions, std::size_t points)
    : method_(method), points_(points), order_key_(mixed_bits(~mixed_bits(seed))) {
  const std::size_t most = method == Sampling::shuffled ? most_shuffled : most_points;
  if (points == 0 || points > most)
    throw std::invalid_argument(fmt::format("{} points (allowed: 1 to {})", points, most));
  const std::uint64_t own = mixed_bits(seed);
  for (std::size_t d = 0; d < dimensions; ++d) keys_.push_back(mixed_bits(own ^ mixed_bits(d)));
  if (method == Sampling::sobol) directions_ = sobol_directions(dimensions);
  if (method != Sampling::shuffled) return;
  std::mt19937_64 random(seed);
  for (std::size_t d = 0; d < dimensions; ++d)
    for (const double value : shuffled_slices(points, random)) shuffled_.push_back(value);
}

std::vector<double> Sampler::at(std::size_t point) const {
  std::vector<double> shares(dimensions());
  if (method_ == Sampling::shuffled)
    for (std::size_t d = 0; d < shares.size(); ++d) shares[d] = shuffled_[d * points_ + point];
  if (method_ == Sampling::latin_hypercube)
    for (std::size_t d = 0; d < shares.size(); ++d) shares[d] = in_slice(point, points_, keys_[d]);
  if (method_ != Sampling::sobol) return shares;
  // Without an order of their own points of one number would be alike under all seeds. Blocks of 2^m stay blocks.
  const std::uint32_t turn = scrambled(static_cast<std::uint32_t>(point), order_key_);
  for (std::size_t d = 0; d < shares.size(); ++d)
    shares[d] = scrambled(sobol_digits(&directions_[digits_kept * d], turn), keys_[d]) * 0x1p-32;
  return shares;
}

std::vector<std::uint32_t> sobol_directions(std::size_t dimensions) {
  if (dimensions == 0) return {};
  const boost::random::sobol begin(dimensions);  // at point 1: point 0 is all zeros, and it leaves that out
  std::vector<std::uint32_t> directions(digits_kept * dimensions);
  for (std::size_t j = 0; j < digits_kept; ++j) {
    // Point 2^(j+1) - 1 has the Gray code 2^j: it is direction j.
    boost::random::sobol sequence = begin;
    sequence.discard(((std::uint64_t{2} << j) - 2) * dimensions);
    for (std::size_t d = 0; d < dimensions; ++d)
      directions[digits_kept * d + j] = static_cast<std::uint32_t>(sequence() >> 32);
  }
  return directions;
}

std::uint32_t sobol_digits(const std::uint32_t* directions, std::size_t point) {
  std::uint32_t digits = 0;
  for (std::size_t left = point ^ (point >> 1); left != 0; left &= left - 1)
    digits ^= directions[std::countr_zero(left)];
  return digits;
}

std::uint32_t scrambled(std::uint32_t digits, std::uint64_t key) {
  // A hash of the digits before says whether a digit is turned over (Burley 2020, section 3). One for each digit takes
  // 50 ns and, unlike the hash of Laine and Karras that does all at once, is as good as random numbers are.
  std::uint32_t turned = 0;
  for (std::uint64_t digit = 0; digit < digits_kept; ++digit) {
    const std::uint64_t before = (std::uint64_t{1} << digit) | (std::uint64_t{digits} >> (digits_kept - digit));
    turned = (turned << 1) | static_cast<std::uint32_t>(mixed_bits(key ^ before) >> 63);
  }
  return digits ^ turned;
}

std::size_t permuted(std::size_t place, std::size_t n, std::uint64_t key) {
  // A Feistel network permutes the numbers of 2h bits (Luby, Rackoff 1988); one that leaves 0 to n - 1 goes on until it
  // comes back (cycle walking: Black, Rogaway 2002), 4 times at most on average, or 64 / n for a small n.
  constexpr std::uint64_t rounds = 6;
  const int half = std::max(3, (static_cast<int>(std::bit_width(n - 1)) + 1) / 2);
  const std::uint64_t mask = (std::uint64_t{1} << half) - 1;
  do {
    std::uint64_t left = place >> half, right = place & mask;
    for (std::uint64_t round = 1; round <= rounds; ++round) {
      const std::uint64_t hash = mixed_bits(key ^ (round << 32 | right));
      left = std::exchange(right, left ^ (hash >> (64 - half)));
    }
    place = left << half | right;
  } while (place >= n);
  return place;
}

}  // namespace solenoid
