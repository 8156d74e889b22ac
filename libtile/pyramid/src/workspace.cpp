#include "workspace.h"

#include <fmt/format.h>

namespace nadir::pyramid {
namespace fs = std::filesystem;

Result<std::unique_ptr<Workspace>> Workspace::open(const fs::path& folder, const BuildIdentity& identity) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    return fail(Error::Kind::Io,
                fmt::format("{}: cannot be made for the build's own files: {}", folder.string(), error.message()));
  std::unique_ptr<Workspace> space(new Workspace(folder));
  auto lock = DiskFile::open(folder / "lock");
  if (!lock) return fail(lock);
  if (!lock->lock())
    return fail(Error::Kind::Exists,
                fmt::format("{}: another process is building this map; wait for it, or stop it", folder.string()));
  space->lock_ = std::move(*lock);

  auto file = DiskFile::open(folder / "journal");
  if (!file) return fail(file);
  auto journal = Journal::open(std::move(*file), identity);
  if (!journal) return fail(journal);
  const bool is_new = journal->is_new();
  space->journal_.emplace(std::move(*journal));
  space->identity_ = identity;
  // Files of an earlier attempt that is of no use
  if (is_new)
    for (const auto& entry : fs::directory_iterator(folder, error))
      if (entry.path().filename() != "journal" && entry.path().filename() != "lock") fs::remove(entry.path(), error);
  if (const auto ok = space->open_spool(); !ok) return fail(ok);
  return space;
}

Result<std::unique_ptr<Workspace>> Workspace::open_shard(const fs::path& folder) {
  std::error_code error;
  if (!fs::exists(folder / "journal", error))
    return fail(Error::Kind::NotFound,
                fmt::format("{}: expected the folder of a shard; build it first, with --shard", folder.string()));
  std::unique_ptr<Workspace> space(new Workspace(folder));
  auto lock = DiskFile::open(folder / "lock");
  if (!lock) return fail(lock);
  if (!lock->lock())
    return fail(Error::Kind::Exists, fmt::format("{}: this shard is still being built; wait for it", folder.string()));
  space->lock_ = std::move(*lock);
  auto file = DiskFile::open(folder / "journal");
  if (!file) return fail(file);
  const auto identity = Journal::identity(*file);
  if (!identity) return fail(identity);
  auto journal = Journal::open(std::move(*file), *identity);
  if (!journal) return fail(journal);
  space->journal_.emplace(std::move(*journal));
  space->identity_ = *identity;
  if (const auto ok = space->open_spool(); !ok) return fail(ok);
  return space;
}

Result<void> Workspace::open_spool() {
  auto spool = DiskFile::open(file("tiles"));
  if (!spool) return fail(spool);
  const auto size = spool->size();
  if (!size) return fail(size);
  spool_ = std::move(*spool);
  end_ = *size;
  return {};
}

Workspace::~Workspace() {
  std::error_code ignored;
  if (!keep_) fs::remove_all(folder_, ignored);
}

Result<std::uint64_t> Workspace::spool(std::span<const std::byte> bytes) {
  const std::uint64_t offset = end_.fetch_add(bytes.size());
  if (const auto ok = spool_.write(offset, bytes); !ok) return fail(ok);
  return offset;
}

}  // namespace nadir::pyramid
