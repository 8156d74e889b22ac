#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "nadir/base/result.h"
#include "nadir/transfer/options.h"

namespace nadir::transfer {

/// One question to a web service.
struct Request {
  std::string url;  // http, https or s3
  std::string method = "GET";
  std::vector<std::string> headers;  // "Name: value", beside those of the options
  std::string body;
  std::uint64_t limit_bytes = 64 << 20;  // a longer answer is an Error
};

/// Its answer, whatever the status: what a service says about a refusal is for the caller to read.
struct Response {
  int status = 0;
  std::map<std::string, std::string> headers;  // names in lower case; of several of one name, the last
  std::string body;                            // decompressed
};

/// Asks once, or again as files are asked for: after lost connections, timeouts, 408, 429, 500, 502, 503 and 504, so a
/// request must bear repetition. Error::Io when no try brought an answer, Error::OverBudget beyond `limit_bytes`.
/// Nothing is cached. Thread-safe; requests of several threads travel side by side.
Result<Response> fetch(const Request& request, const TransferOptions& options = {});

}  // namespace nadir::transfer
