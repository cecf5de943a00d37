#pragma once

#include "solvers/qp/ocp_qp.hpp"

#include <cstdint>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace solenoid::test {

/// A recorded closed-loop problem and its optimum from an independent interior-point solver at 1e-11.
struct RecordedQp {
  qp::OcpQp<4, 3> problem;
  double optimal_cost = 0.0;
};

/// Reads plain numbers from a little-endian file; throws std::runtime_error where it ends early.
class BinaryReader {
 public:
  explicit BinaryReader(const std::string& path) : path_(path), file_(path, std::ios::binary) {}

  int integer() {
    std::int32_t value = 0;
    raw(&value, sizeof value);
    return value;
  }
  template <class Dense>
  void fill(Dense& out) {  // column-major, as Eigen keeps it
    raw(out.data(), sizeof(double) * static_cast<std::size_t>(out.size()));
  }
  void skip(int doubles) {
    double ignored = 0.0;
    for (int i = 0; i < doubles; ++i) raw(&ignored, sizeof ignored);
  }

 private:
  void raw(void* out, std::size_t bytes) {
    if (!file_.read(static_cast<char*>(out), static_cast<std::streamsize>(bytes)))
      throw std::runtime_error(path_ + ": missing or short");
  }
  std::string path_;
  std::ifstream file_;
};

/// One instance of tests/data/qp_tracking_n<N>.bin.
///
/// layout   int32 N, double x0[4], A[N][16], B[N][12] (column-major), c[N][4], lb[N][3], ub[N][3], r[N][3],
///          xr[N+1][4], ur[N][3] (the last two, the linearisation point, are skipped)
/// cost     sum_{k<N} (1e-3 |u_k|^2 + r_k'u_k) + sum_{0<k<=N} x_k[0]^2
inline qp::OcpQp<4, 3> read_instance(BinaryReader& file) {
  const int horizon = file.integer();
  qp::OcpQp<4, 3> problem(horizon);
  auto& stages = problem.stages;
  const auto last = static_cast<std::size_t>(horizon);
  file.fill(problem.x0);
  for (std::size_t k = 0; k < last; ++k) file.fill(stages[k].a);
  for (std::size_t k = 0; k < last; ++k) file.fill(stages[k].b);
  for (std::size_t k = 0; k < last; ++k) file.fill(stages[k].c);
  for (std::size_t k = 0; k < last; ++k) file.fill(stages[k].u_lower);
  for (std::size_t k = 0; k < last; ++k) file.fill(stages[k].u_upper);
  for (std::size_t k = 0; k < last; ++k) file.fill(stages[k].r);
  file.skip(4 * (horizon + 1) + 3 * horizon);
  for (std::size_t k = 0; k < last; ++k) stages[k].r_matrix.diagonal().setConstant(2e-3);
  for (std::size_t k = 1; k <= last; ++k) stages[k].q_matrix(0, 0) = 2.0;
  return problem;
}

/// All instances of tests/data/qp_tracking_n<horizon>.bin with their optimal costs.
inline std::vector<RecordedQp> recorded_qps(int horizon) {
  const std::string base = std::string(SOLENOID_SOURCE_DIR) + "/tests/data/qp_tracking_n" + std::to_string(horizon);
  BinaryReader file(base + ".bin");
  std::vector<RecordedQp> all(static_cast<std::size_t>(file.integer()));
  std::ifstream costs(base + "_optimal_cost.csv");
  std::string line;
  std::getline(costs, line);
  for (RecordedQp& one : all) {
    one.problem = read_instance(file);
    if (!std::getline(costs, line)) throw std::runtime_error(base + "_optimal_cost.csv: missing or short");
    one.optimal_cost = std::stod(line.substr(line.find(',') + 1));
  }
  return all;
}

}  // namespace solenoid::test
