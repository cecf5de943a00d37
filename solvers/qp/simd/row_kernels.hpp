// Elementwise kernels of the interior point, a register of rows at a time: sums and maxima kept in more than that spill.
// See lanes.hpp for how this file is included.

constexpr int at_once = register_lanes;
using Lane = V<at_once>;

SOLENOID_INLINE Lane get(const double* from, int i) {
  Lane out;
  load<at_once>(out, from + i);
  return out;
}
SOLENOID_INLINE void put(double* to, int i, const Lane& x) { store<at_once>(to + i, x); }

inline RowState evaluate(const Rows& a) {
  Lane residual = {}, product = {}, most = {};
  for (int i = 0; i < a.size; i += at_once) {
    const Lane v = get(a.v, i), z_l = get(a.z_l, i), z_u = get(a.z_u, i), t_l = get(a.t_l, i), t_u = get(a.t_u, i);
    const Lane r_l = get(a.mask_l, i) * (v - get(a.lower, i) - t_l);
    const Lane r_u = get(a.mask_u, i) * (get(a.upper, i) - v - t_u);
    // One division serves 1 / t and 1 / z.
    const Lane some_l = z_l + (1.0 - get(a.mask_l, i)), some_u = z_u + (1.0 - get(a.mask_u, i));
    const Lane both_l = 1.0 / (t_l * some_l), both_u = 1.0 / (t_u * some_u);
    const Lane inv_l = some_l * both_l, inv_u = some_u * both_u;
    const Lane d_l = z_l * inv_l, d_u = z_u * inv_u;
    put(a.r_l, i, r_l), put(a.r_u, i, r_u), put(a.inv_l, i, inv_l), put(a.inv_u, i, inv_u);
    put(a.inv_z_l, i, t_l * both_l), put(a.inv_z_u, i, t_u * both_u);
    const Lane fixed = get(a.fixed, i);
    put(a.weight, i, d_l + d_u + fixed);
    put(a.zeta, i, z_u - z_l + get(a.z_f, i));
    put(a.shift, i, z_l + d_l * r_l - z_u - d_u * r_u + fixed * (v - get(a.lower, i)));
    raise_magnitude(residual, r_l), raise_magnitude(residual, r_u);
    const Lane p_l = t_l * z_l, p_u = t_u * z_u;
    product += p_l + p_u;
    // What a judge sees is the row's distance to its bound, not the slack standing for it.
    raise_magnitude(most, Lane(p_l + z_l * r_l)), raise_magnitude(most, Lane(p_u + z_u * r_u));
    const Lane held = where_positive(fixed, Lane(v - get(a.lower, i)));
    raise_magnitude(most, Lane(held * get(a.z_f, i)));
  }
  return {largest<at_once>(residual), sum<at_once>(product), largest<at_once>(most)};
}

inline RowStep predict(const Rows& a) {
  Lane primal = {}, dual = {}, t_dz = {}, z_dt = {}, dt_dz = {};
  for (int i = 0; i < a.size; i += at_once) {
    const Lane dv = get(a.dv, i), z_l = get(a.z_l, i), z_u = get(a.z_u, i);
    const Lane mask_l = get(a.mask_l, i), mask_u = get(a.mask_u, i);
    const Lane dt_l = mask_l * (get(a.r_l, i) + dv), dt_u = mask_u * (get(a.r_u, i) - dv);
    const Lane rel_l = dt_l * get(a.inv_l, i), rel_u = dt_u * get(a.inv_u, i);
    const Lane dz_l = -z_l - z_l * rel_l, dz_u = -z_u - z_u * rel_u;
    put(a.second_l, i, dt_l * dz_l), put(a.second_u, i, dt_u * dz_u);
    raise(primal, Lane(-rel_l)), raise(primal, Lane(-rel_u));
    raise(dual, Lane(mask_l * (1.0 + rel_l))), raise(dual, Lane(mask_u * (1.0 + rel_u)));
    t_dz += get(a.t_l, i) * dz_l + get(a.t_u, i) * dz_u;
    z_dt += z_l * dt_l + z_u * dt_u;
    dt_dz += dt_l * dz_l + dt_u * dz_u;
  }
  return {
      {largest<at_once>(primal), largest<at_once>(dual)}, sum<at_once>(t_dz), sum<at_once>(z_dt), sum<at_once>(dt_dz)};
}

