#include "journal.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace nadir::pyramid {
namespace {

constexpr std::array<char, 8> signature = {'N', 'A', 'D', 'I', 'R', 'B', 'L', '1'};

struct Header {
  std::array<char, 8> magic = signature;
  BuildIdentity identity;
  std::uint64_t checksum = 0;
};
static_assert(std::has_unique_object_representations_v<Header>, "its bytes are what is checked");

constexpr std::uint64_t largest_record = 256 << 20;  // more tiles than memory holds in a chunk

std::uint64_t checksum_of(std::span<const std::byte> bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

Header header_of(const BuildIdentity& identity) {
  Header header;
  header.identity = identity;
  header.checksum = checksum_of(std::as_bytes(std::span(&header, 1)).first(offsetof(Header, checksum)));
  return header;
}

/// A record as bytes, and back.
class Bytes {
 public:
  template <class T>
  void put(const T& value) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  template <class T>
  void put_all(const std::vector<T>& values) {
    put(static_cast<std::uint32_t>(values.size()));
    const auto bytes = std::as_bytes(std::span(values));
    bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  }
  std::vector<std::byte> bytes_;
};

class Parser {
 public:
  explicit Parser(std::span<const std::byte> bytes) : left_(bytes) {}

  template <class T>
  bool get(T& value) {
    if (left_.size() < sizeof value) return false;
    std::memcpy(&value, left_.data(), sizeof value);
    left_ = left_.subspan(sizeof value);
    return true;
  }
  template <class T>
  bool get_all(std::vector<T>& values) {
    std::uint32_t count = 0;
    if (!get(count) || left_.size() / sizeof(T) < count) return false;
    values.resize(count);
    if (count > 0) std::memcpy(values.data(), left_.data(), count * sizeof(T));
    left_ = left_.subspan(count * sizeof(T));
    return true;
  }
  bool at_end() const { return left_.empty(); }

 private:
  std::span<const std::byte> left_;
};

std::vector<std::byte> packed(const ChunkRecord& record) {
  Bytes out;
  out.put(std::uint32_t{0});  // the size, below
  out.put(record.stage);
  out.put(record.chunk.col);
  out.put(record.chunk.row);
  out.put(static_cast<std::uint32_t>(record.holds_data));
  out.put(record.tiles_at);
  out.put(record.handed_on_at);
  out.put_all(record.tiles);
  out.put_all(record.losses);
  out.put_all(record.statistics);
  const auto size = static_cast<std::uint32_t>(out.bytes_.size() - sizeof(std::uint32_t));
  std::memcpy(out.bytes_.data(), &size, sizeof size);
  out.put(checksum_of(out.bytes_));
  return std::move(out.bytes_);
}

bool unpack(std::span<const std::byte> bytes, ChunkRecord& record) {
  Parser in(bytes);
  std::uint32_t holds_data = 0;
  const bool whole = in.get(record.stage) && in.get(record.chunk.col) && in.get(record.chunk.row) &&
                     in.get(holds_data) && in.get(record.tiles_at) && in.get(record.handed_on_at) &&
                     in.get_all(record.tiles) && in.get_all(record.losses) && in.get_all(record.statistics);
  record.holds_data = holds_data != 0;
  return whole && in.at_end();
}

}  // namespace

Journal::Journal(Journal&& other) noexcept
    : file_(std::move(other.file_)), records_(std::move(other.records_)), is_new_(other.is_new_), end_(other.end_) {}

Result<BuildIdentity> Journal::identity(const DiskFile& file) {
  Header header;
  if (const auto ok = file.read(0, std::as_writable_bytes(std::span(&header, 1))); !ok) return fail(ok);
  if (header.magic != signature || header.checksum != header_of(header.identity).checksum)
    return fail(Error::Kind::Malformed, fmt::format("{}: is no journal of a build", file.path().string()));
  return header.identity;
}

Result<Journal> Journal::open(DiskFile file, const BuildIdentity& identity) {
  Journal journal(std::move(file));
  journal.end_ = sizeof(Header);
  if (const auto before = Journal::identity(journal.file_); before && *before == identity) {
    if (const auto ok = journal.read_records(); !ok) return fail(ok);
    return journal;
  }
  journal.is_new_ = true;
  if (const auto ok = journal.file_.resize(0); !ok) return fail(ok);
  const Header header = header_of(identity);
  if (const auto ok = journal.file_.write(0, std::as_bytes(std::span(&header, 1))); !ok) return fail(ok);
  return journal;
}

Result<void> Journal::read_records() {
  const auto size = file_.size();
  if (!size) return fail(size);
  std::vector<std::byte> bytes;
  while (true) {
    std::uint32_t length = 0;
    const std::uint64_t frame = sizeof length + sizeof(std::uint64_t);
    if (end_ + frame > *size) break;
    if (const auto ok = file_.read(end_, std::as_writable_bytes(std::span(&length, 1))); !ok) return ok;
    if (length > largest_record || end_ + frame + length > *size) break;
    bytes.resize(frame + length);
    if (const auto ok = file_.read(end_, bytes); !ok) return ok;
    std::uint64_t checksum = 0;
    const auto checked = std::span<const std::byte>(bytes).first(sizeof length + length);
    std::memcpy(&checksum, bytes.data() + checked.size(), sizeof checksum);
    ChunkRecord record;
    if (checksum != checksum_of(checked) || !unpack(checked.subspan(sizeof length), record)) break;
    records_.push_back(std::move(record));
    end_ += bytes.size();
  }
  return file_.resize(end_);
}

Result<void> Journal::append(const ChunkRecord& record) {
  const std::vector<std::byte> bytes = packed(record);
  std::scoped_lock lock(mutex_);
  if (const auto ok = file_.write(end_, bytes); !ok) return ok;
  end_ += bytes.size();
  ++appended_;
  return {};
}

}  // namespace nadir::pyramid
