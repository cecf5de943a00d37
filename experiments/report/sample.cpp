#include "experiments/report/sample.hpp"

#include <algorithm>
#include <tuple>

namespace solenoid {
namespace {

using RowList = std::vector<std::size_t>;

/// The rows of one variant by how they ended.
struct Ended {
  RowList ok, unstable, failed;
};

std::vector<Ended> ended(const RunTable& runs) {
  std::vector<Ended> variants(runs.variants().size());
  for (std::size_t row = 0; row < runs.size(); ++row) {
    Ended& v = variants[runs.variant(row)];
    (runs.ok(row) ? v.ok : runs.failed(row) ? v.failed : v.unstable).push_back(row);
  }
  return variants;
}

void take_first(const RowList& rows, std::size_t most, RowList& taken) {
  taken.insert(taken.end(), rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(std::min(most, rows.size())));
}

/// The `worst` last of rows that are sorted by their errors, and of the others as many as make `most`.
void take_ranks(const RowList& sorted, std::size_t worst, std::size_t most, RowList& taken) {
  if (sorted.size() <= most) return take_first(sorted, most, taken);
  const std::size_t others = sorted.size() - worst, spaced = most - worst;
  for (std::size_t k = 0; k < spaced; ++k) taken.push_back(sorted[k * others / spaced]);
  taken.insert(taken.end(), sorted.end() - static_cast<std::ptrdiff_t>(worst), sorted.end());
}

}  // namespace

std::vector<std::size_t> sampled_rows(const RunTable& runs, std::size_t most) {
  std::vector<Ended> variants = ended(runs);
  const std::size_t share = std::max<std::size_t>(10, most / std::max<std::size_t>(1, variants.size()));
  RowList taken;
  for (Ended& v : variants) {
    const std::size_t before = taken.size();
    take_first(v.unstable, share / 10, taken);
    take_first(v.failed, share / 10, taken);
    std::ranges::sort(v.ok, {}, [&](std::size_t row) { return std::tuple(runs.error(row), row); });
    take_ranks(v.ok, share / 5, share - (taken.size() - before), taken);
  }
  std::ranges::sort(taken);
  return taken;
}

}  // namespace solenoid
