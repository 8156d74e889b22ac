#pragma once

#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <string>

#include "nadir/base/result.h"

namespace nadir::bench {

/// nginx over a folder, behind a proxy that adds a journey; both end with it.
class WebServer {
 public:
  /// NotFound where nginx is not installed.
  static Result<std::unique_ptr<WebServer>> start(const std::string& folder, double delay_ms);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  std::string url(const std::string& file) const;
  /// Requests since the start or since `forget_requests`, as nginx logged them.
  std::int64_t requests() const;
  void forget_requests();

 private:
  explicit WebServer(std::string folder) : folder_(std::move(folder)) {}
  const std::string folder_;
  pid_t nginx_ = -1, proxy_ = -1;
  int proxy_input_ = -1, port_ = 0;
};

}  // namespace nadir::bench
