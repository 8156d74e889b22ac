#pragma once

#include "engine.h"

namespace nadir::transfer {

/// A body longer than this is no map header and no range: with a server that answers a range with the whole file, files
/// up to here are taken whole, others refused.
inline constexpr std::uint64_t most_unasked_bytes = 64 << 20;

/// A part of a file, resumed where it broke off.
class RangeExchange : public Exchange {
 public:
  /// Bytes [offset, offset + size) of the file as it was when it became `known`: size > 0, inside the file.
  RangeExchange(std::shared_ptr<const Endpoint> endpoint, std::shared_ptr<Batch> batch, std::uint64_t offset,
                std::uint64_t size, const FileVersion& known);
  /// The first `size` bytes of a file not known yet, or all if it has fewer; unless it is still `cached`, where that is
  /// given.
  RangeExchange(std::shared_ptr<const Endpoint> endpoint, std::shared_ptr<Batch> batch, std::uint64_t size,
                std::optional<FileVersion> cached);

  Outgoing next_try() override;
  Verdict head(const Head& head) override;
  Verdict bytes(std::span<const std::byte> bytes) override;
  Verdict end() override;

  // Once it is done without an error:
  std::uint64_t offset() const { return offset_; }
  /// The range, or the whole of a file that is opened on a server without ranges.
  std::vector<std::byte>& data() { return data_; }
  const FileVersion& version() const { return *known_; }
  bool is_not_modified() const { return not_modified_; }

 private:
  Verdict fail_with(Error::Kind kind, std::string message);
  Verdict changed(const FileVersion& now);
  Verdict partial(const Head& head);
  Verdict whole(const Head& head);
  /// What the server answered with is not what was asked for: once may be an accident.
  Verdict misfit(Error::Kind kind, std::string message);
  const std::string& name() const { return endpoint->target.name; }

  const std::uint64_t offset_;
  std::uint64_t size_;
  std::optional<FileVersion> known_;  // when opening: from the first answer on
  const std::optional<FileVersion> cached_;
  const bool opening_;

  std::vector<std::byte> data_;  // what arrived, from offset_ on
  bool if_match_ = true;         // until a server refuses it
  bool misfitted_ = false;
  bool not_modified_ = false;
  std::optional<std::uint64_t> whole_position_;  // in a body that is the whole file
  std::optional<Head> refused_;                  // the status, while the reason arrives
  std::string excerpt_;
};

}  // namespace nadir::transfer
