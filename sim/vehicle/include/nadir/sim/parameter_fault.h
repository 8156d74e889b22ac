#pragma once

#include <span>
#include <string>

namespace nadir::sim {

/// What is wrong with a parameter of a vehicle, by its key in a parameter file: "rotors.front left", "stiffness_npm".
struct ParameterFault {
  std::string key, message;
};

/// "key: message; key: message".
std::string to_string(std::span<const ParameterFault> faults);

}  // namespace nadir::sim
