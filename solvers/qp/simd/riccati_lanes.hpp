// Riccati recursion over stages with compile-time sizes, one row of [x | u] in the lanes of one vector;
// see lanes.hpp for how this file is included and theory-qp.md, section 4, for the recursion.

template <int NX, int NU>
struct Riccati {
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

  /// Adds sum_j a[j * apart] b_j to two sums, b_j the rows of b; sharing each of these halves the loads.
  template <int L, int count>
  static SOLENOID_INLINE void add_products(V<L>& sum, V<L>& other, const double* a, const double* a_other, int apart,
                                           const double* b) {
    SOLENOID_UNROLL
    for (int j = 0; j < count; ++j) {
      V<L> row;
      load<L>(row, b + j * W);
      sum += a[j * apart] * row;
      other += a_other[j * apart] * row;
    }
  }

  /// Sums for rows 0 .. rows - 1, two at a time: begin(r, sum), add(sum, r, other, r + 1), end(r, sum).
  template <int L, int rows, class Begin, class Add, class End>
  static SOLENOID_INLINE void in_pairs(Begin begin, Add add, End end) {
    for (int r = 0; r < rows; r += 2) {
      const int second = r + 1 < rows ? r + 1 : r;
      V<L> sum, other;
      begin(r, sum), begin(second, other);
      add(sum, r, other, second);
      end(r, sum);
      if (second > r) end(second, other);
    }
  }

  /// One stage of the recursion on its way.
  struct alignas(64) Stage {
    double t[NX][W];       ///< P M
    double input[NU][W];   ///< the inputs' rows of F, eliminated up to their pivots
    double scaled[NU][W];  ///< - the same over the pivots: rows of a unit triangle
    double pivot[NU];      ///< 1 / pivot
  };

  /// T = P M, then the inputs' rows of F = H + M'T, and their elimination from each other.
  static SOLENOID_INLINE bool eliminate_inputs(const StagePack& s, const RiccatiPack& f, int k, const double* weight,
                                               double shift, Stage& at) {
    const double *rows = s.rows + k * NX * W, *p = f.value + (k + 1) * NX * XL, *hessian = s.hessian + k * H * W;
    in_pairs<W, NX>([](int, Row& sum) { sum = Row{}; },
                    [&](Row& sum, int r, Row& other, int second) {
                      add_products<W, NX>(sum, other, p + r * XL, p + second * XL, 1, rows);
                    },
                    [&](int r, const Row& sum) { store<W>(at.t[r], sum); });
    in_pairs<W, NU>(
        [&](int j, Row& sum) {
          unit<W>(sum, NX + j);
          Row own;
          load<W>(own, hessian + (NX + j) * W);
          sum = own + (weight[k * NU + j] + shift) * sum;
        },
        [&](Row& sum, int j, Row& other, int second) {
          add_products<W, NX>(sum, other, rows + NX + j, rows + NX + second, W, at.t[0]);
        },
        [&](int j, const Row& sum) { store<W>(at.input[j], sum); });
    bool positive = true;
    for (int j = 0; j < NU; ++j) {
      positive &= at.input[j][NX + j] > 0.0;
      at.pivot[j] = 1.0 / at.input[j][NX + j];
      Row row;
      load<W>(row, at.input[j]);
      const Row scaled = -at.pivot[j] * row;
      store<W>(at.scaled[j], scaled);
      for (int l = j + 1; l < NU; ++l) {
        Row later;
        load<W>(later, at.input[l]);
        later += at.input[j][NX + l] * scaled;
        store<W>(at.input[l], later);
      }
    }
    return positive;
  }

  /// The next value function: the states' rows of F with the inputs eliminated. state_weight(i) goes on the diagonal.
  template <class Weight>
  static SOLENOID_INLINE void reduce_states(const StagePack& s, const RiccatiPack& f, int k, Weight state_weight,
                                            const Stage& at) {
    const double *rows = s.rows + k * NX * W, *hessian = s.hessian + k * H * W;
    in_pairs<XL, NX>(
        [&](int i, X& sum) {
          unit<XL>(sum, i);
          X own;
          load<XL>(own, hessian + i * W);
          sum = own + state_weight(i) * sum;
        },
        [&](X& sum, int i, X& other, int second) {
          add_products<XL, NX>(sum, other, rows + i, rows + second, W, at.t[0]);
          add_products<XL, NU>(sum, other, at.input[0] + i, at.input[0] + second, W, at.scaled[0]);
        },
        [&](int i, X& sum) {
          states_only(sum);
          store<XL>(f.value + (k * NX + i) * XL, sum);
        });
  }

