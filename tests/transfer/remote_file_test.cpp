#include "nadir/transfer/remote_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "transfer/stand_in.h"

namespace nadir::transfer {
namespace {

using test::field;
using test::quick_options;
using test::read;
using test::read_many;
using test::StandIn;
using test::Variable;
using testing::HasSubstr;
using testing::Not;

constexpr std::uint64_t ki = 1 << 10;

/// One server for all tests, each with a path of its own.
class RemoteFileTest : public testing::Test {
 protected:
  static void SetUpTestSuite() { server_ = new StandIn; }
  static void TearDownTestSuite() {
    delete server_;
    server_ = nullptr;
  }
  static const StandIn& server() { return *server_; }
  static std::string bytes(std::uint64_t offset, std::size_t size) { return server_->bytes().substr(offset, size); }
  static std::string error_of(const std::string& url, const TransferOptions& options = quick_options()) {
    const auto file = open_remote(url, options);
    return file ? "opened" : file.error().message;
  }

 private:
  static StandIn* server_;
  const Variable no_proxy_{"no_proxy", "*"}, online_{"NADIR_OFFLINE", nullptr};
};
StandIn* RemoteFileTest::server_ = nullptr;

TEST_F(RemoteFileTest, OpensWithOneRequestAndReadsTheStartFromIt) {
  const auto file = open_remote(server().url("plain"), quick_options()).value();
  EXPECT_EQ(file->size(), server().bytes().size());
  EXPECT_TRUE(file->is_remote());
  EXPECT_EQ(read(*file, 0, 32 * ki), bytes(0, 32 * ki));
  EXPECT_EQ(read(*file, 31 * ki, 100), bytes(31 * ki, 100));
  ASSERT_EQ(server().asked("/plain/").size(), 1u);
  EXPECT_EQ(field(server().asked("/plain/")[0], "range"), "bytes=0-32767");
  EXPECT_THAT(field(server().asked("/plain/")[0], "agent"), testing::StartsWith("nadir/"));
  EXPECT_EQ(file->counters().requests, 1u);
  EXPECT_EQ(file->counters().bytes, 32 * ki);
}

TEST_F(RemoteFileTest, ReadsAnyRangeToTheLastByteAndNoFurther) {
  const auto file = open_remote(server().url("any"), quick_options()).value();
  EXPECT_EQ(read(*file, 500'000, 1), bytes(500'000, 1));
  EXPECT_EQ(read(*file, 32 * ki - 1, 2), bytes(32 * ki - 1, 2)) << "half of it came with opening";
  EXPECT_EQ(read(*file, 999'999, 1), bytes(999'999, 1));
  EXPECT_EQ(read(*file, 0, 1'000'000), server().bytes());
  EXPECT_EQ(read(*file, 1'000'000, 0), "");
  EXPECT_THAT(read(*file, 999'999, 2), HasSubstr("ends at byte 1000000"));
  EXPECT_THAT(read(*file, ~std::uint64_t{0}, 2), HasSubstr("ends at byte 1000000")) << "without overflow";
}

TEST_F(RemoteFileTest, JoinsRangesThatLieNearAndCutsLongOnes) {
  TransferOptions options = quick_options();
  options.merge_gap_bytes = 1000;
  options.max_request_bytes = 100'000;
  const auto file = open_remote(server().url("joined"), options).value();
  // 100 bytes apart, joined; 1001 apart, not; out of order and overlapping
  const auto reads = read_many(*file, {{202'101, 50}, {200'000, 500}, {200'600, 500}, {200'400, 300}});
  ASSERT_TRUE(reads.ok);
  EXPECT_EQ(reads.texts[0], bytes(202'101, 50));
  EXPECT_EQ(reads.texts[1], bytes(200'000, 500));
  EXPECT_EQ(reads.texts[2], bytes(200'600, 500));
  EXPECT_EQ(reads.texts[3], bytes(200'400, 300));
  std::vector<std::string> ranges;
  for (const std::string& line : server().asked("/joined/")) ranges.push_back(field(line, "range"));
  EXPECT_THAT(ranges, testing::UnorderedElementsAre("bytes=0-32767", "bytes=200000-201099", "bytes=202101-202150"));

  EXPECT_EQ(read(*file, 300'000, 250'000), bytes(300'000, 250'000));
  ranges.clear();
  for (const std::string& line : server().asked("/joined/")) ranges.push_back(field(line, "range"));
  EXPECT_THAT(ranges, testing::IsSupersetOf({"bytes=300000-399999", "bytes=400000-499999", "bytes=500000-549999"}));
  EXPECT_EQ(ranges.size(), 6u);

  // Neighbours that together would be too long
  ASSERT_TRUE(read_many(*file, {{600'000, 60'000}, {660'000, 60'000}}).ok);
  EXPECT_EQ(server().asked("/joined/").size(), 8u);
}

TEST_F(RemoteFileTest, AsksForSeveralRangesAtATimeAndKeepsConnections) {
  TransferOptions options = quick_options();
  options.merge_gap_bytes = 0;
  options.connections = 4;
  const auto file = open_remote(server().url("delay=60"), options).value();
  std::vector<std::pair<std::uint64_t, std::size_t>> ranges;
  for (std::uint64_t i = 0; i < 12; ++i) ranges.push_back({100'000 + 50'000 * i, 1000});
  const auto reads = read_many(*file, ranges);
  ASSERT_TRUE(reads.ok) << reads.ok.error().message;
  for (std::size_t i = 0; i < ranges.size(); ++i) EXPECT_EQ(reads.texts[i], bytes(ranges[i].first, 1000)) << i;

  int most = 0;
  std::map<std::string, int> peers;
  for (const std::string& line : server().asked("/delay=60/")) {
    most = std::max(most, std::stoi(field(line, "in-flight")));
    ++peers[field(line, "peer")];
  }
  EXPECT_EQ(most, 4);
  EXPECT_LE(peers.size(), 4u) << "a connection serves many requests";
}

TEST_F(RemoteFileTest, EightThreadsGetTheirOwnBytes) {
  const auto file = open_remote(server().url("threads"), quick_options()).value();
  std::vector<std::thread> threads;
  std::atomic<int> wrong{0};
  for (unsigned t = 0; t < 8; ++t)
    threads.emplace_back([&, t] {
      std::mt19937 random(t);
      for (int i = 0; i < 20; ++i) {
        const std::uint64_t offset = random() % 900'000;
        const std::size_t size = 1 + random() % 90'000;
        const auto reads = read_many(*file, {{offset, size}, {999'999 - offset, 1}});
        if (!reads.ok || reads.texts[0] != bytes(offset, size) || reads.texts[1] != bytes(999'999 - offset, 1)) ++wrong;
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_EQ(file->counters().retries, 0u);
}

TEST_F(RemoteFileTest, OutlastsABurstOfRefusals) {
  for (const char* status : {"408", "429", "500", "502", "503", "504"}) {
    const std::string how = std::string("skip=1,status=") + status + "x4";
    const auto file = open_remote(server().url(how), quick_options()).value();
    EXPECT_EQ(read(*file, 500'000, 1000), bytes(500'000, 1000)) << status;
    EXPECT_EQ(file->counters().retries, 4u) << status;
  }
  EXPECT_THAT(error_of(server().url("status=503")), testing::AllOf(HasSubstr("HTTP 503"), HasSubstr("after 5 tries")));
  EXPECT_EQ(server().asked("/status=503/").size(), 5u);
}

TEST_F(RemoteFileTest, WaitsAsLongAsTheServerAsks) {
  // A Retry-After of one second; a date counts in whole seconds of the server's clock, so that it may be short by one.
  const auto seconds = [&](const std::string& how) {
    const auto start = std::chrono::steady_clock::now();
    EXPECT_TRUE(open_remote(server().url(how), quick_options())) << how;
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  EXPECT_GE(seconds("status=429x1,retry=1"), 1.0);
  EXPECT_GE(seconds("status=503x1,retrydate=2"), 1.0);
  EXPECT_THAT(error_of(server().url("status=503,retry=3600")), HasSubstr("come back in 3600 s"));
  EXPECT_EQ(server().asked("retry=3600").size(), 1u);
}

TEST_F(RemoteFileTest, OneRefusalSlowsAllRequestsToItsHost) {
  const StandIn own;  // its refusal is no business of other tests
  const auto other = open_remote(own.url("other"), quick_options()).value();
  std::thread refused([&] { EXPECT_TRUE(open_remote(own.url("status=503x1,retry=1"), quick_options())); });
  while (own.asked("status=503").empty()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));  // the answer to what it has logged arrives
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(read(*other, 500'000, 10), own.bytes().substr(500'000, 10));
  const std::chrono::duration<double> waited = std::chrono::steady_clock::now() - start;
  refused.join();
  EXPECT_GE(waited.count(), 0.5) << "of the second that the server asked for, half is left at the very least";
}

TEST_F(RemoteFileTest, ResumesWhereAConnectionBroke) {
  const auto file = open_remote(server().url("skip=1,reset=40000x2"), quick_options()).value();
  EXPECT_EQ(read(*file, 100'000, 200'000), bytes(100'000, 200'000));
  const auto asked = server().asked("reset=40000x2");
  ASSERT_EQ(asked.size(), 4u);
  EXPECT_EQ(field(asked[1], "range"), "bytes=100000-299999");
  // What arrived before the reset is up to the kernel; that some did is what makes this a test.
  const auto start = [&](std::size_t i) { return std::stoi(field(asked[i], "range").substr(6)); };
  EXPECT_GT(start(2), 100'000);
  EXPECT_GT(start(3), start(2));
  EXPECT_LE(start(3), 180'000);
  EXPECT_EQ(field(asked[3], "if-match"), "\"v1\"") << "or the rest might be of another version";
  EXPECT_LT(file->counters().bytes, 32 * ki + 200'001);
}

TEST_F(RemoteFileTest, GivesUpOnAServerThatAlwaysBreaksOff) {
  const auto file = open_remote(server().url("skip=1,reset=0"), quick_options()).value();
  EXPECT_THAT(read(*file, 100'000, 1000), HasSubstr("after 5 tries"));
  EXPECT_THAT(error_of("http://127.0.0.1:" + std::to_string(test::free_port()) + "/data.bin"),
              testing::AllOf(HasSubstr("after 5 tries"), HasSubstr("check the network")));
}

TEST_F(RemoteFileTest, ABodyThatEndsEarlyIsContinued) {
  const auto file = open_remote(server().url("skip=1,shortx2"), quick_options()).value();
  EXPECT_EQ(read(*file, 100'000, 1000), bytes(100'000, 1000));
  const auto asked = server().asked("shortx2");
  ASSERT_EQ(asked.size(), 4u);
  EXPECT_EQ(field(asked[2], "range"), "bytes=100500-100999");
  EXPECT_EQ(field(asked[3], "range"), "bytes=100750-100999");
}

TEST_F(RemoteFileTest, ARangeThatWasNotAskedForIsAskedOnceMoreThenRefused) {
  const auto once = open_remote(server().url("skip=1,shift=10x1"), quick_options()).value();
  EXPECT_EQ(read(*once, 100'000, 1000), bytes(100'000, 1000));
  const auto always = open_remote(server().url("skip=1,shift=10"), quick_options()).value();
  EXPECT_THAT(read(*always, 100'000, 1000),
              HasSubstr("asked for bytes 100000-100999, and the server sent bytes 100010-101009"));
  EXPECT_EQ(always->counters().requests, 3u);
}

TEST_F(RemoteFileTest, ASmallFileOnAServerWithoutRangesIsTakenWhole) {
  for (const char* how : {"noranges", "noranges,chunked"}) {
    const auto file = open_remote(server().url(how), quick_options()).value();
    EXPECT_EQ(file->size(), 1'000'000u) << how;
    EXPECT_EQ(read(*file, 0, 1'000'000), server().bytes()) << how;
    EXPECT_EQ(file->counters().requests, 1u) << how;
  }
  for (const char* how : {"skip=1,noranges", "skip=1,noranges,chunked"}) {
    const auto file = open_remote(server().url(how), quick_options()).value();
    EXPECT_EQ(read(*file, 345'678, 1000), bytes(345'678, 1000)) << how;
  }
}

TEST_F(RemoteFileTest, ALargeFileOnAServerWithoutRangesIsNotDownloaded) {
  EXPECT_THAT(error_of(server().url("huge")), HasSubstr("ignores ranges"));
  const auto file = open_remote(server().url("skip=1,huge"), quick_options()).value();
  EXPECT_THAT(read(*file, 500'000, 10), HasSubstr("ignores ranges"));
  std::vector<std::string> sent;
  for (int i = 0; i < 200 && sent.size() < 2; ++i) {  // the server notices when its buffers are full
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    sent = server().asked("huge-sent");
  }
  ASSERT_EQ(sent.size(), 2u);
  // Buffers of sockets hold some MiB.
  for (const std::string& line : sent) EXPECT_LT(std::stoll(field(line, "huge-sent")), 64 << 20);
}

TEST_F(RemoteFileTest, ASlowDripIsCutAndAskedAnew) {
  TransferOptions options = quick_options();
  options.low_speed_s = 1;
  const auto file = open_remote(server().url("skip=1,dripx1"), options).value();
  EXPECT_EQ(read(*file, 100'000, 1000), bytes(100'000, 1000)) << "ten bytes a second would take 100 s";
  EXPECT_EQ(file->counters().retries, 1u);
  options.tries = 1;
  EXPECT_THAT(error_of(server().url("drip"), options), HasSubstr("too slow"));
}

TEST_F(RemoteFileTest, AChangedFileIsAnErrorThatNamesBothVersionsAndNeverAMixture) {
  // By ETag with a server that heeds If-Match and one that does not, by a weak ETag, by date alone.
  const auto by_tag = testing::AllOf(HasSubstr("changed while it was read"), HasSubstr("\"v1\""), HasSubstr("\"v2\""),
                                     HasSubstr("1000000 bytes"));
  for (const char* how : {"skip=1,change", "skip=1,change,deaf", "skip=1,change,weak", "skip=1,change,noranges"}) {
    const auto file = open_remote(server().url(how), quick_options()).value();
    EXPECT_EQ(read(*file, 0, 1000), bytes(0, 1000)) << how;
    EXPECT_THAT(read(*file, 500'000, 1000), by_tag) << how;
  }
  const auto file = open_remote(server().url("skip=1,change,noetag"), quick_options()).value();
  EXPECT_THAT(read(*file, 500'000, 1000), testing::AllOf(HasSubstr("01 Aug"), HasSubstr("02 Aug")));
}

TEST_F(RemoteFileTest, AChangeBetweenTwoPartsOfARangeIsSeen) {
  const auto file = open_remote(server().url("skip=2,change,deaf"), quick_options()).value();
  EXPECT_EQ(read(*file, 100'000, 10), bytes(100'000, 10));
  EXPECT_THAT(read(*file, 100'000, 10), HasSubstr("changed while it was read"));
}

TEST_F(RemoteFileTest, RefusalsSayWhatToDoAndAreNotRepeated) {
  EXPECT_THAT(error_of(server().url("status=404")),
              testing::AllOf(HasSubstr("/status=404/data.bin"), HasSubstr("no such file")));
  EXPECT_EQ(open_remote(server().url("status=404"), quick_options()).error().kind, Error::Kind::NotFound);
  EXPECT_THAT(error_of(server().url("status=410")), HasSubstr("removed"));
  EXPECT_THAT(error_of(server().url("status=401")), HasSubstr("credentials"));
  EXPECT_THAT(error_of(server().url("status=403")), testing::AllOf(HasSubstr("refused"), HasSubstr("as asked")));
  EXPECT_THAT(error_of(server().url("status=416")), HasSubstr("416"));
  EXPECT_THAT(error_of(server().url("status=412")), HasSubstr("412"));
  for (const char* status : {"410", "401", "403", "416", "412"})
    EXPECT_EQ(server().asked("/status=" + std::string(status) + "/").size(), 1u) << status;
}

TEST_F(RemoteFileTest, MessagesHideQueriesAndUsers) {
  const std::string message = error_of("http://me:word@" + server().host() + "/status=403/secret.tif?sig=hush&sv=1");
  EXPECT_THAT(message, HasSubstr("http://" + server().host() + "/status=403/secret.tif: "));
  EXPECT_THAT(message, Not(HasSubstr("hush")));
  EXPECT_THAT(message, Not(HasSubstr("word")));
  EXPECT_EQ(server().asked("secret.tif?sig=hush&sv=1").size(), 1u) << "the server does see it";
}

TEST_F(RemoteFileTest, RedirectsAreFollowedWithoutHandingOnAuthorization) {
  TransferOptions options = quick_options();
  options.headers = {"Authorization: Bearer hush"};
  const StandIn other;
  const auto file = open_remote(server().url("to=" + other.host()), options).value();
  EXPECT_EQ(read(*file, 500'000, 10), bytes(500'000, 10));
  EXPECT_EQ(field(server().asked("/to=")[0], "authorization"), "Bearer hush");
  ASSERT_EQ(other.asked("/arrived/").size(), 2u);
  EXPECT_EQ(field(other.asked("/arrived/")[0], "authorization"), "");
  EXPECT_EQ(field(other.asked("/arrived/")[1], "range"), "bytes=500000-500009");
}

TEST_F(RemoteFileTest, AnEmptyFileIsOne) {
  const test::TemporaryFolder folder;
  folder.write("data.bin", "");
  test::ServerProcess empty(
      {"/usr/bin/python3", NADIR_SOURCE_DIR "/tests/servers/range_server.py", folder.path().string()});
  const auto file = open_remote("http://127.0.0.1:" + empty.read_line() + "/plain/data.bin", quick_options());
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ((*file)->size(), 0u);
}

TEST_F(RemoteFileTest, WhatIsNoUrlIsNotAsked) {
  EXPECT_TRUE(is_url("http://a/b"));
  EXPECT_TRUE(is_url("HTTPS://a/b"));
  EXPECT_TRUE(is_url("s3://a/b"));
  for (const char* path : {"map.tif", "/vsicurl/http://a/b", "file:///a", "https:/a", "ftp://a/b", ""})
    EXPECT_FALSE(is_url(path)) << path;
  EXPECT_EQ(open_remote("ftp://a/b").error().kind, Error::Kind::Malformed);
  EXPECT_THAT(error_of("https:///map.tif"), HasSubstr("expected a host"));
  EXPECT_THAT(error_of("https://host/a map.tif"), HasSubstr("%20"));
  EXPECT_THAT(error_of("s3://bucket"), HasSubstr("s3://bucket/key"));
}

TEST_F(RemoteFileTest, CountsForTheProcessToo) {
  const Counters before = process_counters();
  const auto file = open_remote(server().url("counted"), quick_options()).value();
  read(*file, 500'000, 1000);
  const Counters after = process_counters();
  EXPECT_EQ(after.requests - before.requests, 2u);
  EXPECT_EQ(after.bytes - before.bytes, 32 * ki + 1000);
}

/// AWS's variables, none of them set.
struct AwsVariables {
  Variable region{"AWS_REGION", nullptr}, default_region{"AWS_DEFAULT_REGION", nullptr},
      endpoint{"AWS_S3_ENDPOINT", nullptr}, https{"AWS_HTTPS", nullptr}, hosting{"AWS_VIRTUAL_HOSTING", nullptr},
      unsigned_{"AWS_NO_SIGN_REQUEST", nullptr}, key{"AWS_ACCESS_KEY_ID", nullptr},
      secret{"AWS_SECRET_ACCESS_KEY", nullptr}, token{"AWS_SESSION_TOKEN", nullptr},
      payer{"AWS_REQUEST_PAYER", nullptr};
};

TEST_F(RemoteFileTest, BucketsAreFoundAtTheEndpointInBothStyles) {
  const AwsVariables none;
  const std::string localhost = "localhost:" + std::to_string(server().port());
  const Variable endpoint("AWS_S3_ENDPOINT", localhost.c_str()), https("AWS_HTTPS", "NO");
  const auto in_host = open_remote("s3://bucket/maps/a b+c.tif", quick_options());
  ASSERT_TRUE(in_host) << in_host.error().message;
  EXPECT_EQ((*in_host)->name(), "s3://bucket/maps/a b+c.tif");
  const auto asked = server().asked("path=/maps/a%20b%2Bc.tif");
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(field(asked[0], "host"), "bucket." + localhost);
  EXPECT_EQ(field(asked[0], "authorization"), "") << "without keys, nothing is signed";

  const Variable path_style("AWS_VIRTUAL_HOSTING", "FALSE");
  EXPECT_TRUE(open_remote("s3://bucket/maps/plain.tif", quick_options()));
  EXPECT_EQ(field(server().asked("path=/bucket/maps/plain.tif").at(0), "host"), localhost);
}

TEST_F(RemoteFileTest, RequestsToBucketsAreSignedWhereThereAreKeys) {
  const AwsVariables none;
  const Variable endpoint("AWS_S3_ENDPOINT", server().host().c_str()), https("AWS_HTTPS", "NO"),
      hosting("AWS_VIRTUAL_HOSTING", "FALSE"), region("AWS_REGION", "eu-west-1"),
      key("AWS_ACCESS_KEY_ID", "AKIDEXAMPLE"), token("AWS_SESSION_TOKEN", "of-the-session");
  const Variable secret("AWS_SECRET_ACCESS_KEY", "wJalrXUtnFEMI/K7MDENG+bPxRfiCYEXAMPLEKEY");
  const auto file = open_remote("s3://bucket/signed/a b+c.tif", quick_options());
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(read(**file, 500'000, 10), bytes(500'000, 10));
  const auto asked = server().asked("path=/bucket/signed/");
  ASSERT_EQ(asked.size(), 2u);
  for (const std::string& line : asked) {
    EXPECT_THAT(field(line, "authorization"), HasSubstr("/eu-west-1/s3/aws4_request")) << line;
    EXPECT_EQ(field(line, "signature"), "good") << line;
    EXPECT_EQ(field(line, "token"), "of-the-session") << line;
    EXPECT_NE(field(line, "payload"), "") << "S3 demands x-amz-content-sha256";
  }

  const Variable wrong("AWS_SECRET_ACCESS_KEY", "another");
  EXPECT_THAT(error_of("s3://bucket/signed/wrong.tif"),
              testing::AllOf(HasSubstr("SignatureDoesNotMatch"), Not(HasSubstr("another"))));
  const Variable unsigned_("AWS_NO_SIGN_REQUEST", "YES");
  EXPECT_TRUE(open_remote("s3://bucket/unsigned.tif", quick_options()));
  EXPECT_EQ(field(server().asked("path=/bucket/unsigned.tif").at(0), "authorization"), "");
}

TEST_F(RemoteFileTest, ABucketInAnotherRegionIsNamed) {
  const AwsVariables none;
  const Variable endpoint("AWS_S3_ENDPOINT", server().host().c_str()), https("AWS_HTTPS", "NO"),
      hosting("AWS_VIRTUAL_HOSTING", "FALSE");
  EXPECT_THAT(error_of("s3://status=301/a.tif"), HasSubstr("AWS_REGION=eu-west-1"));
}

}  // namespace
}  // namespace nadir::transfer
