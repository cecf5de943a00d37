// Vector lanes for the QP kernels. Included once per instruction set, inside that set's own namespace
// (SOLENOID_QP_ISA), so that no function compiled for one processor can be linked into code for another.
// For the same reason the kernels call nothing inline from the standard library.

#define SOLENOID_INLINE inline __attribute__((always_inline))
#define SOLENOID_INLINE_LAMBDA __attribute__((always_inline))
// Small loops over lanes or rows whose counters choose constants.
#define SOLENOID_UNROLL _Pragma("GCC unroll 16")

// Doubles that a register of the instruction set compiled for holds.
#if defined(__AVX512F__)
constexpr int register_lanes = 8;
#elif defined(__AVX__)
constexpr int register_lanes = 4;
#else
constexpr int register_lanes = 2;
#endif

constexpr int power_of_two(int least, int n) { return least >= n ? least : power_of_two(2 * least, n); }
constexpr int multiple_of(int unit, int n) { return (n + unit - 1) / unit * unit; }

template <int Lanes>
struct Halves;

/// `Lanes` doubles, an even number: the compiler's own vector where it fits a register, two parts where it does not.
/// GCC keeps vectors wider than a register in memory and takes them apart there, at half of the kernels' speed.
template <int Lanes, bool fits = (Lanes <= register_lanes)>
struct Vector {
  typedef double Type __attribute__((vector_size(Lanes * 8)));
  typedef double Unaligned __attribute__((vector_size(Lanes * 8), aligned(8), may_alias));
};
template <int Lanes>
struct Vector<Lanes, false> {
  typedef Halves<Lanes> Type;
};
template <int Lanes>
using V = typename Vector<Lanes>::Type;

template <int Lanes>
struct Halves {
  static constexpr int low_lanes = power_of_two(1, (Lanes + 1) / 2), high_lanes = Lanes - low_lanes;
  V<low_lanes> low;
  V<high_lanes> high;

  SOLENOID_INLINE double operator[](int i) const { return i < low_lanes ? low[i] : high[i - low_lanes]; }
  SOLENOID_INLINE Halves& operator+=(const Halves& b) {
    low += b.low, high += b.high;
    return *this;
  }
  SOLENOID_INLINE Halves& operator-=(const Halves& b) {
    low -= b.low, high -= b.high;
    return *this;
  }
  SOLENOID_INLINE Halves operator-() const { return {-low, -high}; }
};

#define SOLENOID_HALVES(op)                                                                   \
  template <int Lanes>                                                                        \
  SOLENOID_INLINE Halves<Lanes> operator op(const Halves<Lanes>& a, const Halves<Lanes>& b) { \
    return {a.low op b.low, a.high op b.high};                                                \
  }                                                                                           \
  template <int Lanes>                                                                        \
  SOLENOID_INLINE Halves<Lanes> operator op(double a, const Halves<Lanes>& b) {               \
    return {a op b.low, a op b.high};                                                         \
  }
SOLENOID_HALVES(+)
SOLENOID_HALVES(-)
SOLENOID_HALVES(*)
SOLENOID_HALVES(/)
#undef SOLENOID_HALVES

template <int Lanes>
SOLENOID_INLINE void load(V<Lanes>& out, const double* from) {
  if constexpr (Lanes <= register_lanes) {
    out = *reinterpret_cast<const typename Vector<Lanes>::Unaligned*>(from);
  } else {
    load<V<Lanes>::low_lanes>(out.low, from);
    load<V<Lanes>::high_lanes>(out.high, from + V<Lanes>::low_lanes);
  }
}
template <int Lanes>
SOLENOID_INLINE void store(double* to, const V<Lanes>& from) {
  if constexpr (Lanes <= register_lanes) {
    *reinterpret_cast<typename Vector<Lanes>::Unaligned*>(to) = from;
  } else {
    store<V<Lanes>::low_lanes>(to, from.low);
    store<V<Lanes>::high_lanes>(to + V<Lanes>::low_lanes, from.high);
  }
}

SOLENOID_INLINE double larger(double a, double b) { return a > b ? a : b; }

