#include "nadir/transfer/disk_cache.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <xxhash.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <map>
#include <tuple>
#include <vector>

#include "http.h"
#include "nadir/base/byte_source.h"
#include "nadir/base/files.h"
#include "nadir/base/text.h"

namespace nadir::transfer {
namespace fs = std::filesystem;
namespace {

/// Names carry the format's number: what a later one writes, this one neither reads nor mistakes.
constexpr std::string_view block_suffix = ".1.block";
constexpr std::string_view version_suffix = ".1.version";
constexpr std::string_view temporary_mark = ".part";
/// A temporary file older than this is left from a process that died.
constexpr auto writing_takes_at_most = std::chrono::hours(1);

DiskCache::FileKey hash_of(std::string_view text) {
  const XXH128_hash_t hash = XXH3_128bits(text.data(), text.size());
  return {hash.high64, hash.low64};
}

/// Two hundred and fifty-six folders, so that none grows long.
fs::path path_of(const fs::path& folder, const DiskCache::FileKey& key, std::string_view suffix) {
  const std::string name = fmt::format("{:016x}{:016x}", key[0], key[1]);
  return folder / name.substr(0, 2) / (name.substr(2) + std::string(suffix));
}

DiskCache::FileKey block_key(const DiskCache::FileKey& file, std::uint64_t index) {
  const std::array<std::uint64_t, 3> parts = {file[0], file[1], index};
  return hash_of({reinterpret_cast<const char*>(parts.data()), sizeof parts});
}

/// Seeded with the name, so that a whole block under a wrong name is noticed too.
std::uint64_t checksum(std::span<const std::byte> bytes, const DiskCache::FileKey& name) {
  return XXH3_64bits_withSeed(bytes.data(), bytes.size(), name[1]);
}

void touch(const fs::path& path) { ::utimensat(AT_FDCWD, path.c_str(), nullptr, 0); }

bool is_ours(std::string_view name) {
  return name.ends_with(block_suffix) || name.ends_with(version_suffix) ||
         name.find(temporary_mark) != std::string_view::npos;
}

}  // namespace

std::shared_ptr<DiskCache> DiskCache::shared(const fs::path& folder, std::uint64_t budget_bytes) {
  static std::mutex mutex;
  static std::map<std::pair<fs::path, std::uint64_t>, std::shared_ptr<DiskCache>> caches;
  std::scoped_lock lock(mutex);
  auto& cache = caches[{folder, budget_bytes}];
  if (!cache) cache = std::make_shared<DiskCache>(folder, budget_bytes);
  return cache;
}

fs::path DiskCache::default_folder() {
  if (const char* const cache = std::getenv("XDG_CACHE_HOME"); cache && *cache == '/') return fs::path(cache) / "nadir";
  if (const char* const home = std::getenv("HOME"); home && *home == '/') return fs::path(home) / ".cache" / "nadir";
  return {};
}

DiskCache::FileKey DiskCache::file_key(std::string_view url, const FileVersion& version) {
  return hash_of(fmt::format("{}\n{}\n{}\n{}", url, version.size, version.etag,
                             version.etag.empty() ? version.last_modified : ""));
}

std::optional<FileVersion> DiskCache::version(std::string_view url) {
  const fs::path path = path_of(folder_, hash_of(url), version_suffix);
  const auto text = read_text_file(path, 64 << 10);
  if (!text) return std::nullopt;
  const std::vector<std::string_view> lines = split(*text, '\n');  // url, size, etag, date, checksum
  if (lines.size() != 6 || lines[0] != url) return std::nullopt;
  const auto size = parse_digits(lines[1]);
  const std::string_view summed =
      std::string_view(*text).substr(0, static_cast<std::size_t>(lines[4].data() - text->data()));
  if (!size || lines[4] != fmt::format("{:016x}", XXH3_64bits(summed.data(), summed.size()))) return std::nullopt;
  touch(path);
  return FileVersion{*size, std::string(lines[2]), std::string(lines[3])};
}

void DiskCache::remember_version(std::string_view url, const FileVersion& version) {
  std::string text = fmt::format("{}\n{}\n{}\n{}\n", url, version.size, version.etag, version.last_modified);
  text += fmt::format("{:016x}\n", XXH3_64bits(text.data(), text.size()));
  write(path_of(folder_, hash_of(url), version_suffix), text);
}

bool DiskCache::load(const FileKey& file, std::uint64_t index, std::span<std::byte> out) {
  const FileKey key = block_key(file, index);
  {
    const std::scoped_lock lock(queue_mutex_);
    if (const auto it = waiting_.find(key); it != waiting_.end() && it->second->bytes.size() == out.size()) {
      std::copy(it->second->bytes.begin(), it->second->bytes.end(), out.begin());
      return true;
    }
  }
  const fs::path path = path_of(folder_, key, block_suffix);
  const auto source = LocalFile::open(path.string());
  if (!source) return false;
  std::uint64_t kept_sum = 0;
  const std::array requests = {ByteRequest{0, out},
                               ByteRequest{out.size(), std::as_writable_bytes(std::span(&kept_sum, 1))}};
  if ((*source)->size() != out.size() + sizeof kept_sum || !(*source)->read_many(requests) ||
      kept_sum != checksum(out, key)) {
    std::error_code error;
    fs::remove(path, error);
    return false;
  }
  touch(path);
  return true;
}

void DiskCache::store(const FileKey& file, std::uint64_t index, std::span<const std::byte> block,
                      std::function<void()> failed) {
  constexpr std::uint64_t most_waiting_bytes = 64 << 20;
  const FileKey key = block_key(file, index);
  auto waiting = std::make_shared<const Block>(Block{{block.begin(), block.end()}, std::move(failed)});
  {
    const std::scoped_lock lock(queue_mutex_);
    if (waiting_.contains(key)) return;
    if (waiting_bytes_ + block.size() <= most_waiting_bytes) {
      waiting_.emplace(key, waiting);
      order_.push_back(key);
      waiting_bytes_ += block.size();
      if (!worker_.joinable()) worker_ = std::thread([this] { work(); });
      waiting = nullptr;
    }
  }
  queue_changed_.notify_all();
  if (waiting) write_block(key, *waiting);
}

void DiskCache::write_block(const FileKey& key, const Block& block) {
  const std::uint64_t sum = checksum(block.bytes, key);
  std::string bytes(reinterpret_cast<const char*>(block.bytes.data()), block.bytes.size());
  bytes.append(reinterpret_cast<const char*>(&sum), sizeof sum);
  if (!write(path_of(folder_, key, block_suffix), bytes)) block.failed();
}

void DiskCache::work() {
  std::unique_lock lock(queue_mutex_);
  for (;;) {
    queue_changed_.wait(lock, [&] { return closing_ || !order_.empty(); });
    if (order_.empty()) return;
    const FileKey key = order_.front();
    const auto block = waiting_.at(key);
    lock.unlock();
    write_block(key, *block);
    lock.lock();
    order_.pop_front();
    waiting_.erase(key);
    waiting_bytes_ -= block->bytes.size();
    queue_changed_.notify_all();
  }
}

void DiskCache::finish_writing() {
  std::unique_lock lock(queue_mutex_);
  queue_changed_.wait(lock, [&] { return order_.empty(); });
}

DiskCache::~DiskCache() {
  {
    const std::scoped_lock lock(queue_mutex_);
    closing_ = true;
  }
  queue_changed_.notify_all();
  if (worker_.joinable()) worker_.join();
}

bool DiskCache::write(const fs::path& path, std::string_view bytes) {
  if (!writable_) return false;
  if (bytes.size() > budget_bytes_) return true;  // a budget below one block keeps nothing, as it was told
  std::error_code error;
  if (!fs::exists(folder_, error)) {
    fs::create_directories(folder_, error);
    fs::permissions(folder_, fs::perms::owner_all, error);  // what one user may read is not for all others
  }
  make_room(bytes.size());
  if (write_file(path, bytes)) return true;
  writable_ = false;
  return false;
}

void DiskCache::make_room(std::uint64_t bytes) {
  std::scoped_lock lock(room_mutex_);
  // Look again now and then, since other processes write too.
  written_since_look_ += bytes;
  const bool is_known = used_bytes_ && written_since_look_ < budget_bytes_ / 16;
  if (is_known && *used_bytes_ + bytes <= budget_bytes_) {
    *used_bytes_ += bytes;
    return;
  }

  struct Kept {
    bool is_version;  // small, and without them blocks are not found again: these go last
    fs::file_time_type used;
    std::uint64_t size;
    fs::path path;
  };
  std::vector<Kept> all;
  std::uint64_t used = 0;
  std::error_code error;
  const auto now = fs::file_time_type::clock::now();
  for (const auto& folder : fs::directory_iterator(folder_, error)) {
    std::error_code gone;  // other processes make room as well
    for (auto it = fs::directory_iterator(folder.path(), gone); !gone && it != fs::directory_iterator();
         it.increment(gone)) {
      const std::string name = it->path().filename().string();
      std::error_code missing;
      const std::uint64_t size = it->file_size(missing);
      const fs::file_time_type time = missing ? fs::file_time_type{} : it->last_write_time(missing);
      if (missing || !is_ours(name)) continue;
      const bool is_temporary = name.find(temporary_mark) != std::string::npos;
      if (is_temporary && now - time > writing_takes_at_most) fs::remove(it->path(), missing);
      if (is_temporary) continue;
      used += size;
      all.push_back({name.ends_with(version_suffix), time, size, it->path()});
    }
  }

  // Some more than needed, so that not every block looks again.
  if (used + bytes > budget_bytes_) {
    std::sort(all.begin(), all.end(), [](const Kept& a, const Kept& b) {
      return std::tie(a.is_version, a.used) < std::tie(b.is_version, b.used);
    });
    const std::uint64_t goal = budget_bytes_ - std::min(budget_bytes_, budget_bytes_ / 10 + bytes);
    for (const Kept& kept : all) {
      if (used <= goal) break;
      fs::remove(kept.path, error);
      used -= kept.size;
    }
  }
  used_bytes_ = used + bytes;
  written_since_look_ = 0;
}

}  // namespace nadir::transfer