  /// Back substitution of the unit triangle: gains in closed form, and the inverse for right-hand sides.
  static SOLENOID_INLINE void store_gains(const RiccatiPack& f, int k, const Stage& at) {
    double upper[NU][NU] = {};  // inverse of the unit triangle
    SOLENOID_UNROLL
    for (int j = 0; j < NU; ++j) {
      upper[j][j] = 1.0;
      SOLENOID_UNROLL
      for (int l = j + 1; l < NU; ++l) {
        double total = 0.0;
        SOLENOID_UNROLL
        for (int q = j; q < l; ++q) total += upper[j][q] * at.scaled[q][NX + l];
        upper[j][l] = total;
      }
    }
    SOLENOID_UNROLL
    for (int j = 0; j < NU; ++j) {
      X gain, row;
      load<XL>(gain, at.scaled[j]);
      SOLENOID_UNROLL
      for (int l = j + 1; l < NU; ++l) {
        load<XL>(row, at.scaled[l]);
        gain += upper[j][l] * row;
      }
      gain = -gain;
      states_only(gain);
      double* kept = f.gain + (k * NU + j) * XL;
      store<XL>(kept, gain);
      for (int c = 0; c < NX; ++c) f.gain_t[(k * NX + c) * UL + j] = kept[c];
      SOLENOID_UNROLL
      for (int l = 0; l < NU; ++l) {
        double total = 0.0;
        SOLENOID_UNROLL
        for (int q = 0; q < NU; ++q)
          if (q >= j && q >= l) total += upper[j][q] * at.pivot[q] * upper[l][q];
        f.inverse[(k * NU + j) * UL + l] = total;
      }
    }
  }

  /// p and k of a first right-hand side:  r = g + M'(p + P e),  k = F_uu^-1 r_u,  p = r_x - K' r_u.
  static SOLENOID_INLINE void reduce_gradient(const StagePack& s, const RiccatiPack& f, int k, const double* g_state,
                                              const double* g_input, const double* e) {
    X moved, p = {};
    load<XL>(moved, f.costate + (k + 1) * XL);
    for (int i = 0; i < NX; ++i) {
      X value;
      load<XL>(value, f.value + ((k + 1) * NX + i) * XL);
      moved += e[i] * value;
    }
    double* along = f.moved + (k + 1) * XL;
    store<XL>(along, moved);
    Row r = {};
    for (int i = 0; i < NX; ++i) {
      Row row;
      load<W>(row, s.rows + (k * NX + i) * W);
      r += along[i] * row;
    }
    alignas(64) double reduced[W];
    store<W>(reduced, r);
    U feedforward = {};
    for (int j = 0; j < NU; ++j) {
      const double input = reduced[NX + j] + g_input[j];
      U inverse;
      load<UL>(inverse, f.inverse + (k * NU + j) * UL);
      feedforward += input * inverse;
      X gain;
      load<XL>(gain, f.gain + (k * NU + j) * XL);
      p -= input * gain;
    }
    store<UL>(f.feedforward + k * UL, feedforward);
    if (k == 0) return;
    X state, own;
    load<XL>(state, reduced);
    states_only(state);
    load<XL>(own, g_state);
    p += state + own;
    store<XL>(f.costate + k * XL, p);
  }

  /// A - B K by rows and by columns.
  static SOLENOID_INLINE void close_loop(const StagePack& s, const RiccatiPack& f, int k) {
    const double *rows = s.rows + k * NX * W, *columns = s.columns + k * H * XL, *gain = f.gain + k * NU * XL;
    for (int i = 0; i < NX; ++i) {
      X row, column;
      load<XL>(row, rows + i * W);
      load<XL>(column, columns + i * XL);
      for (int j = 0; j < NU; ++j) {
        X gains, input;
        load<XL>(gains, gain + j * XL);
        load<XL>(input, columns + (NX + j) * XL);
        row -= rows[i * W + NX + j] * gains;
        column -= gain[j * XL + i] * input;
      }
      states_only(row);
      store<XL>(f.closed_rows + (k * NX + i) * XL, row);
      store<XL>(f.closed_columns + (k * NX + i) * XL, column);
    }
  }

  /// The recursion backwards, with a first right-hand side (g, e).
  static bool factor(const StagePack& s, const RiccatiPack& f, const double* weight, const double* g, const double* e,
                     int state_offset, bool state_rows, double shift) {
    bool positive = true;
    const double* last = s.hessian + s.stages * H * W;
    const double* g_last = g + state_offset + (s.stages - 1) * XL;
    for (int i = 0; i < NX; ++i) {
      double* value = f.value + (s.stages * NX + i) * XL;
      for (int c = 0; c < NX; ++c) value[c] = last[i * W + c];
      value[i] += shift + (state_rows ? weight[state_offset + (s.stages - 1) * XL + i] : 0.0);
      f.costate[s.stages * XL + i] = g_last[i];
    }
    for (int k = s.stages - 1; k >= 0; --k) {
      Stage at;
      positive &= eliminate_inputs(s, f, k, weight, shift, at);
      const double* states = weight + state_offset + (k - 1) * XL;
      if (k > 0)
        reduce_states(
            s, f, k, [&](int i) { return shift + (state_rows ? states[i] : 0.0); }, at);
      store_gains(f, k, at);
      reduce_gradient(s, f, k, g + state_offset + (k - 1) * XL, g + k * NU, e + k * XL);
    }
    for (int k = 0; k < s.stages; ++k) close_loop(s, f, k);
    return positive;
  }

  /// out + x[0] m_0 + x[1] m_1 + ..., in two chains of sums; m has XL lanes a row.
  static SOLENOID_INLINE void apply(X& out, const X& x, const double* m) {
    X odd = {};
    SOLENOID_UNROLL
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
        load<XL>(gain, f.gain + (k * NU + j) * XL);
        q -= g[k * NU + j] * gain;
      }
      for (int i = 0; i < NX; ++i) {
        X value;
        load<XL>(value, f.value + (k * NX + i) * XL);
        moved += e[(k - 1) * XL + i] * value;
      }
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
        load<XL>(value, f.value + ((k + 1) * NX + i) * XL);
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
