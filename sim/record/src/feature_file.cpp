#include "nadir/record/feature_file.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>

namespace nadir::record {
namespace fs = std::filesystem;
namespace {

const std::string head = R"({"type":"FeatureCollection","features":[)", tail = "\n]}\n";

}  // namespace

Result<FeatureFile> FeatureFile::create(const fs::path& path) {
  FeatureFile file;
  file.path_ = path;
  file.file_.reset(std::fopen(path.c_str(), "wb"));
  if (!file.file_)
    return fail(Error::Kind::Io, fmt::format("{}: cannot write: {}", path.string(), std::strerror(errno)));
  std::setvbuf(file.file_.get(), nullptr, _IONBF, 0);  // each addition in one piece
  if (auto ok = file.write(head + tail); !ok) return fail(ok);
  file.end_ = static_cast<long>(head.size());
  return file;
}

Result<void> FeatureFile::write(const std::string& text) {
  if (std::fseek(file_.get(), end_, SEEK_SET) == 0 &&
      std::fwrite(text.data(), 1, text.size(), file_.get()) == text.size())
    return {};
  return fail(Error::Kind::Io, fmt::format("{}: writing failed: {}", path_.string(), std::strerror(errno)));
}

Result<void> FeatureFile::add(const std::vector<std::string>& features) {
  if (features.empty()) return {};
  std::string text;
  for (const std::string& feature : features) text += (empty_ && text.empty() ? "\n" : ",\n") + feature;
  if (auto ok = write(text + tail); !ok) {
    // Of a disk that is full it took a part, which goes again
    std::error_code error;
    fs::resize_file(path_, static_cast<std::uintmax_t>(end_), error);
    (void)write(tail);
    return ok;
  }
  end_ += static_cast<long>(text.size());
  empty_ = false;
  return {};
}

}  // namespace nadir::record