/// most <- the larger, lane by lane.
template <class Lanes>
SOLENOID_INLINE void raise(Lanes& most, const Lanes& x) {
  most = x > most ? x : most;
}
template <int Lanes>
SOLENOID_INLINE void raise(Halves<Lanes>& most, const Halves<Lanes>& x) {
  raise(most.low, x.low), raise(most.high, x.high);
}
template <class Lanes>
SOLENOID_INLINE void raise_magnitude(Lanes& most, const Lanes& x) {
  raise(most, x), raise(most, Lanes(-x));
}
/// x in the lanes where `sign` is positive, 0 elsewhere.
template <class Lanes>
SOLENOID_INLINE Lanes where_positive(const Lanes& sign, const Lanes& x) {
  return sign > 0.0 ? x : Lanes{};
}
template <int Lanes>
SOLENOID_INLINE Halves<Lanes> where_positive(const Halves<Lanes>& sign, const Halves<Lanes>& x) {
  return {where_positive(sign.low, x.low), where_positive(sign.high, x.high)};
}

template <int count>
SOLENOID_INLINE double largest_of(const double* x) {
  if constexpr (count == 1)
    return x[0];
  else
    return larger(largest_of<count / 2>(x), largest_of<count - count / 2>(x + count / 2));
}
template <int count>
SOLENOID_INLINE double sum_of(const double* x) {
  if constexpr (count == 1)
    return x[0];
  else
    return sum_of<count / 2>(x) + sum_of<count - count / 2>(x + count / 2);
}
/// The largest entry or 0, and the sum, by halves: a chain through all lanes would take longer than the loop before it.
template <int Lanes>
SOLENOID_INLINE double largest(const V<Lanes>& x) {
  double all[Lanes];
  store<Lanes>(all, x);
  return larger(largest_of<Lanes>(all), 0.0);
}
template <int Lanes>
SOLENOID_INLINE double sum(const V<Lanes>& x) {
  double all[Lanes];
  store<Lanes>(all, x);
  return sum_of<Lanes>(all);
}

/// 1 in lane `lane` of up to 32, 0 elsewhere: no lane is inserted, which would go through memory.
constexpr double one_of_many[64] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
                                    0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
/// 1 in the first so many of up to 32 lanes, read from 32 less so many on.
constexpr double first_of_many[64] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1,
                                      1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
template <int Lanes>
SOLENOID_INLINE void unit(V<Lanes>& out, int lane) {
  load<Lanes>(out, one_of_many + 32 - lane);
}

template <int at>
struct Constant {
  constexpr operator int() const { return at; }
};
/// what(0), what(1), ... with constants where there are few, so that arrays of vectors live in registers.
template <int count, int at = 0, class What>
SOLENOID_INLINE void times(const What& what) {
  if constexpr (count > 8) {
    for (int i = 0; i < count; ++i) what(i);
  } else if constexpr (at < count) {
    what(Constant<at>{});
    times<count, at + 1>(what);
  }
}

/// The first `Lanes` of `all`.
template <int Lanes, int all>
SOLENOID_INLINE V<Lanes> first(const V<all>& x) {
  if constexpr (Lanes == all) {
    return x;
  } else if constexpr (all <= register_lanes) {
    union {
      V<all> whole;
      V<Lanes> part;
    } either = {x};
    return either.part;
  } else if constexpr (Lanes <= V<all>::low_lanes) {
    return first<Lanes, V<all>::low_lanes>(x.low);
  } else {
    double every[all];
    store<all>(every, x);
    V<Lanes> out;
    load<Lanes>(out, every);
    return out;
  }
}

/// Rows become columns.
template <class Lanes>
SOLENOID_INLINE void transpose(Lanes (&rows)[4]) {
  const Lanes a = __builtin_shufflevector(rows[0], rows[1], 0, 4, 2, 6),
              b = __builtin_shufflevector(rows[0], rows[1], 1, 5, 3, 7),
              c = __builtin_shufflevector(rows[2], rows[3], 0, 4, 2, 6),
              d = __builtin_shufflevector(rows[2], rows[3], 1, 5, 3, 7);
  rows[0] = __builtin_shufflevector(a, c, 0, 1, 4, 5), rows[1] = __builtin_shufflevector(b, d, 0, 1, 4, 5);
  rows[2] = __builtin_shufflevector(a, c, 2, 3, 6, 7), rows[3] = __builtin_shufflevector(b, d, 2, 3, 6, 7);
}
