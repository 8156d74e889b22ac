#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "nadir/base/result.h"

namespace nadir {

/// All bytes of a text file of at most `limit_bytes`.
Result<std::string> read_text_file(const std::filesystem::path& path, std::size_t limit_bytes = 64 << 20);

/// Writes through a temporary file beside `path` and renames it: afterwards `path` holds all of
/// `bytes`, or what it held before. Missing folders are made.
Result<void> write_file(const std::filesystem::path& path, std::string_view bytes);

/// A name beside `path`, unused so far, for a file that will be renamed to `path` once it is whole.
/// It keeps the extension, by which image libraries choose the format.
std::filesystem::path temporary_name(const std::filesystem::path& path);

/// Renames `from`, complete and closed, to `to`; on failure `from` is removed.
Result<void> move_into_place(const std::filesystem::path& from, const std::filesystem::path& to);

/// Error::Exists, with advice, where `path` is there (a folder only if something is in it) and `force` is not set.
Result<void> refuse_to_overwrite(const std::filesystem::path& path, bool force);

}  // namespace nadir
