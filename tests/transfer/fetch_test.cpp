#include "nadir/transfer/fetch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "curl_library.h"
#include "transfer/stand_in.h"

namespace nadir::transfer {
namespace {

using test::quick_options;
using test::StandIn;
using test::Variable;
using testing::HasSubstr;

class FetchTest : public testing::Test {
 protected:
  const Variable no_proxy{"no_proxy", "*"}, online{"NADIR_OFFLINE", nullptr};
  StandIn server;
};

TEST_F(FetchTest, SendsABodyAndGivesTheAnswer) {
  const auto response = fetch(
      {.url = server.url("service"), .method = "POST", .headers = {"X-Own: 1"}, .body = "question"}, quick_options());
  ASSERT_TRUE(response) << response.error().message;
  EXPECT_EQ(response->status, 200);
  EXPECT_EQ(response->headers.at("content-type"), "application/json");
  EXPECT_EQ(response->body, R"({"method": "POST", "got": "question"})");
}

TEST_F(FetchTest, ARefusalIsAnAnswerWithItsReason) {
  const auto response = fetch({.url = server.url("status=400")}, quick_options());
  ASSERT_TRUE(response) << response.error().message;
  EXPECT_EQ(response->status, 400);
  EXPECT_EQ(response->body, R"({"error": "as asked"})");
  EXPECT_EQ(server.asked("status=400").size(), 1u);
}

TEST_F(FetchTest, AsksAgainWhereThatMayHelp) {
  const auto response = fetch({.url = server.url("status=429x3")}, quick_options());
  ASSERT_TRUE(response) << response.error().message;
  EXPECT_EQ(response->status, 200);
  EXPECT_EQ(response->body, server.bytes());
  EXPECT_THAT(fetch({.url = server.url("status=500")}, quick_options()).error().message, HasSubstr("as asked"));
}

TEST_F(FetchTest, AnswersBeyondTheLimitAreNotTakenIn) {
  const auto response = fetch({.url = server.url("huge"), .limit_bytes = 1 << 20}, quick_options());
  ASSERT_FALSE(response);
  EXPECT_EQ(response.error().kind, Error::Kind::OverBudget);
  EXPECT_TRUE(fetch({.url = server.url("plain"), .limit_bytes = 1'000'000}, quick_options()));
  EXPECT_FALSE(fetch({.url = server.url("plain"), .limit_bytes = 999'999}, quick_options()));
}

TEST_F(FetchTest, OfflineAsksNobody) {
  const Variable offline("NADIR_OFFLINE", "1");
  EXPECT_THAT(fetch({.url = server.url("plain")}, quick_options()).error().message, HasSubstr("offline"));
  EXPECT_TRUE(server.asked("/plain/").empty());
}

TEST(CurlLibrary, AMissingLibraryNamesThePackage) {
  const auto curl = load_curl("libcurl-that-is-not-there.so.4");
  ASSERT_FALSE(curl);
  EXPECT_THAT(curl.error().message,
              testing::AllOf(HasSubstr("libcurl-that-is-not-there.so.4"), HasSubstr("install the package libcurl4")));
  EXPECT_THAT(load_curl("libm.so.6").error().message, HasSubstr("libm.so.6 has no curl_"));
}

}  // namespace
}  // namespace nadir::transfer
