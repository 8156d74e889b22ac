#include "kernels.h"

#include <cstdlib>
#include <string_view>

#ifdef NADIR_HAVE_SIMD
#include "vector_kernels.h"
#endif

namespace nadir::render {

std::vector<const Kernels*> all_kernels() {
  std::vector<const Kernels*> all = {&scalar_kernels()};
#ifdef NADIR_HAVE_SIMD
  const auto vectors = vector_kernels();
  all.insert(all.end(), vectors.begin(), vectors.end());
#endif
  return all;
}

const Kernels& best_kernels() {
  static const Kernels& best = [&]() -> const Kernels& {
    const char* choice = std::getenv("NADIR_SIMD");
    return choice && std::string_view(choice) == "off" ? scalar_kernels() : *all_kernels().back();
  }();
  return best;
}

}  // namespace nadir::render
