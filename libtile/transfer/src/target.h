#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "nadir/base/result.h"

namespace nadir::transfer {

/// Where a URL leads and how its requests are signed.
struct Target {
  std::string url;       // http or https
  std::string name;      // for messages: the URL as it was given, without query and user
  std::string identity;  // the same file has the same, whoever signed the link and when: what the cache knows it by
  std::string host;      // scheme, host and port: what waits together when it is overloaded
  bool is_https = false;

  std::vector<std::string> headers;  // that each request carries
  std::string signing;               // curl's "aws:amz:REGION:s3"; empty: not signed
  std::string access_key, secret_key;
};

/// Malformed where `url` is neither http, https nor s3 or has no host. Reads the AWS_ variables of the environment for
/// s3.
Result<Target> resolve(const std::string& url);

}  // namespace nadir::transfer
