#pragma once

#include "solvers/qp/types.hpp"

namespace solenoid::qp {

/// The inequality rows of an interior point, two-sided: lower <= v <= upper with slacks t and multipliers z, structure
/// of arrays. `size` is a multiple of 8; absent sides have mask 0, bound 0, t = 1, z = 0 and stay so.
///
///   lower side   v - t_l = lower, t_l >= 0, z_l >= 0        upper side   v + t_u = upper, t_u >= 0, z_u >= 0
struct Rows {
  int size = 0;
  double *lower, *upper, *mask_l, *mask_u;  // problem
  double* fixed;                            // weight of a row held at lower = upper, otherwise 0
  double *t_l, *t_u, *z_l, *z_u;            // iterate
  double* v;                                // C w, the rows' values
  double *r_l, *r_u;                        // v - lower - t_l, upper - v - t_u
  double *inv_l, *inv_u;                    // 1 / t
  double *inv_z_l, *inv_z_u;                // 1 / z
  double *second_l, *second_u;              // dt * dz of the predictor
  double *dt_l, *dt_u, *dz_l, *dz_u, *dv;   // step
  double* weight;                           // D = z_l / t_l + z_u / t_u (+ fixed)
  double* shift;                            // h: the rows' multiplier step is nu = D dv + h
  double* nu;
  double* z_f;   // signed multiplier of a fixed row
  double* zeta;  // z_u - z_l + z_f, the signed multiplier
};

/// Whether the first `count` rows are bounded on both sides.
inline bool all_boxed(const Rows& rows, int count) {
  for (int i = 0; i < count; ++i)
    if (rows.fixed[i] == 0.0 && rows.mask_l[i] * rows.mask_u[i] == 0.0) return false;
  return true;
}

/// How far the rows are from complementarity.
struct RowState {
  double residual;  ///< largest |r|
  double product;   ///< sum of t z
  double largest;   ///< largest t z
};

/// Largest -dt/t and -dz/z: a step length is min(1, 1 / ratio).
struct StepRatios {
  double primal, dual;
};
/// The same with the sums that give mu after any step pair.
struct RowStep {
  StepRatios ratio;
  double t_dz, z_dt, dt_dz;
};

/// Elementwise work of an iteration; the equations are theory-qp.md, eq. 3 to 5.
struct RowKernels {
  RowState (*evaluate)(const Rows& rows);               // r, 1/t, D, zeta and the predictor's h
  RowStep (*predict)(const Rows& rows);                 // dt, dz of the predictor from dv; second-order products
  void (*correct)(const Rows& rows, double target);     // the corrector's h for t z = target
  StepRatios (*step)(const Rows& rows, double target);  // dt, dz of the corrector from dv
  void (*advance)(const Rows& rows, double length);
  void (*axpy)(int size, double factor, const double* x, double* y);  // y += factor x
  void (*add)(int size, const double* x, const double* y, double* out);
  /// out = a x + b, entry by entry
  void (*multiply_add)(int size, const double* a, const double* x, const double* b, double* out);
  bool (*finite)(int size, const double* x);  // neither infinite nor not a number
};

/// Stage data of an optimal-control QP, packed for the lanes of one vector: [x (NX) | u (NU) | padding], W lanes.
struct StagePack {
  int stages = 0;
  double* rows;      // [stages][NX][W]       row i of [A B]
  double* columns;   // [stages][NX + NU][XL] column j of [A B]
  double* offset;    // [stages][XL]          c
  double* hessian;   // [stages + 1][NX + NU][W]   rows of [Q S'; S R]
  double* gradient;  // [stages + 1][W]       q | r
  double* x0;        // [XL]
};

/// What the Riccati recursion leaves behind.
struct RiccatiPack {
  double* value;           // [stages + 1][NX][XL] rows of P
  double* gain;            // [stages][NU][XL]     rows of K: u = -K x - k
  double* gain_t;          // [stages][NX][UL]     K transposed
  double* inverse;         // [stages][NU][UL]     inverse of the reduced input Hessian
  double* closed_rows;     // [stages][NX][XL]     rows of A - B K
  double* closed_columns;  // [stages][NX][XL]     its columns
  // Of the latest right-hand side:
  double* feedforward;  // [stages][UL]      k
  double* costate;      // [stages + 1][XL]  p
  double* moved;        // [stages + 1][XL]  p + P e
};

/// How far the stages are from stationarity and from the dynamics.
struct StageResidual {
  double dual, primal;  ///< largest entries
  double objective;
};

/// Vectors over all stages: inputs packed [stages][NU], then (from `state_offset`) states x_1..x_N packed [stages][XL].
struct RiccatiKernels {
  int state_lanes, input_lanes, width;  // XL, UL, W
  /// The states that the inputs in w lead to, and the dynamics' multipliers that leave the states stationary.
  void (*simulate)(const StagePack& stages, int state_offset, double* w);
  void (*costates)(const StagePack& stages, const double* w, int state_offset, double* y);
  /// Stationarity and dynamics residuals at (w, y) with row multipliers zeta (state rows only if state_rows).
  StageResidual (*residual)(const StagePack& stages, const double* w, int state_offset, const double* y,
                            const double* zeta, bool state_rows, double* dual, double* primal);
  /// P, K for barrier weights D, and p, k for gradient g and dynamics residual e; false when a pivot is not positive.
  bool (*factor)(const StagePack& stages, const RiccatiPack& riccati, const double* weight, const double* g,
                 const double* e, int state_offset, bool state_rows, double shift);
  /// p, k for another right-hand side.
  void (*backward)(const StagePack& stages, const RiccatiPack& riccati, const double* g, const double* e,
                   int state_offset);
  /// The step (dw, dy) of the latest right-hand side, A dx + B du + e = dx+; without multipliers where dy is null.
  void (*forward)(const StagePack& stages, const RiccatiPack& riccati, const double* e, int state_offset, double* dw,
                  double* dy);
};

/// The kernels for an instruction set.
const RowKernels& row_kernels(Isa isa);

/// The instruction set `isa` comes to on this processor.
Isa resolve(Isa isa);

}  // namespace solenoid::qp
