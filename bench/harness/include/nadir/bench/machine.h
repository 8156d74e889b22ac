#pragma once

#include <string>
#include <utility>
#include <vector>

namespace nadir::bench {

/// What was measured, and where: name and value of CPU, cores, memory, kernel, compiler, commit and date.
std::vector<std::pair<std::string, std::string>> machine();

/// `git describe --always --dirty` of the source folder; the version where that is no git repository.
const std::string& commit();

}  // namespace nadir::bench
