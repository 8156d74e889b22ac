#include "nadir/transfer/fetch.h"

#include <fmt/format.h>

#include "engine.h"
#include "nadir/base/text.h"

namespace nadir::transfer {
namespace {

/// A whole answer, kept in memory.
class WholeExchange : public Exchange {
 public:
  WholeExchange(std::shared_ptr<const Endpoint> to, std::shared_ptr<Batch> batch, const Request& request)
      : Exchange(std::move(to), std::move(batch)), request_(request) {}

  Outgoing next_try() override {
    response_ = {};
    return {
        .method = request_.method, .headers = request_.headers, .range = {}, .body = request_.body, .compressed = true};
  }
  Verdict head(const Head& head) override {
    response_.status = head.status;
    response_.headers = head.headers;
    return Verdict::Proceed;
  }
  Verdict bytes(std::span<const std::byte> bytes) override {
    response_.body.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    if (response_.body.size() <= request_.limit_bytes) return Verdict::Proceed;
    error = Error{Error::Kind::OverBudget,
                  fmt::format("{}: the answer is longer than the {} expected: ask for less at a time",
                              endpoint->target.name, format_bytes(request_.limit_bytes))};
    return Verdict::Failed;
  }
  Verdict end() override { return Verdict::Proceed; }

  Response& response() { return response_; }

 private:
  const Request request_;
  Response response_;
};

}  // namespace

Result<Response> fetch(const Request& request, const TransferOptions& options) {
  const auto target = resolve(request.url);
  if (!target) return fail(target);
  if (is_offline(options))
    return fail(Error::Kind::NotFound, fmt::format("{}: offline: answers of services are not cached", target->name));
  const auto endpoint = std::make_shared<Endpoint>();
  endpoint->target = *target;
  endpoint->options = options;
  const auto batch = std::make_shared<Batch>();
  const auto exchange = std::make_shared<WholeExchange>(endpoint, batch, request);
  const std::shared_ptr<Exchange> submitted = exchange;
  if (auto ok = submit({&submitted, 1}); !ok) return fail(ok);
  batch->next();
  if (exchange->error) return tl::unexpected(*exchange->error);
  return std::move(exchange->response());
}

}  // namespace nadir::transfer
