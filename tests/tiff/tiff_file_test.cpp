#include "nadir/tiff/tiff_file.h"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <limits>

#include "nadir/tiff/decode.h"
#include "support/temporary_folder.h"

namespace nadir::tiff {
namespace {

using test::TemporaryFolder;

/// A little-endian TIFF put together field by field: a level of 64 x 48 bytes in tiles of 32 x 16, and what a test
/// changes of it.
class Bytes {
 public:
  explicit Bytes(bool big = false) : big_(big) {
    text("II");
    number(big ? 43 : 42, 2);
    if (big) number(8, 2), number(0, 2);
    number(big ? 16 : 8, big ? 8 : 4);
  }
  void text(std::string_view t) { bytes_ += t; }
  void number(std::uint64_t value, int size) {
    for (int i = 0; i < size; ++i) bytes_ += static_cast<char>(value >> (8 * i));
  }
  struct Entry {
    std::uint16_t tag, type;
    std::uint64_t count, value;  // the value itself, or where it lies
  };
  void directory(const std::vector<Entry>& entries, std::uint64_t next) {
    number(entries.size(), big_ ? 8 : 2);
    for (const Entry& e : entries) {
      number(e.tag, 2);
      number(e.type, 2);
      number(e.count, big_ ? 8 : 4);
      number(e.value, big_ ? 8 : 4);
    }
    number(next, big_ ? 8 : 4);
  }
  std::size_t size() const { return bytes_.size(); }
  Result<std::shared_ptr<const TiffFile>> open(const TemporaryFolder& folder) const {
    std::ofstream(folder.file("m.tif"), std::ios::binary) << bytes_;
    return TiffFile::open(LocalFile::open(folder.file("m.tif")).value());
  }

