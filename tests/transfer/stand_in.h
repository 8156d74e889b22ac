#pragma once

#include <cstdlib>
#include <fstream>
#include <memory>
#include <optional>
#include <random>
#include <sstream>

#include "nadir/transfer/remote_file.h"
#include "support/server_process.h"
#include "support/temporary_folder.h"

namespace nadir::test {

/// An environment variable set, or unset, while in scope.
class Variable {
 public:
  Variable(const char* name, const char* value) : name_(name) {
    if (const char* const before = std::getenv(name)) before_ = before;
    value ? ::setenv(name, value, 1) : ::unsetenv(name);
  }
  ~Variable() { before_ ? ::setenv(name_, before_->c_str(), 1) : ::unsetenv(name_); }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* const name_;
  std::optional<std::string> before_;
};

inline std::string random_bytes(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  std::string bytes(size, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random());
  return bytes;
}

/// servers/range_server.py with a file of 1'000'000 random bytes: no multiple of a block, an ingest or a request.
class StandIn {
 public:
  StandIn() : bytes_(random_bytes(1'000'000, /*seed=*/7)) {
    folder_.write("data.bin", bytes_);
    server_ = std::make_unique<ServerProcess>(std::vector<std::string>{
        "/usr/bin/python3", NADIR_SOURCE_DIR "/tests/servers/range_server.py", folder_.path().string()});
    port_ = std::stoi(server_->read_line());
  }

  const std::string& bytes() const { return bytes_; }
  std::string host() const { return "127.0.0.1:" + std::to_string(port_); }
  int port() const { return port_; }
  /// The file, served as `how` says in the server's words; `name` keeps the counts of tests apart.
  std::string url(const std::string& how, const std::string& name = "data.bin") const {
    return "http://" + host() + "/" + how + "/" + name;
  }
  void stop() { server_.reset(); }

  /// What it was asked whose line holds `text`, in order.
  std::vector<std::string> asked(const std::string& text) const {
    std::vector<std::string> lines;
    std::istringstream log(bytes_of(folder_.path() / "log"));
    for (std::string line; std::getline(log, line);)
      if (line.find(text) != std::string::npos) lines.push_back(line);
    return lines;
  }

 private:
  TemporaryFolder folder_;
  const std::string bytes_;
  std::unique_ptr<ServerProcess> server_;
  int port_ = 0;
};

/// The value of `name=value` in a line of the log; empty where it is not there.
inline std::string field(const std::string& line, const std::string& name) {
  const std::size_t start = ("\t" + line).find("\t" + name + "=");
  if (start == std::string::npos) return {};
  const std::string rest = line.substr(start + name.size() + 1);
  return rest.substr(0, rest.find('\t'));
}

/// `size` bytes from `offset` on, or "error: ...".
inline std::string read(const ByteSource& source, std::uint64_t offset, std::size_t size) {
  std::string text(size, '?');
  const auto ok = source.read(offset, std::as_writable_bytes(std::span(text)));
  return ok ? text : "error: " + ok.error().message;
}

/// Several ranges at once.
struct Reads {
  std::vector<std::string> texts;
  Result<void> ok;
};
inline Reads read_many(const ByteSource& source, const std::vector<std::pair<std::uint64_t, std::size_t>>& ranges) {
  Reads reads;
  std::vector<ByteRequest> requests;
  for (const auto& [offset, size] : ranges) reads.texts.emplace_back(size, '?');
  for (std::size_t i = 0; i < ranges.size(); ++i)
    requests.push_back({ranges[i].first, std::as_writable_bytes(std::span(reads.texts[i]))});
  reads.ok = source.read_many(requests);
  return reads;
}

/// Impatient, and without a cache.
inline transfer::TransferOptions quick_options() {
  transfer::TransferOptions options;
  options.backoff_base_s = 0.01;
  options.cache_bytes = 0;
  return options;
}

}  // namespace nadir::test
