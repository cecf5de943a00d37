#pragma once

#include <vector>

namespace solenoid {

/// Convolution with a Gaussian of standard deviation `width_s`, or with its first or second derivative: a smoothed
/// signal, its rate, its acceleration, none of them late. Ends repeat the first and last value.
std::vector<double> gaussian(const std::vector<double>& signal, double period_s, double width_s, int derivative = 0);

/// A position without most of its noise: smoothed where it moves, by a kernel that keeps accelerations (8 ms, fourth
/// order), and a straight line over each stretch at rest (slower than 0.5 mm/s for 80 ms), as stiction makes it.
std::vector<double> quiet_position(const std::vector<double>& position_m, double period_s);

/// A signal behind the pressure channels' Bessel filter of this group delay, in continuous time (steps of a quarter of
/// the period); settled at its first value. Between samples it is held, or goes in a straight line.
enum class Between { held, straight };
std::vector<double> through_bessel(const std::vector<double>& signal, double period_s, double delay_s, Between between);

/// Cut-off [Hz] of the eighth-order Bessel filter with this group delay.
double bessel_cutoff_hz(double delay_s);

}  // namespace solenoid
