#pragma once

#include "core/systems/actuator/force_residual.hpp"
#include "experiments/base/plot.hpp"
#include "experiments/systems/actuator/identify/gaussian_process.hpp"
#include "experiments/systems/actuator/identify/residual_samples.hpp"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace solenoid {

/// A share of the residual as it was found, at the knots of its hats.
struct ResidualShare {
  std::vector<double> knots;
  std::vector<GpValue>
      found;                  ///< of the Gaussian process [N, N^2]; the ends, where there are no data, have the prior's
  std::vector<double> trust;  ///< 1 - variance/prior variance: what the data say, from 0 (nothing) to 1
  GpKernel kernel;
  HatSum hats;  ///< mean times trust
};

/// Of every fifth second of motion, with what the other four say.
struct HeldOutForce {
  std::size_t samples = 0;
  double without_n = 0.0, with_n = 0.0;  ///< root mean square [N] of what is left without and with the residual
  double inside_95 = 0.0;                ///< share of the samples within the 95 % band
};

/// A residual with how well it is known.
struct ResidualFinding {
  ResidualShare velocity;
  double noise_n = 0.0;
  std::size_t samples = 0;
  std::array<double, 2> velocity_range_m_s{}, position_range_m{};  ///< of the data
  std::vector<GpValue> payload_kg;                                 ///< of each log
  double log_likelihood = 0.0, without_residual = 0.0;
  std::optional<HeldOutForce> held_out;  ///< payload in both; none where no log has more than 4 s of motion
  std::vector<ResidualSample> drawn;     ///< the samples, payload taken out

  ForceResidual residual() const;
};

/// Force residual of samples by a Gaussian process of velocity. The two directions
/// of motion are branches of their own, on which the coordinate is asinh(|v|/1 cm/s), fine where friction bends; the
/// payload of each log is a linear term. Each entry of `logs` is a record's samples, in their order in time.
///                                                                                       [residual.md, section 2]
/// Throws ConfigError for too few samples, or hardly any of one direction: friction could not be told from gravity and
/// payload; and for samples that are as likely without any residual.
ResidualFinding identify_residual(const std::vector<std::vector<ResidualSample>>& logs);

/// Where a residual is from, for its file.
struct ResidualSource {
  std::string logs;      ///< names of the files
  std::string hash;      ///< of their contents
  std::string believes;  ///< whose model it is beside
};
/// The file that a variant's key `residual` takes.
std::string residual_file(const ResidualFinding& found, const ResidualSource& source);

/// Samples, mean with its 95 % band, and the hats that are left of it, over velocity.
Plot residual_plot(const ResidualFinding& found);

}  // namespace solenoid
