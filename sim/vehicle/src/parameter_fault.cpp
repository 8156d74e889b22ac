#include "nadir/sim/parameter_fault.h"

namespace nadir::sim {

std::string to_string(std::span<const ParameterFault> faults) {
  std::string text;
  for (const ParameterFault& fault : faults) text += (text.empty() ? "" : "; ") + fault.key + ": " + fault.message;
  return text;
}

}  // namespace nadir::sim
