// Where the entries of the KKT matrix and of its factor lie: found once, in setup.
#include "solvers/qp/sparse_kkt.hpp"

#include <amd.h>
extern "C" {  // ldl.h, unlike its siblings, leaves this to C++ callers
#include <ldl.h>
}

#include <algorithm>
#include <numeric>

namespace solenoid::qp {
namespace {

// LDL takes non-const pointers to what it only reads.
int* raw(const std::vector<int>& v) { return const_cast<int*>(v.data()); }

}  // namespace

/// Upper triangle of the KKT matrix in natural order (columns: variables, equalities, inequalities), then ordered.
void SparseKkt::assemble_pattern() {
  const int size = n_ + p_ + m_;
  std::vector<std::vector<int>> columns(at(size));
  for (int j = 0; j < size; ++j) columns[at(j)].push_back(j);
  for (int j = 0; j < n_; ++j) {
    for (int e = hessian_.start[at(j)]; e < hessian_.start[at(j) + 1]; ++e)
      if (hessian_.row[at(e)] != j) columns[at(j)].push_back(hessian_.row[at(e)]);
    for (int e = equality_.start[at(j)]; e < equality_.start[at(j) + 1]; ++e)
      columns[at(n_ + equality_.row[at(e)])].push_back(j);
    for (int e = inequality_.start[at(j)]; e < inequality_.start[at(j) + 1]; ++e)
      columns[at(n_ + p_ + inequality_.row[at(e)])].push_back(j);
  }
  std::vector<int> start{0}, row;
  for (auto& column : columns) {
    row.insert(row.end(), column.begin(), column.end());
    start.push_back(static_cast<int>(row.size()));
  }
  place(best_order(start, row));
}

/// The order of fewest operations among AMD's and the problem's own, which stagewise problems often are best in.
std::vector<int> SparseKkt::best_order(const std::vector<int>& start, const std::vector<int>& row) const {
  const int size = n_ + p_ + m_;
  std::vector<int> amd(at(size)), natural(at(size));
  std::iota(natural.begin(), natural.end(), 0);
  if (size == 0 || amd_order(size, raw(start), raw(row), amd.data(), nullptr, nullptr) < AMD_OK) return natural;
  const auto operations = [&](const std::vector<int>& order) {
    std::vector<int> inverse(at(size)), l_start(at(size) + 1), parent(at(size)), count(at(size)), flag(at(size));
    // ldl_symbolic wants each entry in the column its place makes the later one: give it both triangles.
    std::vector<std::vector<int>> full(at(size));
    for (int j = 0; j < size; ++j)
      for (int e = start[at(j)]; e < start[at(j) + 1]; ++e) {
        full[at(j)].push_back(row[at(e)]);
        if (row[at(e)] != j) full[at(row[at(e)])].push_back(j);
      }
    std::vector<int> full_start{0}, full_row;
    for (auto& column : full) {
      full_row.insert(full_row.end(), column.begin(), column.end());
      full_start.push_back(static_cast<int>(full_row.size()));
    }
    ldl_symbolic(size, raw(full_start), raw(full_row), l_start.data(), parent.data(), count.data(), flag.data(),
                 raw(order), inverse.data());
    double total = 0.0;
    for (const int entries : count) total += static_cast<double>(entries) * entries;
    return total;
  };
  return operations(natural) < operations(amd) ? natural : amd;
}

/// Fixes the permuted pattern, the slot of every entry in it, and the pattern of L.
void SparseKkt::place(const std::vector<int>& order) {
  const int size = n_ + p_ + m_;
  inverse_.assign(at(size), 0);
  for (int k = 0; k < size; ++k) inverse_[at(order[at(k)])] = k;
  struct Entry {
    int column, row;
    int* slot;
  };
  std::vector<Entry> entries;
  const auto add = [&](int i, int j, int* slot) {
    const int a = inverse_[at(i)], b = inverse_[at(j)];
    entries.push_back({std::max(a, b), std::min(a, b), slot});
  };
  diagonal_.assign(at(size), 0);
  for (int j = 0; j < size; ++j) add(j, j, &diagonal_[at(j)]);
  for (int j = 0; j < n_; ++j) {
    for (int e = hessian_.start[at(j)]; e < hessian_.start[at(j) + 1]; ++e)
      add(hessian_.row[at(e)], j, &hessian_.slot[at(e)]);
    for (int e = equality_.start[at(j)]; e < equality_.start[at(j) + 1]; ++e)
      add(n_ + equality_.row[at(e)], j, &equality_.slot[at(e)]);
    for (int e = inequality_.start[at(j)]; e < inequality_.start[at(j) + 1]; ++e)
      add(n_ + p_ + inequality_.row[at(e)], j, &inequality_.slot[at(e)]);
  }
  std::stable_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.column != b.column ? a.column < b.column : a.row < b.row;
  });
  start_.assign(at(size) + 1, 0), row_.clear();
  int column = -1, last = -1;
  for (const Entry& entry : entries) {
    if (entry.column != column || entry.row != last) {
      row_.push_back(entry.row);
      ++start_[at(entry.column) + 1];
    }
    column = entry.column, last = entry.row;
    *entry.slot = static_cast<int>(row_.size()) - 1;
  }
  std::partial_sum(start_.begin(), start_.end(), start_.begin());
  values_.assign(row_.size(), 0.0), base_.assign(row_.size(), 0.0);
  l_start_.assign(at(size) + 1, 0);
  for (auto* v : {&parent_, &count_, &flag_, &pattern_}) v->assign(at(size), 0);
  for (auto* v : {&pivot_, &inverse_pivot_, &work_}) v->assign(at(size), 0.0);
  ldl_symbolic(size, start_.data(), row_.data(), l_start_.data(), parent_.data(), count_.data(), flag_.data(), nullptr,
               nullptr);
  l_row_.assign(at(l_start_[at(size)]), 0), l_values_.assign(at(l_start_[at(size)]), 0.0);
}

}  // namespace solenoid::qp
