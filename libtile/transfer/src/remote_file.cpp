#include "nadir/transfer/remote_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "nadir/base/text.h"
#include "range_exchange.h"

namespace nadir::transfer {
namespace {

constexpr std::uint64_t block_bytes = DiskCache::block_bytes;

/// Bytes [begin, end) of a file.
struct Extent {
  std::uint64_t begin = 0;
  std::uint64_t end = 0;
};

/// What lies in both `bytes`, from `offset` on, and `request`, copied there.
void copy_overlap(std::span<const std::byte> bytes, std::uint64_t offset, const ByteRequest& request) {
  const std::uint64_t begin = std::max(offset, request.offset);
  const std::uint64_t end = std::min(offset + bytes.size(), request.offset + request.out.size());
  if (begin < end)
    std::memcpy(request.out.data() + (begin - request.offset), bytes.data() + (begin - offset), end - begin);
}

/// `extents` in order, joined where at most `gap_bytes` lie between and the sum stays within `most_bytes`, and cut
/// where one alone is longer. Cuts fall on multiples of `most_bytes` from its start.
std::vector<Extent> merge(std::vector<Extent> extents, std::uint64_t gap_bytes, std::uint64_t most_bytes) {
  std::sort(extents.begin(), extents.end(), [](const Extent& a, const Extent& b) { return a.begin < b.begin; });
  std::vector<Extent> merged;
  for (Extent extent : extents) {
    if (!merged.empty()) {
      Extent& last = merged.back();
      extent.begin = std::max(extent.begin, std::min(last.end, extent.end));  // what is on its way already
      if (extent.begin == extent.end) continue;
      if (extent.begin - last.end <= gap_bytes && extent.end - last.begin <= most_bytes) {
        last.end = extent.end;
        continue;
      }
    }
    for (; extent.end - extent.begin > most_bytes; extent.begin += most_bytes)
      merged.push_back({extent.begin, extent.begin + most_bytes});
    merged.push_back(extent);
  }
  return merged;
}

class HttpFile final : public RemoteFile {
 public:
  HttpFile(std::shared_ptr<const Endpoint> endpoint, std::shared_ptr<DiskCache> cache, bool offline,
           FileVersion version, std::vector<std::byte> start)
      : endpoint_(std::move(endpoint)),
        cache_(std::move(cache)),
        offline_(offline),
        version_(std::move(version)),
        start_(std::move(start)),
        key_(DiskCache::file_key(endpoint_->target.identity, version_)) {}

  const std::string& name() const override { return endpoint_->target.name; }
  std::uint64_t size() const override { return version_.size; }
  /// What was read is kept once the file is closed.
  ~HttpFile() override {
    if (cache_) cache_->finish_writing();
  }
  Counters counters() const override {
    if (cache_) cache_->finish_writing();  // whether blocks could be kept is known then
    return endpoint_->tally.now();
  }
  Result<void> read(std::uint64_t offset, std::span<std::byte> out) const override {
    const ByteRequest request{offset, out};
    return read_many({&request, 1});
  }
  Result<void> read_many(std::span<const ByteRequest> requests) const override;

  /// Keeps what opening brought, and which version it is.
  void keep_start() const {
    cache_->remember_version(endpoint_->target.identity, version_);
    keep(0, start_);
  }

 private:
  /// Keeps the whole blocks among `bytes`, which begin at a block's start.
  void keep(std::uint64_t offset, std::span<const std::byte> bytes) const;
  /// Takes from the cache what it has for `missing`, whole blocks; what it has not remains.
  void read_cached(std::span<const ByteRequest> requests, std::vector<Extent>& missing) const;
  Result<void> ask(std::span<const ByteRequest> requests, std::span<const Extent> missing) const;

