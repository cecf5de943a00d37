// What one stage of an optimal-control QP says of a point, with compile-time sizes, one row of [x | u] in the lanes of one
// vector; see lanes.hpp for how this file is included.

template <int NX, int NU>
struct Stages {
  static constexpr int W = multiple_of(4, NX + NU), XL = multiple_of(4, NX), UL = multiple_of(4, NU), H = NX + NU;
  using Row = V<W>;
  using X = V<XL>;
  using U = V<UL>;

  /// Clears the lanes beyond the states', which hold the inputs'.
  static SOLENOID_INLINE void states_only(X& x) {
    if constexpr (NX < XL) {
      X mask;
      load<XL>(mask, first_of_many + 32 - NX);
      x = mask * x;
    }
  }

  /// Gradient of the stage's cost at (x, u), without and with the constraints' share, and its value.
  static SOLENOID_INLINE double stage_cost(const StagePack& s, int k, const double* x, const double* u, Row& gradient) {
    Row curved = {};
    load<W>(gradient, s.gradient + k * W);
    const auto add = [&](int r, double at) {
      Row hessian;
      load<W>(hessian, s.hessian + (k * H + r) * W);
      curved += at * hessian;
    };
    for (int i = 0; i < NX; ++i) add(i, x[i]);
    for (int j = 0; k < s.stages && j < NU; ++j) add(NX + j, u[j]);
    alignas(64) double mean[W];
    store<W>(mean, Row(0.5 * curved + gradient));
    gradient += curved;
    double value = 0.0;
    for (int i = 0; i < NX; ++i) value += x[i] * mean[i];
    for (int j = 0; k < s.stages && j < NU; ++j) value += u[j] * mean[NX + j];
    return value;
  }

  /// A x + B u + c - next.
  static SOLENOID_INLINE void defect_of(const StagePack& s, int k, const double* x, const double* u, const double* next,
                                        X& defect) {
    X column;
    load<XL>(defect, s.offset + k * XL);
    load<XL>(column, next);
    defect -= column;
    for (int c = 0; c < H; ++c) {
      load<XL>(column, s.columns + (k * H + c) * XL);
      defect += (c < NX ? x[c] : u[c - NX]) * column;
    }
  }

  /// out + x[0] m_0 + x[1] m_1 + ..., in two chains of sums; m has `apart` lanes a row.
  template <int apart = XL>
  static SOLENOID_INLINE void apply(X& out, const X& x, const double* m) {
    X odd = {};
    SOLENOID_UNROLL
    for (int i = 0; i < NX; ++i) {
      X row;
      load<XL>(row, m + i * apart);
      if (i % 2 == 0)
        out += x[i] * row;
      else
        odd += x[i] * row;
    }
    out += odd;
  }

  /// The states that the inputs in w lead to.
  static void simulate(const StagePack& s, int state_offset, double* w) {
    X x;
    load<XL>(x, s.x0);
    for (int k = 0; k < s.stages; ++k) {
      X next;
      load<XL>(next, s.offset + k * XL);
      for (int j = 0; j < NU; ++j) {
        X column;
        load<XL>(column, s.columns + (k * H + NX + j) * XL);
        next += w[k * NU + j] * column;
      }
      apply(next, x, s.columns + k * H * XL);
      store<XL>(w + state_offset + k * XL, next);
      x = next;
    }
  }

  /// The dynamics' multipliers that leave the states stationary without bounds of theirs.
  static void costates(const StagePack& s, const double* w, int state_offset, double* y) {
    X costate = {};
    for (int k = s.stages; k > 0; --k) {
      const double* x = w + state_offset + (k - 1) * XL;
      X own;
      load<XL>(own, s.gradient + k * W);
      for (int r = 0; r < (k < s.stages ? H : NX); ++r) {
        X hessian;
        load<XL>(hessian, s.hessian + (k * H + r) * W);
        own += (r < NX ? x[r] : w[k * NU + r - NX]) * hessian;
      }
      if (k < s.stages) apply<W>(own, costate, s.rows + k * NX * W);
      states_only(own);
      store<XL>(y + (k - 1) * XL, own);
      costate = own;
    }
  }

  static StageResidual residual(const StagePack& s, const double* w, int state_offset, const double* y,
                                const double* zeta, bool state_rows, double* dual, double* primal) {
    double objective = 0.0, worst_input = 0.0;
    X worst = {}, worst_state = {};
    for (int k = 0; k <= s.stages; ++k) {
      const double *x = k == 0 ? s.x0 : w + state_offset + (k - 1) * XL, *u = w + k * NU;
      Row gradient;
      objective += stage_cost(s, k, x, u, gradient);
      alignas(64) double g[W];
      if (k < s.stages) {
        X defect;
        defect_of(s, k, x, u, w + state_offset + k * XL, defect);
        store<XL>(primal + k * XL, defect);
        raise_magnitude(worst, defect);
        for (int i = 0; i < NX; ++i) {
          Row row;
          load<W>(row, s.rows + (k * NX + i) * W);
          gradient += y[k * XL + i] * row;
        }
      }
      store<W>(g, gradient);
      if (k < s.stages) {
        for (int j = 0; j < NU; ++j) {
          const double input = g[NX + j] + zeta[k * NU + j];
          dual[k * NU + j] = input;
          worst_input = larger(worst_input, input < 0.0 ? -input : input);
        }
      }
      if (k > 0) {
        X state, own;
        load<XL>(state, g);
        states_only(state);
        load<XL>(own, y + (k - 1) * XL);
        state -= own;
        if (state_rows) {
          load<XL>(own, zeta + state_offset + (k - 1) * XL);
          state += own;
        }
        store<XL>(dual + state_offset + (k - 1) * XL, state);
        raise_magnitude(worst_state, state);
      }
    }
    return {larger(worst_input, largest<XL>(worst_state)), largest<XL>(worst), objective};
  }
};
