// Riccati recursion over the stages of stage_lanes.hpp; see lanes.hpp for how this file is included and theory-qp.md,
// section 4, for the recursion.

template <int NX, int NU>
struct Riccati : Stages<NX, NU> {
  using All = Stages<NX, NU>;
  using All::W, All::XL, All::UL, All::H, All::states_only;
  using typename All::Row, typename All::X, typename All::U;
  static constexpr bool transposes = NX == 4 && UL == 4 && register_lanes >= 4;

  /// One stage of the recursion on its way.
  struct alignas(64) Stage {
    double input[NU][W];    ///< the inputs' rows of F
    double left[NU][XL];    ///< their states' part with the inputs before eliminated
    double scaled[NU][XL];  ///< - the same over the pivots
    double pivot[NU];       ///< 1 / pivot
    double above[NU][NU];   ///< above the diagonal: - unit triangle of F_uu
    X curved[NX];           ///< the states' rows of F, before the inputs are eliminated
  };

  /// F = H + M'P M: the inputs' rows whole, of the states' what concerns states. state_weight(i) goes on the diagonal.
  template <class Weight>
  static SOLENOID_INLINE void form(const StagePack& s, const RiccatiPack& f, int k, const double* weight,
                                   Weight state_weight, double shift, Stage& at) {
    const double *rows = s.rows + k * NX * W, *p = f.value + (k + 1) * NX * XL, *hessian = s.hessian + k * H * W;
    Row t[NX];  // P M
    times<NX>([&](auto i) SOLENOID_INLINE_LAMBDA {
      Row even = {}, odd = {};
      times<NX>([&](auto c) SOLENOID_INLINE_LAMBDA {
        Row row;
        load<W>(row, rows + c * W);
        if (c % 2 == 0)
          even += p[i * XL + c] * row;
        else
          odd += p[i * XL + c] * row;
      });
      t[i] = even + odd;
    });
    times<NU>([&](auto j) SOLENOID_INLINE_LAMBDA {
      Row own, sum;
      unit<W>(sum, NX + j);
      load<W>(own, hessian + (NX + j) * W);
      sum = own + (weight[k * NU + j] + shift) * sum;
      times<NX>([&](auto c) SOLENOID_INLINE_LAMBDA { sum += rows[c * W + NX + j] * t[c]; });
      store<W>(at.input[j], sum);
    });
    if (k == 0) return;
    times<NX>([&](auto i) SOLENOID_INLINE_LAMBDA {
      X own, sum;
      unit<XL>(sum, i);
      load<XL>(own, hessian + i * W);
      sum = own + state_weight(i) * sum;
      times<NX>([&](auto c) SOLENOID_INLINE_LAMBDA { sum += rows[c * W + i] * first<XL, W>(t[c]); });
      at.curved[i] = sum;
    });
  }

  /// F_uu = L D L': pivots and triangle. False where a pivot is not positive.
  static SOLENOID_INLINE bool eliminate(Stage& at) {
    double a[NU][NU];
    SOLENOID_UNROLL
    for (int j = 0; j < NU; ++j) SOLENOID_UNROLL
    for (int l = j; l < NU; ++l) a[j][l] = at.input[j][NX + l];
    bool positive = true;
    if constexpr (NU == 3) {
      // By minors, whose divisions need not wait for each other: a stage is as long as its chain of dependences.
      const double b11 = a[0][0] * a[1][1] - a[0][1] * a[0][1], b12 = a[0][0] * a[1][2] - a[0][1] * a[0][2],
                   b22 = a[0][0] * a[2][2] - a[0][2] * a[0][2], c = b11 * b22 - b12 * b12;
      const double inverse0 = 1.0 / a[0][0], inverse1 = 1.0 / b11;
      at.pivot[0] = inverse0, at.pivot[1] = a[0][0] * inverse1, at.pivot[2] = a[0][0] * b11 / c;
      at.above[0][1] = -a[0][1] * inverse0, at.above[0][2] = -a[0][2] * inverse0, at.above[1][2] = -b12 * inverse1;
      return a[0][0] > 0.0 && b11 > 0.0 && c > 0.0;
    }
    SOLENOID_UNROLL
    for (int j = 0; j < NU; ++j) {
      positive &= a[j][j] > 0.0;
      at.pivot[j] = 1.0 / a[j][j];
      SOLENOID_UNROLL
      for (int l = j + 1; l < NU; ++l) {
        at.above[j][l] = -at.pivot[j] * a[j][l];
        SOLENOID_UNROLL
        for (int m = l; m < NU; ++m) a[l][m] += at.above[j][l] * a[j][m];
      }
    }
    return positive;
  }

