// A program that includes the search alone, and not the header that declares the library's kernels, has the fastest one
// that the processor runs, for each of the actuator's models: by name.
#include <cstdio>
#include <cstring>

#include <solenoid/core/systems/actuator/prestabilised.hpp>
#include <solenoid/solvers/search/branch_and_bound.hpp>

namespace {

const char* best_of_this_processor() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
    return "avx512";
  if (__builtin_cpu_supports("avx2")) return "avx2";
#endif
  return "baseline";
}

template <class M>
bool has_it(const char* model) {
  solenoid::BranchAndBound<M> search;  // its kernel is the default argument that every translation unit sees
  const auto& kernel = solenoid::rollout_kernel<M>();
  const bool right = std::strcmp(kernel.architecture, best_of_this_processor()) == 0;
  std::printf("%s: kernel %s, %d doubles a register; the processor's best is %s\n", model, kernel.architecture,
              kernel.width, best_of_this_processor());
  return right && kernel.enclose != nullptr;
}

}  // namespace

int main() {
  const bool cylinder = has_it<solenoid::PneumaticActuator>("cylinder");
  const bool hybrid = has_it<solenoid::PrestabilisedActuator>("hybrid");
  return cylinder && hybrid ? 0 : 1;
}
