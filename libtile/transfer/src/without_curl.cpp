// What there is of transfers in a build without them.
#include <fmt/format.h>

#include "nadir/transfer/fetch.h"
#include "nadir/transfer/remote_file.h"
#include "target.h"

namespace nadir::transfer {
namespace {

tl::unexpected<Error> built_without(const std::string& url) {
  const auto target = resolve(url);
  if (!target) return fail(target);
  return fail(Error::Kind::Unsupported,
              fmt::format("{}: this build reads no URLs: install libcurl4-openssl-dev and build again with "
                          "NADIR_TRANSFER=ON",
                          target->name));
}

}  // namespace

Counters process_counters() { return {}; }

Result<std::shared_ptr<const RemoteFile>> open_remote(const std::string& url, const TransferOptions&) {
  return built_without(url);
}

Result<Response> fetch(const Request& request, const TransferOptions&) { return built_without(request.url); }

}  // namespace nadir::transfer
