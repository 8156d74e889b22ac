// Of a build with NADIR_TRANSFER=OFF.
#include <gtest/gtest.h>

#include "nadir/transfer/fetch.h"
#include "nadir/transfer/remote_file.h"

namespace nadir::transfer {
namespace {

TEST(WithoutCurl, UrlsAreRecognisedAndRefusedWithAdvice) {
  EXPECT_TRUE(is_url("https://host/map.tif"));
  const auto file = open_remote("https://host/map.tif?sig=hush");
  ASSERT_FALSE(file);
  EXPECT_EQ(file.error().kind, Error::Kind::Unsupported);
  EXPECT_NE(file.error().message.find("https://host/map.tif: this build reads no URLs"), std::string::npos);
  EXPECT_NE(file.error().message.find("NADIR_TRANSFER=ON"), std::string::npos);
  EXPECT_EQ(file.error().message.find("hush"), std::string::npos);
  EXPECT_EQ(fetch({.url = "https://host/"}).error().kind, Error::Kind::Unsupported);
  EXPECT_EQ(open_remote("map.tif").error().kind, Error::Kind::Malformed);
}

}  // namespace
}  // namespace nadir::transfer
