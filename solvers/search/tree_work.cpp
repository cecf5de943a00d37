#include "solvers/search/tree_work.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <numeric>

namespace solenoid {
namespace {

/// A count that stays at the largest number when it gets there.
class Count {
 public:
  constexpr Count(std::int64_t n = 0) : n_(n) {}
  friend constexpr Count operator+(Count a, Count b) { return a.n_ > most - b.n_ ? most : a.n_ + b.n_; }
  friend constexpr Count operator*(Count a, Count b) { return a.n_ != 0 && b.n_ > most / a.n_ ? most : a.n_ * b.n_; }
  friend constexpr bool operator<(Count a, Count b) { return a.n_ < b.n_; }
  constexpr std::int64_t value() const { return n_; }

 private:
  static constexpr std::int64_t most = std::numeric_limits<std::int64_t>::max();
  std::int64_t n_;
};

/// Lanes filled up to whole registers.
Count padded(Count lanes, int width) { return Count((lanes.value() + width - 1) / width) * Count(width); }

/// The most of a list of nodes at one level and of everything below, by its length; and of the list that the first dive takes
/// its group from.
struct Lists {
  explicit Lists(int longest) : most(static_cast<std::size_t>(longest) + 1), first(most) {}
  std::vector<Count> most, first;
};

/// One kind of work: what a number of lanes costs that are rolled at a level.
template <class Cost>
Count most_of_groupings(int modes, const TreeShape& shape, const Cost& cost) {
  const int longest = std::max(shape.lanes, modes);
  Lists below(longest);
  for (std::size_t level = shape.block_steps.size(); level-- > 0;) {
    Lists here(longest);
    const auto with_first_group = [&](int k, int lanes, const std::vector<Count>& under) {
      const int least_parents = std::max(1, lanes / modes);
      Count most;
      // More parents than one above the least have no more children that fit.
      for (const int parents : {std::min(k, least_parents), least_parents + 1}) {
        if (parents > k) continue;
        const int children = std::min(parents == 1 ? longest : lanes, modes * parents);
        most = std::max(most, cost(level, Count(children)) + under[static_cast<std::size_t>(children)] +
                                  here.most[static_cast<std::size_t>(k - parents)]);
      }
      return most;
    };
    for (int k = 1; k <= longest; ++k) {
      const auto i = static_cast<std::size_t>(k);
      here.most[i] = std::max(here.most[i - 1], with_first_group(k, shape.lanes, below.most));
      here.first[i] = std::max(here.first[i - 1], with_first_group(k, shape.first_lanes, below.first));
    }
    below = here;
  }
  return below.first[1];
}

constexpr int most_tried_switches = 16;  // whose patterns are gone through one by one

/// The same with every parent alone, over the ways that groups of switches leave.
template <class Cost>
Count most_of_ways(const ModeSet& modes, const TreeShape& shape, const Cost& cost) {
  const auto count = static_cast<std::size_t>(modes.size());
  std::vector<Count> below(count), most(count);  // by the mode that is in force when the level begins
  const auto from = [&](std::size_t level, SwitchPattern in_force) {
    Count children, sum;
    for (std::size_t next = 0; next < count; ++next) {
      if (!one_at_a_time(in_force ^ modes.modes()[next].pattern, modes.one_at_a_time())) continue;
      children = children + 1;
      sum = sum + below[next];
    }
    return sum + cost(level, children);
  };
  for (std::size_t level = shape.block_steps.size(); --level > 0;) {
    for (std::size_t m = 0; m < count; ++m) most[m] = from(level, modes.modes()[m].pattern);
    below = most;
  }
  // What a search starts from need not be a mode, and may be anything as far as groups can tell.
  Count root;
  SwitchPattern grouped = 0;
  for (const SwitchPattern group : modes.one_at_a_time()) grouped |= group;
  if (std::popcount(grouped) > most_tried_switches)  // every mode may follow
    return std::accumulate(below.begin(), below.end(), cost(0, Count(modes.size())));
  for (SwitchPattern p = grouped;; p = (p - 1) & grouped) {
    root = std::max(root, from(0, p));
    if (p == 0) return root;
  }
}

template <class Cost>
std::int64_t most_of(const ModeSet& modes, const TreeShape& shape, const Cost& cost) {
  return std::min(most_of_groupings(modes.size(), shape, cost), most_of_ways(modes, shape, cost)).value();
}

/// Rolling a block in so many lanes, and bounding the nodes that they leave.
struct Costs {
  const TreeShape& shape;

  Count model_steps(std::size_t level, Count lanes) const {
    return padded(lanes, shape.register_width) * Count(shape.block_steps[level]);
  }
  Count bound_steps(std::size_t level, Count lanes) const {
    if (level + 1 >= shape.bound_steps.size()) return 0;
    return padded(lanes, shape.register_width) * Count(shape.bound_steps[level + 1]);
  }
};

SolveWork incumbents_of(const TreeShape& shape) {
  SolveWork work;
  for (std::size_t level = 0; level < shape.block_steps.size(); ++level) {
    work.nodes += shape.incumbents;
    work.model_steps += Costs{shape}.model_steps(level, shape.incumbents).value();
  }
  return work;
}

}  // namespace

MostWork most_tree_work(const ModeSet& modes, const TreeShape& shape) {
  const Costs costs{shape};
  const SolveWork first = incumbents_of(shape);
  MostWork most;
  most.solve = {most_of(modes, shape, [](std::size_t, Count lanes) { return lanes; }),
                most_of(modes, shape, [&](std::size_t level, Count lanes) { return costs.model_steps(level, lanes); }),
                most_of(modes, shape, [&](std::size_t level, Count lanes) { return costs.bound_steps(level, lanes); })};
  most.solve = {(Count(most.solve.nodes) + first.nodes).value(),
                (Count(most.solve.model_steps) + first.model_steps).value(), most.solve.bound_steps};
  // The clock is looked at after the incumbents and before each group.
  most.late = first;
  Count group = modes.size();
  for (std::size_t level = 0; level < shape.block_steps.size(); ++level) {
    most.late.nodes = std::max(most.late.nodes, group.value());
    most.late.model_steps = std::max(most.late.model_steps, costs.model_steps(level, group).value());
    most.late.bound_steps = std::max(most.late.bound_steps, costs.bound_steps(level, group).value());
    group = std::min(Count(std::max(shape.lanes, modes.size())), group * Count(modes.size()));
  }
  return most;
}

}  // namespace solenoid
