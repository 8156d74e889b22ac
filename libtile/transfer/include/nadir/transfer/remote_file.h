#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "nadir/base/byte_source.h"
#include "nadir/transfer/options.h"

namespace nadir::transfer {

/// A file behind a URL, read by range requests.
///
/// `read_many` joins neighbouring ranges and has several requests under way at once. The file counts as one version of
/// its bytes from opening on: when the server has another, reading is an Error that names both, never a mixture.
/// Thread-safe.
class RemoteFile : public ByteSource {
 public:
  bool is_remote() const override { return true; }
  virtual Counters counters() const = 0;
};

/// Whether `path` is meant for `open_remote`: http://, https:// or s3://, in any case.
bool is_url(std::string_view path);

/// Opens a file with one request, which brings its first bytes along.
///
/// `s3://bucket/key` is https://bucket.s3.REGION.amazonaws.com/key; AWS_REGION, AWS_S3_ENDPOINT, AWS_HTTPS,
/// AWS_VIRTUAL_HOSTING, AWS_REQUEST_PAYER, AWS_NO_SIGN_REQUEST, AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and
/// AWS_SESSION_TOKEN mean what they mean to GDAL; without keys, requests are not signed. Messages show URLs without
/// their query, which may hold a signature. NotFound where the server has no such file (404, 410), Unsupported where it
/// cannot serve ranges or the program was built without transfers, Malformed where `url` is none, Io for the rest.
Result<std::shared_ptr<const RemoteFile>> open_remote(const std::string& url, const TransferOptions& options = {});

}  // namespace nadir::transfer
