// Riccati recursion over stages with compile-time sizes, one row of [x | u | 1] in the lanes of one vector;
// see lanes.hpp for how this file is included and docs/theory-qp.md, section 4, for the recursion.

template <int NX, int NU>
struct Riccati {
  static constexpr int W = power_of_two(8, NX + NU + 1), XL = power_of_two(4, NX), UL = power_of_two(4, NU);
  static constexpr int H = NX + NU, one = NX + NU;
  using Row = V<W>;
  using X = V<XL>;
  using U = V<UL>;

  static SOLENOID_INLINE void unit(Row& out, int lane) {
    out = Row{};
    out[lane] = 1.0;
  }

  static StageResidual residual(const StagePack& s, const double* w, int state_offset, const double* y,
                                const double* zeta, bool state_rows, double* dual, double* primal) {
    Row objective = {};
    X worst = {};
    alignas(64) double lanes[W + UL] = {};
    for (int k = 0; k <= s.stages; ++k) {
      const double* x = k == 0 ? s.x0 : w + state_offset + (k - 1) * XL;
      for (int i = 0; i < NX; ++i) lanes[i] = x[i];
      for (int j = 0; j < NU; ++j) lanes[NX + j] = k < s.stages ? w[k * NU + j] : 0.0;
      Row point, cost = {}, gradient;
      load<W>(point, lanes);
      load<W>(gradient, s.gradient + k * W);
      for (int r = 0; r < H; ++r) {
        Row hessian;
        load<W>(hessian, s.hessian + (k * H + r) * W);
        cost += lanes[r] * hessian;
      }
      objective += point * (0.5 * cost + gradient);
      gradient += cost;
      if (k < s.stages) {
        X next;
        load<XL>(next, w + state_offset + k * XL);
        X defect;
        load<XL>(defect, s.offset + k * XL);
        defect -= next;
        for (int c = 0; c < H; ++c) {
          X column;
          load<XL>(column, s.columns + (k * H + c) * XL);
          defect += lanes[c] * column;
        }
        store<XL>(primal + k * XL, defect);
        raise_magnitude(worst, defect);
        for (int i = 0; i < NX; ++i) {
          Row row;
          load<W>(row, s.rows + (k * NX + i) * W);
          gradient += y[k * XL + i] * row;
        }
      }
      alignas(64) double g[W];
      store<W>(g, gradient);
      if (k < s.stages)
        for (int j = 0; j < NU; ++j) dual[k * NU + j] = g[NX + j] + zeta[k * NU + j];
      if (k > 0)
        for (int i = 0; i < XL; ++i) {
          const int at = state_offset + (k - 1) * XL + i;
          dual[at] = i < NX ? g[i] - y[(k - 1) * XL + i] + (state_rows ? zeta[at] : 0.0) : 0.0;
        }
    }
    V<8> largest_dual = {};
    const int end = state_offset + s.stages * XL;
    for (int i = 0; i + 8 <= end; i += 8) {
      V<8> part;
      load<8>(part, dual + i);
      raise_magnitude(largest_dual, part);
    }
    double most_dual = largest<8>(largest_dual);
    for (int i = end & ~7; i < end; ++i) most_dual = larger(most_dual, dual[i] < 0 ? -dual[i] : dual[i]);
    return {most_dual, largest<XL>(worst), sum<W>(objective)};
  }

  /// Rows of the stage's Hessian plus M' P M, M = [A B].
  static SOLENOID_INLINE void backstep(const StagePack& s, int k, const Row (&value)[NX], Row (&h)[H]) {
    Row m[NX], t[NX];
    const double* rows = s.rows + k * NX * W;
    for (int i = 0; i < NX; ++i) load<W>(m[i], rows + i * W);
    for (int i = 0; i < NX; ++i) {
      t[i] = value[i][0] * m[0];
      for (int j = 1; j < NX; ++j) t[i] += value[i][j] * m[j];
    }
    for (int r = 0; r < H; ++r) {
      load<W>(h[r], s.hessian + (k * H + r) * W);
      for (int i = 0; i < NX; ++i) h[r] += rows[i * W + r] * t[i];
    }
  }

  static SOLENOID_INLINE void add_to_diagonal(Row& row, int lane, double amount) { row[lane] += amount; }

  /// Symmetric elimination of the inputs from h; what stays in the state rows is the next value function.
  static SOLENOID_INLINE bool eliminate(Row (&h)[H], double* gain_out, double* gain_t, double* inverse) {
    Row scaled[NU];
    double pivot[NU];
    bool positive = true;
    for (int j = 0; j < NU; ++j) {
      pivot[j] = 1.0 / h[NX + j][NX + j];
      positive = positive && h[NX + j][NX + j] > 0.0;
      scaled[j] = pivot[j] * h[NX + j];
      for (int r = j + 1; r < NU; ++r) h[NX + r] -= h[NX + j][NX + r] * scaled[j];
      for (int r = 0; r < NX; ++r) h[r] -= h[NX + j][r] * scaled[j];
    }
    store_gains(scaled, pivot, gain_out, gain_t, inverse);
    return positive;
  }

