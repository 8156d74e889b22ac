#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace nadir {

/// Why work on outside data failed. The message names the file or setting, what was
/// expected and what was found, so that it can be acted on without the code.
struct Error {
  enum class Kind {
    NotFound,     // no such file, layer, band or column
    Malformed,    // it is there, and breaks its own format
    Unsupported,  // well formed, and we do not do that
    Damaged,      // a part of it cannot be decoded; the rest stays usable
    Io,           // reading or writing failed: disk full, truncated, permissions
    OverBudget,   // would need more memory than the budget allows
    OutsideMap,   // the camera sees what no map covers, and the caller asked for no frame then
    Exists,       // the output is there already
  };
  Kind kind;
  std::string message;
};

template <class T>
using Result = tl::expected<T, Error>;  // std::expected once we move to C++23

/// `return fail(Error::Kind::NotFound, "map.tif: ...")` from a function that returns any Result.
inline tl::unexpected<Error> fail(Error::Kind kind, std::string message) {
  return tl::unexpected(Error{kind, std::move(message)});
}

/// Hands on the error of another result.
template <class T>
tl::unexpected<Error> fail(const Result<T>& failed) {
  return tl::unexpected(failed.error());
}

}  // namespace nadir
