// Riccati recursion over stages with compile-time sizes, one row of [x | u | 1] in the lanes of one vector;
// see lanes.hpp for how this file is included and theory-qp.md, section 4, for the recursion.

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

  /// row + amount e_lane, as arithmetic: an inserted lane would go through memory.
  static SOLENOID_INLINE void add_at(Row& row, int lane, double amount) {
    Row direction;
    unit(direction, lane);
    row += amount * direction;
  }

  /// Rows of  [H g] + M' [P (P e + p)],  M = [A B e], g and e the right-hand side.
  static SOLENOID_INLINE void backstep(const StagePack& s, const RiccatiPack& f, int k, const Row (&value)[NX],
                                       const double* g_state, const double* g_input, const double* e, Row (&h)[H]) {
    Row m[NX], t[NX], affine;
    unit(affine, one);
    const double* rows = s.rows + k * NX * W;
    const double* p = f.value + (k + 1) * NX * W;
    for (int i = 0; i < NX; ++i) {
      load<W>(m[i], rows + i * W);
      add_at(m[i], one, e[i]);
    }
    for (int i = 0; i < NX; ++i) {
      t[i] = affine * value[i];
      for (int j = 0; j < NX; ++j) t[i] += p[i * W + j] * m[j];
    }
    for (int r = 0; r < H; ++r) {
      load<W>(h[r], s.hessian + (k * H + r) * W);
      add_at(h[r], one, r < NX ? (k > 0 ? g_state[r] : 0.0) : g_input[r - NX]);
      for (int i = 0; i < NX; ++i) h[r] += rows[i * W + r] * t[i];
    }
  }

  /// Symmetric elimination of the inputs from h; what stays in the state rows is the next value function.
  static SOLENOID_INLINE bool eliminate(Row (&h)[H], const RiccatiPack& f, int k) {
    Row scaled[NU];
    double pivot[NU];
    bool positive = true;
    for (int j = 0; j < NU; ++j) {
      pivot[j] = 1.0 / h[NX + j][NX + j];
      positive &= h[NX + j][NX + j] > 0.0;
      scaled[j] = pivot[j] * h[NX + j];
      for (int r = j + 1; r < NU; ++r) h[NX + r] -= h[NX + j][NX + r] * scaled[j];
      for (int r = 0; r < NX; ++r) h[r] -= h[NX + j][r] * scaled[j];
    }
    store_gains(scaled, pivot, f, k);
    return positive;
  }

  /// Back substitution of the unit triangle: gains in closed form, and the inverse for later right-hand sides.
  static SOLENOID_INLINE void store_gains(Row (&scaled)[NU], const double (&pivot)[NU], const RiccatiPack& f, int k) {
    // Lower-triangular inverse of the unit factor, then U^-1 D^-1 U^-T.
    double upper[NU][NU] = {};
    SOLENOID_UNROLL
    for (int j = 0; j < NU; ++j) {
      upper[j][j] = 1.0;
      SOLENOID_UNROLL
      for (int l = j + 1; l < NU; ++l) {
        double total = 0.0;
        SOLENOID_UNROLL
        for (int q = j; q < l; ++q) total -= upper[j][q] * scaled[q][NX + l];
        upper[j][l] = total;
      }
    }
    SOLENOID_UNROLL
    for (int j = 0; j < NU; ++j) {
      Row gain = scaled[j];
      SOLENOID_UNROLL
      for (int l = j + 1; l < NU; ++l) gain += upper[j][l] * scaled[l];
      store<W>(f.gain + (k * NU + j) * W, gain);
      SOLENOID_UNROLL
      for (int c = 0; c < NX; ++c) f.gain_t[(k * NX + c) * UL + j] = gain[c];
      f.feedforward[k * UL + j] = gain[one];
      SOLENOID_UNROLL
      for (int l = 0; l < NU; ++l) {
        double total = 0.0;
        SOLENOID_UNROLL
        for (int q = 0; q < NU; ++q)
          if (q >= j && q >= l) total += upper[j][q] * pivot[q] * upper[l][q];
        f.inverse[(k * NU + j) * UL + l] = total;
      }
    }
  }

  /// A - B K by rows and by columns.
  static SOLENOID_INLINE void close_loop(const StagePack& s, const RiccatiPack& f, int k) {
    const double *rows = s.rows + k * NX * W, *columns = s.columns + k * H * XL, *gain = f.gain + k * NU * W;
    for (int i = 0; i < NX; ++i) {
      X row, column;
      load<XL>(row, rows + i * W);
      load<XL>(column, columns + i * XL);
      for (int j = 0; j < NU; ++j) {
        X gains, input;
        load<XL>(gains, gain + j * W);
        load<XL>(input, columns + (NX + j) * XL);
        row -= rows[i * W + NX + j] * gains;
        column -= gain[j * W + i] * input;
      }
      for (int lane = NX; lane < XL; ++lane) row[lane] = 0.0;
      store<XL>(f.closed_rows + (k * NX + i) * XL, row);
      store<XL>(f.closed_columns + (k * NX + i) * XL, column);
    }
  }

  /// The recursion backwards, the right-hand side (g, e) as one more lane of it.
  static bool factor(const StagePack& s, const RiccatiPack& f, const double* weight, const double* g, const double* e,
                     int state_offset, bool state_rows, double shift) {
    const auto state_weight = [&](int k, int i) {
      return shift + (state_rows ? weight[state_offset + (k - 1) * XL + i] : 0.0);
    };
    bool positive = true;
    Row value[NX];
    const auto keep = [&](int k) {
      for (int i = 0; i < NX; ++i) {
        store<W>(f.value + (k * NX + i) * W, value[i]);
        f.costate[k * XL + i] = value[i][one];
      }
    };
    for (int i = 0; i < NX; ++i) {
      load<W>(value[i], s.hessian + (s.stages * H + i) * W);
      add_at(value[i], i, state_weight(s.stages, i));
      add_at(value[i], one, g[state_offset + (s.stages - 1) * XL + i]);
    }
    keep(s.stages);
    for (int k = s.stages - 1; k >= 0; --k) {
      Row h[H];
      backstep(s, f, k, value, g + state_offset + (k - 1) * XL, g + k * NU, e + k * XL, h);
      for (int j = 0; j < NU; ++j) add_at(h[NX + j], NX + j, weight[k * NU + j] + shift);
      if (k > 0)
        for (int i = 0; i < NX; ++i) add_at(h[i], i, state_weight(k, i));
      positive &= eliminate(h, f, k);
      for (int i = 0; i < NX; ++i) value[i] = h[i];
      keep(k);
    }
    for (int k = 0; k < s.stages; ++k) close_loop(s, f, k);
    return positive;
  }

  /// out + x[0] m_0 + x[1] m_1 + ..., in two chains of sums; m has XL lanes a row.
  static SOLENOID_INLINE void apply(X& out, const X& x, const double* m) {
    X odd = {};
    for (int i = 0; i < NX; ++i) {
      X row;
      load<XL>(row, m + i * XL);
      if (i % 2 == 0)
        out += x[i] * row;
      else
        odd += x[i] * row;
    }
    out += odd;
  }

  /// Costates and feedforward of another right-hand side. Only p_k = q_k + (A - B K)' (p_k+1 + P e) waits for the stage
  /// after it.
  static void backward(const StagePack& s, const RiccatiPack& f, const double* g, const double* e, int state_offset) {
    for (int k = s.stages; k > 0; --k) {
      X q, moved = {};
      load<XL>(q, g + state_offset + (k - 1) * XL);
      for (int j = 0; k < s.stages && j < NU; ++j) {
        X gain;
        load<XL>(gain, f.gain + (k * NU + j) * W);
        q -= g[k * NU + j] * gain;
      }
      for (int lane = NX; lane < XL; ++lane) q[lane] = 0.0;
      for (int i = 0; i < NX; ++i) {
        X value;
        load<XL>(value, f.value + (k * NX + i) * W);
        moved += e[(k - 1) * XL + i] * value;
      }
      for (int lane = NX; lane < XL; ++lane) moved[lane] = 0.0;
      store<XL>(f.costate + k * XL, q);
      store<XL>(f.moved + k * XL, moved);
    }
    X p;
    load<XL>(p, f.costate + s.stages * XL);
    for (int k = s.stages; k > 0; --k) {
      X moved, next;
      load<XL>(moved, f.moved + k * XL);
      moved += p;
      store<XL>(f.moved + k * XL, moved);
      if (k == 1) break;
      load<XL>(next, f.costate + (k - 1) * XL);
      apply(next, moved, f.closed_rows + (k - 1) * NX * XL);
      store<XL>(f.costate + (k - 1) * XL, next);
      p = next;
    }
    for (int k = 0; k < s.stages; ++k) {
      U feedforward = {};
      for (int j = 0; j < NU; ++j) {
        double reduced = g[k * NU + j];
        for (int i = 0; i < NX; ++i) reduced += f.moved[(k + 1) * XL + i] * s.columns[(k * H + NX + j) * XL + i];
        U row;
        load<UL>(row, f.inverse + (k * NU + j) * UL);
        feedforward += reduced * row;
      }
      store<UL>(f.feedforward + k * UL, feedforward);
    }
  }

  /// The step of the latest right-hand side. Only dx+ = (A - B K) dx + d waits for the stage before it.
  static void forward(const StagePack& s, const RiccatiPack& f, const double* e, int state_offset, double* dw,
                      double* dy) {
    for (int k = 0; k < s.stages; ++k) {
      X drift;
      load<XL>(drift, e + k * XL);
      for (int j = 0; j < NU; ++j) {
        X column;
        load<XL>(column, s.columns + (k * H + NX + j) * XL);
        drift -= f.feedforward[k * UL + j] * column;
      }
      store<XL>(dw + state_offset + k * XL, drift);
    }
    X x;
    load<XL>(x, dw + state_offset);
    for (int k = 1; k < s.stages; ++k) {
      X next;
      load<XL>(next, dw + state_offset + k * XL);
      apply(next, x, f.closed_columns + k * NX * XL);
      store<XL>(dw + state_offset + k * XL, next);
      x = next;
    }
    for (int k = 0; k < s.stages; ++k) {
      U input;
      load<UL>(input, f.feedforward + k * UL);
      for (int c = 0; k > 0 && c < NX; ++c) {
        U column;
        load<UL>(column, f.gain_t + (k * NX + c) * UL);
        input += dw[state_offset + (k - 1) * XL + c] * column;
      }
      for (int j = 0; j < NU; ++j) dw[k * NU + j] = -input[j];
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
                                          Riccati<NX, NU>::residual, Riccati<NX, NU>::factor, Riccati<NX, NU>::backward,
                                          Riccati<NX, NU>::forward};