  /// Back substitution of the unit triangle: gains in closed form, and the inverse for later right-hand sides.
  static SOLENOID_INLINE void store_gains(Row (&scaled)[NU], const double (&pivot)[NU], double* gain_out,
                                          double* gain_t, double* inverse) {
    // Lower-triangular inverse of the unit factor, then U^-1 D^-1 U^-T.
    double upper[NU][NU] = {};
    for (int j = 0; j < NU; ++j) {
      upper[j][j] = 1.0;
      for (int l = j + 1; l < NU; ++l) {
        double total = 0.0;
        for (int q = j; q < l; ++q) total -= upper[j][q] * scaled[q][NX + l];
        upper[j][l] = total;
      }
    }
    for (int j = 0; j < NU; ++j) {
      Row gain = scaled[j];
      for (int l = j + 1; l < NU; ++l) gain += upper[j][l] * scaled[l];
      store<W>(gain_out + j * W, gain);
      for (int c = 0; c < NX; ++c) gain_t[c * UL + j] = gain[c];
      for (int l = 0; l < NU; ++l) {
        double total = 0.0;
        for (int q = j > l ? j : l; q < NU; ++q) total += upper[j][q] * pivot[q] * upper[l][q];
        inverse[j * UL + l] = total;
      }
    }
  }

  static bool factor(const StagePack& s, const RiccatiPack& f, const double* weight, int state_offset, bool state_rows,
                     double shift) {
    const auto state_weight = [&](int k, int i) {
      return shift + (state_rows ? weight[state_offset + (k - 1) * XL + i] : 0.0);
    };
    bool positive = true;
    Row value[NX];
    for (int i = 0; i < NX; ++i) {
      load<W>(value[i], s.hessian + (s.stages * H + i) * W);
      add_to_diagonal(value[i], i, state_weight(s.stages, i));
      store<W>(f.value + (s.stages * NX + i) * W, value[i]);
    }
    for (int k = s.stages - 1; k >= 0; --k) {
      Row h[H];
      backstep(s, k, value, h);
      for (int j = 0; j < NU; ++j) add_to_diagonal(h[NX + j], NX + j, weight[k * NU + j] + shift);
      if (k > 0)
        for (int i = 0; i < NX; ++i) add_to_diagonal(h[i], i, state_weight(k, i));
      positive &= eliminate(h, f.gain + k * NU * W, f.gain_t + k * NX * UL, f.inverse + k * NU * UL);
      for (int i = 0; i < NX; ++i) {
        value[i] = h[i];
        store<W>(f.value + (k * NX + i) * W, value[i]);
      }
    }
    return positive;
  }

  static void solve(const StagePack& s, const RiccatiPack& f, const double* g, int state_offset, const double* e,
                    double* dw, double* dy) {
    backward(s, f, g, state_offset, e);
    forward(s, f, state_offset, e, dw, dy);
  }

  static SOLENOID_INLINE void backward(const StagePack& s, const RiccatiPack& f, const double* g, int state_offset,
                                       const double* e) {
    X p;
    load<XL>(p, g + state_offset + (s.stages - 1) * XL);
    store<XL>(f.costate + s.stages * XL, p);
    for (int k = s.stages - 1; k >= 0; --k) {
      alignas(64) double carry[XL], h[W];
      for (int i = 0; i < NX; ++i) {
        X value;
        load<XL>(value, f.value + ((k + 1) * NX + i) * W);
        p += e[k * XL + i] * value;
      }
      store<XL>(carry, p);
      Row total = {};
      for (int i = 0; i < NX; ++i) {
        Row row;
        load<W>(row, s.rows + (k * NX + i) * W);
        total += carry[i] * row;
      }
      store<W>(h, total);
      if (k > 0)
        load<XL>(p, g + state_offset + (k - 1) * XL);
      else
        p = X{};
      for (int i = 0; i < NX; ++i) p[i] += h[i];
      for (int j = 0; j < NU; ++j) {
        const double reduced = h[NX + j] + g[k * NU + j];
        f.reduced[k * UL + j] = reduced;
        X gain;
        load<XL>(gain, f.gain + (k * NU + j) * W);
        p -= reduced * gain;
      }
      store<XL>(f.costate + k * XL, p);
    }
    for (int k = 0; k < s.stages; ++k) {
      U feedforward = {};
      for (int j = 0; j < NU; ++j) {
        U row;
        load<UL>(row, f.inverse + (k * NU + j) * UL);
        feedforward += f.reduced[k * UL + j] * row;
      }
      store<UL>(f.feedforward + k * UL, feedforward);
    }
  }

  static SOLENOID_INLINE void forward(const StagePack& s, const RiccatiPack& f, int state_offset, const double* e,
                                      double* dw, double* dy) {
    alignas(64) double x[XL] = {}, u[UL];
    for (int k = 0; k < s.stages; ++k) {
      U input;
      load<UL>(input, f.feedforward + k * UL);
      for (int c = 0; c < NX; ++c) {
        U column;
        load<UL>(column, f.gain_t + (k * NX + c) * UL);
        input += x[c] * column;
      }
      store<UL>(u, U(-input));
      X next;
      load<XL>(next, e + k * XL);
      for (int c = 0; c < H; ++c) {
        X column;
        load<XL>(column, s.columns + (k * H + c) * XL);
        next += (c < NX ? x[c] : u[c - NX]) * column;
      }
      for (int j = 0; j < NU; ++j) dw[k * NU + j] = u[j];
      store<XL>(x, next);
      store<XL>(dw + state_offset + k * XL, next);
    }
    for (int k = 0; k < s.stages; ++k) {
      X multiplier;
      load<XL>(multiplier, f.costate + (k + 1) * XL);
      for (int i = 0; i < NX; ++i) {
        X value;
        load<XL>(value, f.value + ((k + 1) * NX + i) * W);
        multiplier += dw[state_offset + k * XL + i] * value;
      }
      store<XL>(dy + k * XL, multiplier);
    }
  }
};

template <int NX, int NU>
constexpr RiccatiKernels riccati_table = {Riccati<NX, NU>::XL,       Riccati<NX, NU>::UL,     Riccati<NX, NU>::W,
                                          Riccati<NX, NU>::residual, Riccati<NX, NU>::factor, Riccati<NX, NU>::solve};