  const std::shared_ptr<const Endpoint> endpoint_;
  const std::shared_ptr<DiskCache> cache_;  // none: nothing is kept
  const bool offline_;
  const FileVersion version_;
  const std::vector<std::byte> start_;  // of the file, as opening brought it
  const DiskCache::FileKey key_;
};

Result<void> HttpFile::read_many(std::span<const ByteRequest> requests) const {
  // What opening brought needs no journey
  std::vector<Extent> missing;
  for (const ByteRequest& request : requests) {
    if (request.out.empty()) continue;
    if (request.out.size() > version_.size || request.offset > version_.size - request.out.size())
      return fail(Error::Kind::Io, fmt::format("{}: ends at byte {}, bytes {}-{} were expected", name(), version_.size,
                                               request.offset, request.offset + request.out.size() - 1));
    copy_overlap(start_, 0, request);
    const std::uint64_t begin = std::max<std::uint64_t>(request.offset, start_.size());
    const std::uint64_t end = request.offset + request.out.size();
    if (begin < end) missing.push_back({begin, end});
  }
  if (cache_) read_cached(requests, missing);
  if (missing.empty()) return {};

  // The rest, in as few requests as make sense
  const TransferOptions& options = endpoint_->options;
  std::uint64_t most_bytes = std::max<std::uint64_t>(options.max_request_bytes, 1);
  if (cache_) most_bytes = std::max(most_bytes / block_bytes, std::uint64_t{1}) * block_bytes;
  missing = merge(std::move(missing), options.merge_gap_bytes, most_bytes);
  if (!offline_) return ask(requests, missing);
  std::uint64_t bytes = 0;
  for (const Extent& extent : missing) bytes += extent.end - extent.begin;
  return fail(Error::Kind::NotFound,
              fmt::format("{}: offline, and {} are not in the cache {}: first bytes {}-{}; read them once while online",
                          name(), format_bytes(bytes), cache_ ? cache_->folder().string() : "", missing.front().begin,
                          missing.front().end - 1));
}

void HttpFile::read_cached(std::span<const ByteRequest> requests, std::vector<Extent>& missing) const {
  std::vector<std::uint64_t> indices;
  for (const Extent& extent : missing)
    for (std::uint64_t index = extent.begin / block_bytes; index * block_bytes < extent.end; ++index)
      indices.push_back(index);
  std::sort(indices.begin(), indices.end());
  indices.erase(std::unique(indices.begin(), indices.end()), indices.end());

  missing.clear();
  std::vector<std::byte> block;
  for (const std::uint64_t index : indices) {
    const std::uint64_t begin = index * block_bytes;
    block.resize(std::min(block_bytes, version_.size - begin));
    if (!cache_->load(key_, index, block)) {
      missing.push_back({begin, begin + block.size()});
      continue;
    }
    endpoint_->count(&Tally::cache_hits);
    for (const ByteRequest& request : requests) copy_overlap(block, begin, request);
  }
}

Result<void> HttpFile::ask(std::span<const ByteRequest> requests, std::span<const Extent> missing) const {
  const auto batch = std::make_shared<Batch>();
  std::vector<std::shared_ptr<Exchange>> exchanges;
  for (const Extent& extent : missing)
    exchanges.push_back(
        std::make_shared<RangeExchange>(endpoint_, batch, extent.begin, extent.end - extent.begin, version_));
  if (auto ok = submit(exchanges); !ok) return ok;
  exchanges.clear();  // each one's bytes go when they are handed out

  for (std::size_t i = 0; i < missing.size(); ++i) {
    const auto part = std::static_pointer_cast<RangeExchange>(batch->next());
    if (part->error) {
      cancel(*batch);
      return tl::unexpected(*part->error);
    }
    for (const ByteRequest& request : requests) copy_overlap(part->data(), part->offset(), request);
    if (cache_) keep(part->offset(), part->data());
  }
  return {};
}

void HttpFile::keep(std::uint64_t offset, std::span<const std::byte> bytes) const {
  while (!bytes.empty()) {
    const std::uint64_t size = std::min(block_bytes, version_.size - offset);
    if (bytes.size() < size) return;
    cache_->store(key_, offset / block_bytes, bytes.first(size),
                  [endpoint = endpoint_] { endpoint->count(&Tally::cache_failures); });
    offset += size;
    bytes = bytes.subspan(size);
  }
}

/// The file's first block, where the cache has it: a reader of headers comes back to it many times.
std::vector<std::byte> cached_start(const Endpoint& endpoint, DiskCache& cache, const FileVersion& version) {
  std::vector<std::byte> start(std::min(block_bytes, version.size));
  if (!cache.load(DiskCache::file_key(endpoint.target.identity, version), 0, start)) return {};
  endpoint.count(&Tally::cache_hits);
  return start;
}

Result<std::shared_ptr<const RemoteFile>> open_offline(std::shared_ptr<const Endpoint> endpoint,
                                                       std::shared_ptr<DiskCache> cache) {
  const Target& target = endpoint->target;
  if (!cache)
    return fail(Error::Kind::NotFound,
                fmt::format("{}: offline, and there is no cache: give it a folder and bytes", target.name));
  const auto version = cache->version(target.identity);
  if (!version)
    return fail(Error::Kind::NotFound,
                fmt::format("{}: offline, and nothing of it is in the cache {}: read it once while online", target.name,
                            cache->folder().string()));
  auto start = cached_start(*endpoint, *cache, *version);
  return std::make_shared<HttpFile>(std::move(endpoint), std::move(cache), true, *version, std::move(start));
}

}  // namespace

Result<std::shared_ptr<const RemoteFile>> open_remote(const std::string& url, const TransferOptions& options) {
  const auto target = resolve(url);
  if (!target) return fail(target);
  const auto endpoint = std::make_shared<Endpoint>();
  endpoint->target = *target;
  endpoint->options = options;
  const std::filesystem::path folder = options.cache_dir.empty() ? DiskCache::default_folder() : options.cache_dir;
  std::shared_ptr<DiskCache> cache;
  if (options.cache_bytes > 0 && !folder.empty()) cache = DiskCache::shared(folder, options.cache_bytes);
  if (is_offline(options)) return open_offline(endpoint, cache);

  // One request: the first bytes, or that they are the ones we have
  const std::optional<FileVersion> cached = cache ? cache->version(target->identity) : std::nullopt;
  std::uint64_t start_bytes = std::max<std::uint64_t>(options.ingest_bytes, 1);
  if (cache) start_bytes = (start_bytes + block_bytes - 1) / block_bytes * block_bytes;
  const auto batch = std::make_shared<Batch>();
  const std::shared_ptr<Exchange> exchange = std::make_shared<RangeExchange>(endpoint, batch, start_bytes, cached);
  if (auto ok = submit({&exchange, 1}); !ok) return fail(ok);
  const auto opened = std::static_pointer_cast<RangeExchange>(batch->next());
  if (opened->error) {
    Error error = *opened->error;
    if (cached && error.kind == Error::Kind::Io) error.message += "; NADIR_OFFLINE=1 reads what the cache has of it";
    return tl::unexpected(error);
  }

  if (!opened->version().can_be_checked()) cache.reset();  // tomorrow's bytes could not be told from today's
  auto start =
      opened->is_not_modified() ? cached_start(*endpoint, *cache, opened->version()) : std::move(opened->data());
  const auto file = std::make_shared<HttpFile>(endpoint, cache, false, opened->version(), std::move(start));
  if (cache && !opened->is_not_modified()) file->keep_start();
  return file;
}

}  // namespace nadir::transfer