 private:
  bool big_;
  std::string bytes_;
};

std::vector<Bytes::Entry> plain_image() {
  // Tables of 6 tiles at byte 200 and 224, tiles from byte 248 on
  return {{256, 3, 1, 64}, {257, 3, 1, 48}, {258, 3, 1, 8},  {259, 3, 1, 1},   {262, 3, 1, 1},
          {277, 3, 1, 1},  {322, 3, 1, 32}, {323, 3, 1, 16}, {324, 4, 6, 200}, {325, 4, 6, 224}};
}

Bytes plain_file(const std::vector<Bytes::Entry>& entries, std::uint64_t next = 0,
                 std::vector<std::uint64_t> offsets = {248, 760, 1272, 1784, 2296, 2808},
                 std::vector<std::uint64_t> sizes = {512, 512, 512, 512, 512, 512}) {
  Bytes file;
  file.directory(entries, next);
  while (file.size() < 200) file.text("\0"), file.number(0, 1);
  for (const auto o : offsets) file.number(o, 4);
  for (const auto s : sizes) file.number(s, 4);
  for (int tile = 0; tile < 6; ++tile) file.text(std::string(512, static_cast<char>('a' + tile)));
  return file;
}

std::vector<Bytes::Entry> with(std::vector<Bytes::Entry> entries, Bytes::Entry changed) {
  for (auto& e : entries)
    if (e.tag == changed.tag) return e = changed, entries;
  entries.push_back(changed);
  return entries;
}

/// The same in strips of 20 rows, the last of 8.
std::vector<Bytes::Entry> striped_image() {
  return {{256, 3, 1, 64},  {257, 3, 1, 48}, {258, 3, 1, 8},  {259, 3, 1, 1},  {262, 3, 1, 1},
          {273, 4, 3, 200}, {277, 3, 1, 1},  {278, 3, 1, 20}, {279, 4, 3, 224}};
}

TEST(TiffFile, StripsAreTilesAsWideAsTheImage) {
  const TemporaryFolder folder;
  const auto file = plain_file(striped_image()).open(folder);
  ASSERT_TRUE(file) << file.error().message;
  const Directory& directory = (*file)->directories().front();
  EXPECT_TRUE(directory.strips);
  EXPECT_EQ(directory.format.tile_width, 64u);
  EXPECT_EQ(directory.format.tile_height, 20u);
  EXPECT_EQ(directory.tiles_across(), 1u);
  EXPECT_EQ(directory.tiles_down(), 3u);
  const TileAddress last{0, 0, 0, 2};
  EXPECT_EQ((*file)->locate({&last, 1}).front()->offset, 1272u);
  EXPECT_FALSE(plain_file(plain_image()).open(folder).value()->directories().front().strips);
}

TEST(TiffFile, AStripWithoutANumberOfRowsIsTheWholeImage) {
  const TemporaryFolder folder;
  auto entries = striped_image();
  std::erase_if(entries, [](const Bytes::Entry& e) { return e.tag == 278; });
  const auto file = plain_file(entries).open(folder);
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ((*file)->directories().front().format.tile_height, 48u);
}

TEST(TiffFile, FindsItsTiles) {
  const TemporaryFolder folder;
  const auto file = plain_file(plain_image()).open(folder);
  ASSERT_TRUE(file) << file.error().message;
  const TileAddress tile{0, 0, 1, 2};
  const TilePlace place = (*file)->locate({&tile, 1}).front().value();
  std::array<std::byte, 512> bytes;
  ASSERT_EQ(place.size, bytes.size());
  ASSERT_TRUE((*file)->source().read(place.offset, bytes));
  EXPECT_EQ(static_cast<char>(bytes[100]), 'f');
}

struct Hostile {
  const char* name;
  std::vector<Bytes::Entry> entries;
  std::uint64_t next;
  const char* because;
};
std::ostream& operator<<(std::ostream& out, const Hostile& h) { return out << h.name; }
class HostileHeaders : public testing::TestWithParam<Hostile> {};

TEST_P(HostileHeaders, AreRefusedWithTheirCause) {
  const TemporaryFolder folder;
  const auto file = plain_file(GetParam().entries, GetParam().next).open(folder);
  ASSERT_FALSE(file);
  EXPECT_NE(file.error().message.find(GetParam().because), std::string::npos) << file.error().message;
  EXPECT_TRUE(file.error().message.starts_with(folder.file("m.tif"))) << file.error().message;
}

constexpr std::uint64_t most = std::numeric_limits<std::uint32_t>::max();
INSTANTIATE_TEST_SUITE_P(
    Tiff, HostileHeaders,
    testing::Values(
        Hostile{"directories_in_a_circle", plain_image(), 8, "circle"},
        Hostile{"a_directory_beyond_the_file", plain_image(), 1 << 20, "the file has"},
        Hostile{"no_texels", with(plain_image(), {256, 3, 1, 0}), 0, "0 x 48"},
        Hostile{"more_texels_than_can_be", with(plain_image(), {256, 4, 1, most}), 0, "4294967295"},
        Hostile{"tiles_without_size", with(plain_image(), {322, 3, 1, 0}), 0, "not tiled"},
        Hostile{"strips_without_rows", with(striped_image(), {278, 3, 1, 0}), 0, "not tiled"},
        Hostile{"strips_of_endless_rows", with(with(striped_image(), {256, 4, 1, 0x7fffffff}), {257, 4, 1, 0x7fffffff}),
                0, "large"},
        Hostile{"fewer_table_entries_than_strips", with(striped_image(), {278, 3, 1, 10}), 0, "5 tiles, and 3"},
        Hostile{"giant_tiles", with(with(plain_image(), {322, 4, 1, 65536}), {323, 4, 1, 65536}), 0, "large"},
        Hostile{"fewer_table_entries_than_tiles", with(plain_image(), {324, 4, 5, 200}), 0, "6 tiles, and 5"},
        Hostile{"a_table_beyond_the_file", with(plain_image(), {324, 4, 6, 1 << 24}), 0, "beyond the file"},
        Hostile{"more_tiles_than_the_table", with(plain_image(), {256, 4, 1, 0x7fffffff}), 0, "tiles, and 6"},
        Hostile{"no_samples", with(plain_image(), {277, 3, 1, 0}), 0, "0 samples"},
        Hostile{"samples_of_no_bits", with(plain_image(), {258, 3, 1, 0}), 0, "0 bits"},
        Hostile{"a_number_that_is_text", with(plain_image(), {256, 2, 1, 64}), 0, "tag 256"},
        Hostile{"a_field_of_many_values", with(plain_image(), {258, 4, most, 200}), 0, "4294967295 numbers"},
        Hostile{"an_unknown_codec", with(plain_image(), {259, 3, 1, 34712}), 0, "compression 34712"}),
    [](const auto& hostile) { return std::string(hostile.param.name); });

TEST(HostileTables, ATileBeyondTheFileIsDamagedAndTheOthersAreThere) {
  const TemporaryFolder folder;
  const auto file =
      plain_file(plain_image(), 0, {248, most, 1272, 248, 2296, 0}, {512, 512, most, 512, 0, 512}).open(folder);
  ASSERT_TRUE(file) << file.error().message;
  std::vector<TileAddress> tiles;
  for (std::uint32_t i = 0; i < 6; ++i) tiles.push_back({0, 0, i % 2, i / 2});
  const auto places = (*file)->locate(tiles);
  EXPECT_EQ(places[0].value().offset, 248u);
  EXPECT_EQ(places[1].error().kind, Error::Kind::Damaged);
  EXPECT_EQ(places[2].error().kind, Error::Kind::Damaged);
  EXPECT_EQ(places[3].value().offset, 248u) << "tiles may share their bytes";
  EXPECT_EQ(places[4].value().size, 0u) << "never written";
  EXPECT_EQ(places[5].value().size, 0u) << "never written";
}

TEST(HostileTables, BytesThatNoPackingNeedsAreNotRead) {
  const TemporaryFolder folder;
  auto entries = plain_image();
  const std::uint64_t honest = largest_packed_bytes(TileFormat{.tile_width = 32, .tile_height = 16});
  auto bytes = plain_file(entries, 0, {248, 248, 248, 248, 248, 248}, {honest, honest + 1, 1, 1, 1, 1});
  bytes.text(std::string(static_cast<std::size_t>(honest), 'x'));
  const auto file = bytes.open(folder);
  ASSERT_TRUE(file);
  const std::vector<TileAddress> tiles = {{0, 0, 0, 0}, {0, 0, 1, 0}};
  const auto places = (*file)->locate(tiles);
  EXPECT_TRUE(places[0]);
  EXPECT_FALSE(places[1]);
}

TEST(TiffFile, ReadsOnlyHeadersAndThePagesOfItsTableThatAreAskedFor) {
  /// Zeros without end behind a header: what is read is counted.
  class Counted : public ByteSource {
   public:
    Counted(std::string head, std::uint64_t size) : head_(std::move(head)), size_(size) {}
    const std::string& name() const override { return name_; }
    std::uint64_t size() const override { return size_; }
    Result<void> read(std::uint64_t offset, std::span<std::byte> out) const override {
      std::fill(out.begin(), out.end(), std::byte{0});
      if (offset < head_.size())
        std::memcpy(out.data(), head_.data() + offset, std::min<std::size_t>(out.size(), head_.size() - offset));
      read_ += out.size();
      return {};
    }
    mutable std::uint64_t read_ = 0;

   private:
    const std::string head_, name_ = "counted";
    const std::uint64_t size_;
  };
  // 2^30 texels a side in tiles of 512: 2^42 tiles, whose tables take 2^46 bytes
  const std::uint64_t tiles = std::uint64_t{1} << 42;
  const TemporaryFolder folder;
  Bytes big(true);
  big.directory({{256, 4, 1, 1 << 30},
                 {257, 4, 1, 1 << 30},
                 {258, 3, 1, 8},
                 {259, 3, 1, 1},
                 {262, 3, 1, 1},
                 {277, 3, 1, 1},
                 {322, 3, 1, 512},
                 {323, 3, 1, 512},
                 {324, 16, tiles, 4096},
                 {325, 16, tiles, 4096 + 8 * tiles}},
                0);
  ASSERT_FALSE(big.open(folder)) << "a real file would have to be as long as its tables";
  const auto source = std::make_shared<Counted>(test::bytes_of(folder.file("m.tif")), std::uint64_t{1} << 62);
  const auto file = TiffFile::open(source);
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_LE(source->read_, 16u << 10);
  const TileAddress last{0, 0, (1 << 21) - 1, (1 << 21) - 1};
  EXPECT_TRUE((*file)->locate({&last, 1}).front());
  EXPECT_LE(source->read_, 48u << 10) << "one page of each table";
}

}  // namespace
}  // namespace nadir::tiff
