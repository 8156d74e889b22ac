#include <gtest/gtest.h>

#include <sstream>

#include "nadir/tile/cell_cache.h"
#include "support/server_process.h"
#include "support/synthetic_map.h"
#include "support/temporary_folder.h"

// Maps behind URLs, from a server that misbehaves on request (tests/servers/range_server.py).
namespace nadir::tile {
namespace {

using test::TemporaryFolder;

class RemoteMap : public testing::Test {
 protected:
  RemoteMap() {
    ::setenv("XDG_CACHE_HOME", folder.file("cache").c_str(), 1);
    test::SyntheticMap synthetic;
    synthetic.width = 900;
    synthetic.height = 700;
    synthetic.tile = 256;
    synthetic.bands = 2;
    synthetic.type = GDT_UInt16;
    synthetic.nodata = 0;
    synthetic.factors = {2, 4};
    synthetic.geotransform = {10, 0.0001, 0, 50, 0, -0.0001};
    synthetic.value = [](int level, int band, int col, int row) { return (col * 31 + row * 17 + band + level) % 5000; };
    test::write_map(synthetic, folder.file("data.bin"));
    server = std::make_unique<test::ServerProcess>(std::vector<std::string>{
        "/usr/bin/python3", NADIR_SOURCE_DIR "/tests/servers/range_server.py", folder.path().string()});
    port = server->read_line();
  }
  ~RemoteMap() override { ::unsetenv("XDG_CACHE_HOME"); }

  std::string url(const std::string& how) const { return "http://127.0.0.1:" + port + "/" + how + "/m.tif"; }
  std::size_t requests() const {
    std::istringstream log(test::bytes_of(folder.path() / "log"));
    std::size_t lines = 0;
    for (std::string line; std::getline(log, line);) ++lines;
    return lines;
  }
  static std::vector<CellRequest> all_cells(const CellSource& source, int level) {
    std::vector<CellRequest> cells;
    const Level& size = source.map().levels()[static_cast<std::size_t>(level)];
    for (int row = 0; row * cell_size < size.height; ++row)
      for (int col = 0; col * cell_size < size.width; ++col) cells.push_back({&source, level, col, row});
    return cells;
  }

  TemporaryFolder folder;
  std::unique_ptr<test::ServerProcess> server;
  std::string port;
};

TEST_F(RemoteMap, HoldsTheTexelsOfTheFileOnDiskForFewRequests) {
  const auto local = CellSource::make(Map::open(folder.file("data.bin")).value(), {}, Domain::Linear).value();
  const auto map = Map::open(url("delay=20"));
  ASSERT_TRUE(map) << map.error().message;
  const std::size_t to_open = requests();
  EXPECT_LE(to_open, 2u) << "headers lie in the first bytes, tables of tiles in a few more";
  const auto remote = CellSource::make(*map, {}, Domain::Linear).value();
  EXPECT_TRUE(remote->is_remote());
  CellCache cache(64 << 20);
  for (int level = 0; level < 3; ++level) {
    const auto wanted = all_cells(*local, level);
    const auto near = cache.pin(wanted).value(), far = cache.pin(all_cells(*remote, level)).value();
    ASSERT_EQ(near.size(), far.size());
    const Level& size = map->levels()[static_cast<std::size_t>(level)];
    for (std::size_t i = 0; i < near.size(); ++i) {
      ASSERT_EQ(near[i]->masked(), far[i]->masked());
      const int cols = std::min(cell_size, size.width - wanted[i].col * cell_size),
                rows = std::min(cell_size, size.height - wanted[i].row * cell_size);
      for (int y = 0; y < rows; ++y)
        ASSERT_TRUE(std::equal(near[i]->data<std::uint16_t>() + y * cell_size * 2,
                               near[i]->data<std::uint16_t>() + (y * cell_size + cols) * 2,
                               far[i]->data<std::uint16_t>() + y * cell_size * 2))
            << "level " << level << " cell " << i << " row " << y;
    }
  }
  // 12 + 4 + 1 tiles of 256 KiB lie one behind the other
  EXPECT_LE(requests() - to_open, 6u);
}

TEST_F(RemoteMap, ThatChangesUnderneathIsAnErrorAndNoMixture) {
  const auto map = Map::open(url("skip=1,change")).value();
  const std::array bands = {1};
  const auto texels = map.read(0, {600, 600, 10, 10}, bands);
  ASSERT_FALSE(texels);
  EXPECT_EQ(texels.error().kind, Error::Kind::Io);
  EXPECT_NE(texels.error().message.find("changed while it was read"), std::string::npos) << texels.error().message;
  EXPECT_NE(texels.error().message.find("127.0.0.1"), std::string::npos) << texels.error().message;
}

TEST_F(RemoteMap, ThatIsNotThereSaysSo) {
  const auto map = Map::open(url("status=404"));
  ASSERT_FALSE(map);
  EXPECT_EQ(map.error().kind, Error::Kind::NotFound) << map.error().message;
  EXPECT_NE(map.error().message.find("404"), std::string::npos) << map.error().message;
}

TEST_F(RemoteMap, BurstsAndResetsCostTimeAndNoTexel) {
  const auto right = Map::open(folder.file("data.bin")).value();
  const std::array bands = {1, 2};
  const auto expected = right.read(0, {0, 0, right.width(), right.height()}, bands).value();
  for (const char* how : {"skip=1,status=503x2", "skip=1,reset=50000x2", "skip=1,shift=3x1"}) {
    const auto map = Map::open(url(how));
    ASSERT_TRUE(map) << how << ": " << map.error().message;
    const auto texels = map->read(0, {0, 0, map->width(), map->height()}, bands);
    ASSERT_TRUE(texels) << how << ": " << texels.error().message;
    EXPECT_EQ(texels->samples, expected.samples) << how;
    EXPECT_EQ(texels->validity, expected.validity) << how;
  }
}

TEST_F(RemoteMap, OfflineItIsReadFromTheCacheOnly) {
  const std::array bands = {1};
  const auto online = Map::open(url("good")).value().read(0, {0, 0, 300, 300}, bands).value();
  server.reset();
  ::setenv("NADIR_OFFLINE", "1", 1);
  const auto map = Map::open(url("good"));
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_EQ(map->read(0, {0, 0, 300, 300}, bands).value().samples, online.samples);
  EXPECT_FALSE(map->read(0, {700, 600, 100, 100}, bands)) << "these were never fetched";
  ::unsetenv("NADIR_OFFLINE");
}

}  // namespace
}  // namespace nadir::tile
