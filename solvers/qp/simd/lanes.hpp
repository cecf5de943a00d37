// Vector lanes for the QP kernels. Included once per instruction set, inside that set's own namespace
// (SOLENOID_QP_ISA), so that no function compiled for one processor can be linked into code for another.
// For the same reason the kernels call nothing inline from the standard library.

template <int Lanes>
struct Vector {
  typedef double Type __attribute__((vector_size(Lanes * 8)));
  typedef double Unaligned __attribute__((vector_size(Lanes * 8), aligned(8), may_alias));
};
template <int Lanes>
using V = typename Vector<Lanes>::Type;

#define SOLENOID_INLINE inline __attribute__((always_inline))
// Small loops whose counters choose lanes: left rolled, the lanes go through memory.
#define SOLENOID_UNROLL _Pragma("GCC unroll 16")

template <int Lanes>
SOLENOID_INLINE void load(V<Lanes>& out, const double* from) {
  out = *reinterpret_cast<const typename Vector<Lanes>::Unaligned*>(from);
}
template <int Lanes>
SOLENOID_INLINE void store(double* to, const V<Lanes>& from) {
  *reinterpret_cast<typename Vector<Lanes>::Unaligned*>(to) = from;
}

constexpr int power_of_two(int least, int n) { return least >= n ? least : power_of_two(2 * least, n); }

SOLENOID_INLINE double larger(double a, double b) { return a > b ? a : b; }
template <class Lanes>
SOLENOID_INLINE void raise(Lanes& most, const Lanes& x) {
  most = x > most ? x : most;
}
template <class Lanes>
SOLENOID_INLINE void raise_magnitude(Lanes& most, const Lanes& x) {
  const Lanes magnitude = x < 0.0 ? -x : x;
  most = magnitude > most ? magnitude : most;
}

template <int Lanes>
SOLENOID_INLINE double largest(const V<Lanes>& x, int count = Lanes) {
  double most = 0.0;
  for (int i = 0; i < count; ++i) most = larger(most, x[i]);
  return most;
}
template <int Lanes>
SOLENOID_INLINE double sum(const V<Lanes>& x) {
  double total = 0.0;
  for (int i = 0; i < Lanes; ++i) total += x[i];
  return total;
}