inline void correct(const Rows& a, double target) {
  for (int i = 0; i < a.size; i += at_once) {
    const Lane inv_l = get(a.inv_l, i), inv_u = get(a.inv_u, i), z_l = get(a.z_l, i), z_u = get(a.z_u, i);
    const Lane c_l = get(a.second_l, i) - target * get(a.mask_l, i);
    const Lane c_u = get(a.second_u, i) - target * get(a.mask_u, i);
    put(a.shift, i,
        z_l + (c_l + z_l * get(a.r_l, i)) * inv_l - z_u - (c_u + z_u * get(a.r_u, i)) * inv_u +
            get(a.fixed, i) * (get(a.v, i) - get(a.lower, i)));
  }
}

inline StepRatios step(const Rows& a, double target) {
  Lane primal = {}, dual = {};
  for (int i = 0; i < a.size; i += at_once) {
    const Lane dv = get(a.dv, i), z_l = get(a.z_l, i), z_u = get(a.z_u, i);
    const Lane mask_l = get(a.mask_l, i), mask_u = get(a.mask_u, i);
    const Lane inv_l = get(a.inv_l, i), inv_u = get(a.inv_u, i);
    const Lane dt_l = mask_l * (get(a.r_l, i) + dv), dt_u = mask_u * (get(a.r_u, i) - dv);
    const Lane dz_l = -z_l - (get(a.second_l, i) - target * mask_l + z_l * dt_l) * inv_l;
    const Lane dz_u = -z_u - (get(a.second_u, i) - target * mask_u + z_u * dt_u) * inv_u;
    put(a.dt_l, i, dt_l), put(a.dt_u, i, dt_u), put(a.dz_l, i, dz_l), put(a.dz_u, i, dz_u);
    raise(primal, Lane(-dt_l * inv_l)), raise(primal, Lane(-dt_u * inv_u));
    raise(dual, Lane(-dz_l * get(a.inv_z_l, i))), raise(dual, Lane(-dz_u * get(a.inv_z_u, i)));
  }
  return {largest<at_once>(primal), largest<at_once>(dual)};
}

inline void advance(const Rows& a, double length) {
  for (int i = 0; i < a.size; i += at_once) {
    put(a.t_l, i, get(a.t_l, i) + length * get(a.dt_l, i));
    put(a.t_u, i, get(a.t_u, i) + length * get(a.dt_u, i));
    put(a.z_l, i, get(a.z_l, i) + length * get(a.dz_l, i));
    put(a.z_u, i, get(a.z_u, i) + length * get(a.dz_u, i));
    const Lane fixed = get(a.fixed, i), held = where_positive(fixed, get(a.nu, i));
    put(a.z_f, i, get(a.z_f, i) + length * held);
  }
}

inline void axpy(int size, double factor, const double* x, double* y) {
  for (int i = 0; i < size; i += at_once) put(y, i, get(y, i) + factor * get(x, i));
}

inline void add(int size, const double* x, const double* y, double* out) {
  for (int i = 0; i < size; i += at_once) put(out, i, get(x, i) + get(y, i));
}

inline void multiply_add(int size, const double* a, const double* x, const double* b, double* out) {
  for (int i = 0; i < size; i += at_once) put(out, i, get(a, i) * get(x, i) + get(b, i));
}

/// 0 x is 0 for a finite x and not a number for any other.
inline bool finite(int size, const double* x) {
  V<8> total = {}, other = {};
  int i = 0;
  for (; i + 8 < size; i += 16) {
    V<8> one, next;
    load<8>(one, x + i), load<8>(next, x + i + 8);
    total += 0.0 * one, other += 0.0 * next;
  }
  if (i < size) {
    V<8> last;
    load<8>(last, x + i);
    total += 0.0 * last;
  }
  return sum<8>(total + other) == 0.0;
}

constexpr RowKernels row_table = {evaluate, predict, correct, step, advance, axpy, add, multiply_add, finite};
