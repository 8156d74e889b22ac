// The same against a server that other people wrote.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <set>
#include <thread>

#include "transfer/stand_in.h"

namespace nadir::transfer {
namespace {

using test::quick_options;
using test::read;
using test::read_many;
using test::Variable;
using testing::HasSubstr;

constexpr const char* nginx = "/usr/sbin/nginx";

/// nginx with a file of random bytes, over HTTP and, with a certificate of its own, over HTTPS and HTTP/2.
class NginxTest : public testing::Test {
 protected:
  void SetUp() override {
    if (::access(nginx, X_OK) != 0) GTEST_SKIP() << "needs nginx: install nginx-light";
    const std::string make_certificate =
        "openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=localhost -addext "
        "subjectAltName=DNS:localhost -keyout " +
        folder_.file("key.pem") + " -out " + certificate() + " 2> /dev/null";
    if (std::system(make_certificate.c_str()) != 0) GTEST_SKIP() << "needs a certificate: install openssl";
    folder_.write("data.bin", bytes);
    for (int i = 0; i < 5 && !server_; ++i) start();
    ASSERT_TRUE(server_) << test::bytes_of(folder_.file("error.log"));
  }

  void start() {
    http_port = test::free_port();
    https_port = test::free_port();
    const std::string path = folder_.path().string();
    const std::string config = folder_.write(
        "nginx.conf",
        "daemon off;\nmaster_process off;\npid " + path + "/pid;\nevents {}\nhttp {\n" +
            "  log_format own '$server_protocol $connection $status $http_range';\n  access_log " + path +
            "/access.log own;\n" + "  client_body_temp_path " + path + "/t1; proxy_temp_path " + path +
            "/t2; fastcgi_temp_path " + path + "/t3;\n" + "  uwsgi_temp_path " + path + "/t4; scgi_temp_path " + path +
            "/t5;\n" + "  server { listen 127.0.0.1:" + std::to_string(http_port) + "; root " + path + "; }\n" +
            "  server { listen 127.0.0.1:" + std::to_string(https_port) + " ssl http2; root " + path + ";\n" +
            "    ssl_certificate " + certificate() + "; ssl_certificate_key " + folder_.file("key.pem") + ";\n" +
            "    location /down { return 302 http://localhost:" + std::to_string(http_port) + "/data.bin; } }\n}\n");
    server_ = std::make_unique<test::ServerProcess>(
        std::vector<std::string>{nginx, "-p", path, "-e", folder_.file("error.log"), "-c", config});
    while (server_->is_running() && !(test::answers(http_port) && test::answers(https_port)))
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    if (!server_->is_running()) server_.reset();  // somebody took the port
  }

  std::string certificate() const { return folder_.file("certificate.pem"); }
  /// Requests for ranges. nginx writes a line after it has answered: waits for `least` of them.
  std::vector<std::string> log(std::size_t least = 0) const {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    for (;;) {
      std::vector<std::string> lines;
      std::istringstream text(test::bytes_of(folder_.file("access.log")));
      for (std::string line; std::getline(text, line);)
        if (line.find("bytes=") != std::string::npos) lines.push_back(line);
      if (lines.size() >= least || std::chrono::steady_clock::now() > until) return lines;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }

  const std::string bytes = test::random_bytes(3'000'001, /*seed=*/3);
  int http_port = 0, https_port = 0;

 private:
  const Variable no_proxy_{"no_proxy", "*"}, online_{"NADIR_OFFLINE", nullptr};
  test::TemporaryFolder folder_;
  std::unique_ptr<test::ServerProcess> server_;
};

TEST_F(NginxTest, RangesOverHttpAreTheBytesOfTheFile) {
  const auto file = open_remote("http://127.0.0.1:" + std::to_string(http_port) + "/data.bin", quick_options());
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ((*file)->size(), bytes.size());
  EXPECT_EQ(read(**file, 0, bytes.size()), bytes);
  const auto reads = read_many(**file, {{2'000'000, 100'000}, {1'000'000, 1}, {3'000'000, 1}});
  ASSERT_TRUE(reads.ok);
  EXPECT_EQ(reads.texts[0], bytes.substr(2'000'000, 100'000));
  EXPECT_EQ(reads.texts[1], bytes.substr(1'000'000, 1));
  EXPECT_EQ(reads.texts[2], bytes.substr(3'000'000, 1));
  EXPECT_THAT(
      open_remote("http://127.0.0.1:" + std::to_string(http_port) + "/none.tif", quick_options()).error().message,
      HasSubstr("no such file"));
}

TEST_F(NginxTest, ACachedFileIsRevalidatedWithoutABody) {
  const test::TemporaryFolder cache;
  TransferOptions options = quick_options();
  options.cache_dir = cache.path() / "cache";
  options.cache_bytes = 1 << 30;
  const std::string url = "http://127.0.0.1:" + std::to_string(http_port) + "/data.bin";
  const auto first = open_remote(url, options).value();
  EXPECT_EQ(read(*first, 0, bytes.size()), bytes);
  const auto again = open_remote(url, options).value();
  EXPECT_EQ(read(*again, 0, bytes.size()), bytes);
  EXPECT_EQ(again->counters().requests, 1u);
  EXPECT_EQ(again->counters().bytes, 0u);
  EXPECT_THAT(log(first->counters().requests + 1).back(), HasSubstr(" 304 "));
}

TEST_F(NginxTest, OverHttpsRequestsShareOneConnection) {
  const Variable authority("CURL_CA_BUNDLE", certificate().c_str());
  TransferOptions options = quick_options();
  options.merge_gap_bytes = 0;
  const auto file = open_remote("https://localhost:" + std::to_string(https_port) + "/data.bin", options);
  ASSERT_TRUE(file) << file.error().message;
  std::vector<std::pair<std::uint64_t, std::size_t>> ranges;
  for (std::uint64_t i = 0; i < 20; ++i) ranges.push_back({100'000 * i + 50'000, 1000});
  const auto reads = read_many(**file, ranges);
  ASSERT_TRUE(reads.ok) << reads.ok.error().message;
  for (std::size_t i = 0; i < ranges.size(); ++i) EXPECT_EQ(reads.texts[i], bytes.substr(ranges[i].first, 1000)) << i;
  std::set<std::string> connections;
  const std::vector<std::string> lines = log(21);
  for (const std::string& line : lines) connections.insert(line.substr(0, line.find(' ', line.find(' ') + 1)));
  EXPECT_EQ(lines.size(), 21u);
  EXPECT_EQ(connections.size(), 1u);
  EXPECT_THAT(*connections.begin(), testing::StartsWith("HTTP/2.0 "));
}

TEST_F(NginxTest, ACertificateNobodyVouchesForIsRefused) {
  const auto file = open_remote("https://localhost:" + std::to_string(https_port) + "/data.bin", quick_options());
  ASSERT_FALSE(file);
  EXPECT_THAT(file.error().message, HasSubstr("certificate"));
}

TEST_F(NginxTest, RedirectsFromHttpsToHttpAreNotFollowed) {
  const Variable authority("CURL_CA_BUNDLE", certificate().c_str());
  const auto file = open_remote("https://localhost:" + std::to_string(https_port) + "/down", quick_options());
  ASSERT_FALSE(file);
  EXPECT_THAT(file.error().message, HasSubstr("http"));
  for (const std::string& line : log())
    EXPECT_THAT(line, testing::StartsWith("HTTP/2.0")) << "no request without encryption";
}

}  // namespace
}  // namespace nadir::transfer
