#pragma once

#include <utility>

namespace nadir::pyramid {

/// Runs `Kernel::run(...)`, which is always inline, as compiled for this CPU: the same operations in the same order
/// (compilers do not reorder those of floats), more of them at once. Tests compare both.
#if defined(__x86_64__)
inline bool has_avx2() {
  static const bool found = __builtin_cpu_supports("avx2");
  return found;
}
template <class Kernel, class... Args>
[[gnu::target("avx2")]] auto run_avx2(Args... args) {
  return Kernel::run(args...);
}
template <class Kernel, class... Args>
auto run(Args... args) {
  return has_avx2() ? run_avx2<Kernel>(args...) : Kernel::run(args...);
}
#else
template <class Kernel, class... Args>
auto run(Args... args) {
  return Kernel::run(args...);
}
#endif

}  // namespace nadir::pyramid