  /// The next value function: the states' rows of F with the inputs eliminated.
  static SOLENOID_INLINE void reduce(const RiccatiPack& f, int k, Stage& at) {
    X left[NU], scaled[NU];
    times<NU>([&](auto j) SOLENOID_INLINE_LAMBDA {
      load<XL>(left[j], at.input[j]);
      times<NU>([&](auto q) SOLENOID_INLINE_LAMBDA {
        if (q < j) left[j] += at.above[q][j] * left[q];
      });
      store<XL>(at.left[j], left[j]);
      scaled[j] = -at.pivot[j] * left[j];
      store<XL>(at.scaled[j], scaled[j]);
    });
    if (k == 0) return;
    times<NX>([&](auto i) SOLENOID_INLINE_LAMBDA {
      X sum = at.curved[i];
      times<NU>([&](auto j) SOLENOID_INLINE_LAMBDA { sum += at.left[j][i] * scaled[j]; });
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
        for (int q = j; q < l; ++q) total += upper[j][q] * at.above[q][l];
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
      if constexpr (!transposes)
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
    X gains[NU], inputs[NU];
    times<NU>([&](auto j) SOLENOID_INLINE_LAMBDA {
      load<XL>(gains[j], gain + j * XL);
      load<XL>(inputs[j], columns + (NX + j) * XL);
    });
    if constexpr (transposes) {
      X closed[4], turned[4] = {};
      times<NU>([&](auto j) SOLENOID_INLINE_LAMBDA { turned[j] = gains[j]; });
      transpose(turned);
      times<NX>([&](auto i) SOLENOID_INLINE_LAMBDA { store<UL>(f.gain_t + (k * NX + i) * UL, turned[i]); });
      times<NX>([&](auto i) SOLENOID_INLINE_LAMBDA {
        load<XL>(closed[i], rows + i * W);
        times<NU>([&](auto j) SOLENOID_INLINE_LAMBDA { closed[i] -= rows[i * W + NX + j] * gains[j]; });
        store<XL>(f.closed_rows + (k * NX + i) * XL, closed[i]);
      });
      transpose(closed);
      times<NX>([&](auto i) SOLENOID_INLINE_LAMBDA { store<XL>(f.closed_columns + (k * NX + i) * XL, closed[i]); });
      return;
    }
    times<NX>([&](auto i) SOLENOID_INLINE_LAMBDA {
      X row, column;
      load<XL>(row, rows + i * W);
      load<XL>(column, columns + i * XL);
      times<NU>([&](auto j) SOLENOID_INLINE_LAMBDA {
        row -= rows[i * W + NX + j] * gains[j];
        column -= gain[j * XL + i] * inputs[j];
      });
      states_only(row);
      store<XL>(f.closed_rows + (k * NX + i) * XL, row);
      store<XL>(f.closed_columns + (k * NX + i) * XL, column);
    });
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
      const double* states = weight + state_offset + (k - 1) * XL;
      form(
          s, f, k, weight, [&](int i) { return shift + (state_rows ? states[i] : 0.0); }, shift, at);
      positive &= eliminate(at);
      reduce(f, k, at);
      store_gains(f, k, at);
      reduce_gradient(s, f, k, g + state_offset + (k - 1) * XL, g + k * NU, e + k * XL);
      close_loop(s, f, k);
    }
    return positive;
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
      All::apply(next, moved, f.closed_rows + (k - 1) * NX * XL);
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
      All::apply(next, x, f.closed_columns + k * NX * XL);
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
    }
    for (int k = 0; dy != nullptr && k < s.stages; ++k) {
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
constexpr RiccatiKernels riccati_table = {
    Riccati<NX, NU>::XL,       Riccati<NX, NU>::UL,       Riccati<NX, NU>::W,
    Riccati<NX, NU>::simulate, Riccati<NX, NU>::costates, Riccati<NX, NU>::residual,
    Riccati<NX, NU>::factor,   Riccati<NX, NU>::backward, Riccati<NX, NU>::forward};
