#include "engine.h"

#include <fmt/format.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <list>
#include <random>
#include <thread>

#include "curl_library.h"
#include "nadir/base/text.h"

namespace nadir::transfer {
namespace {

using Clock = std::chrono::steady_clock;

/// Error bodies are read this far: enough for what a message says, and for the connection to stay usable.
constexpr std::size_t excerpt_bytes = 4096;
constexpr long redirects = 5;

struct CleanUpEasy {
  const Curl* curl;
  void operator()(CURL* handle) const noexcept { curl->easy_cleanup(handle); }
};
struct FreeList {
  const Curl* curl;
  void operator()(curl_slist* list) const noexcept { curl->slist_free_all(list); }
};
struct CleanUpMulti {
  const Curl* curl;
  void operator()(CURLM* handle) const noexcept { curl->multi_cleanup(handle); }
};

/// One request under way.
struct Try {
  std::shared_ptr<Exchange> exchange;
  Outgoing outgoing;
  const Curl* curl = nullptr;
  std::unique_ptr<CURL, CleanUpEasy> easy{nullptr, CleanUpEasy{nullptr}};
  std::unique_ptr<curl_slist, FreeList> lines{nullptr, FreeList{nullptr}};
  char problem[CURL_ERROR_SIZE] = "";

  Head head;
  bool told_head = false;  // the exchange knows it
  Verdict verdict = Verdict::Proceed;
  std::string excerpt;  // of the body of a status that passes

  /// Tells the exchange the head, once it is the last one: redirects bring others before it.
  void tell_head() {
    if (told_head) return;
    told_head = true;
    long status = 0;
    curl->easy_getinfo(easy.get(), CURLINFO_RESPONSE_CODE, &status);
    head.status = static_cast<int>(status);
    if (!is_passing(head.status)) verdict = exchange->head(head);
  }
};

std::size_t on_header(char* text, std::size_t, std::size_t size, void* context) {
  Try& attempt = *static_cast<Try*>(context);
  const std::string_view line(text, size);
  if (line.starts_with("HTTP/")) attempt.head.headers.clear();
  if (!attempt.told_head) add_header_line(line, attempt.head.headers);  // what follows the body is no part of the head
  return size;
}

std::size_t on_body(char* data, std::size_t, std::size_t size, void* context) {
  Try& attempt = *static_cast<Try*>(context);
  attempt.exchange->endpoint->count(&Tally::bytes, size);
  attempt.tell_head();
  if (is_passing(attempt.head.status)) {
    attempt.excerpt.append(data, std::min(size, excerpt_bytes));
    return attempt.excerpt.size() < excerpt_bytes ? size : 0;
  }
  if (attempt.verdict == Verdict::Proceed)
    attempt.verdict = attempt.exchange->bytes(std::as_bytes(std::span(data, size)));
  return attempt.verdict == Verdict::Proceed ? size : 0;
}

/// Whether the network or the server's machine failed, rather than the request.
bool may_pass(CURLcode code) {
  switch (code) {
    case CURLE_COULDNT_RESOLVE_PROXY:
    case CURLE_COULDNT_RESOLVE_HOST:
    case CURLE_COULDNT_CONNECT:
    case CURLE_OPERATION_TIMEDOUT:
    case CURLE_SSL_CONNECT_ERROR:
    case CURLE_SEND_ERROR:
    case CURLE_RECV_ERROR:
    case CURLE_GOT_NOTHING:
    case CURLE_PARTIAL_FILE:
    case CURLE_HTTP2:
    case CURLE_HTTP2_STREAM:
      return true;
    default:
      return false;
  }
}

}  // namespace

/// The thread that runs all transfers, and what it knows.
class Engine {
 public:
  /// The one of this process; libcurl is loaded at the first call.
  static Result<Engine*> instance() {
    static const Result<Curl> curl = load_curl();
    if (!curl) return fail(curl);
    static Engine engine(*curl);
    return &engine;
  }

  void submit(std::span<const std::shared_ptr<Exchange>> exchanges) {
    {
      std::scoped_lock lock(mutex_);
      arrivals_.insert(arrivals_.end(), exchanges.begin(), exchanges.end());
    }
    wake();
  }

  void wake() { curl_.multi_wakeup(multi_.get()); }

 private:
  struct Host {
    int under_way = 0;
    Clock::time_point not_before{};
  };

  explicit Engine(const Curl& curl) : curl_(curl), multi_(curl_.multi_init(), CleanUpMulti{&curl_}) {
    curl_.multi_setopt(multi_.get(), CURLMOPT_PIPELINING, static_cast<long>(CURLPIPE_MULTIPLEX));
    curl_.multi_setopt(multi_.get(), CURLMOPT_MAXCONNECTS, 64L);  // kept open between calls
    thread_ = std::thread([this] { run(); });
  }

  ~Engine() {
    {
      std::scoped_lock lock(mutex_);
      stopping_ = true;
    }
    curl_.multi_wakeup(multi_.get());
    thread_.join();
  }

  void run();
  /// Starts what may start; the time until more may, for reasons of waiting.
  Clock::duration start_waiting();
  void start(std::shared_ptr<Exchange> exchange, Host& host);
  void set_options(Try& attempt);
  /// Whether any ended.
  bool collect_ended();
  void judge(Try& attempt, CURLcode code);
  void try_later(const std::shared_ptr<Exchange>& exchange, Clock::duration wait);
  void finish(const std::shared_ptr<Exchange>& exchange, std::optional<Error> error = std::nullopt);
  /// Full jitter, before the try after `tries` of them.
  double back_off_s(const Exchange& exchange);
  /// What the answer asks for; 0 where it does not.
  double retry_after_s(const Head& head) const;

  const Curl curl_;
  const std::unique_ptr<CURLM, CleanUpMulti> multi_;
  std::mutex mutex_;  // guards the two below
  std::vector<std::shared_ptr<Exchange>> arrivals_;
  bool stopping_ = false;

  // Of the thread alone.
  std::list<std::shared_ptr<Exchange>> waiting_;
  std::map<CURL*, std::unique_ptr<Try>> under_way_;
  std::map<std::string, Host> hosts_;
  std::mt19937_64 random_{std::random_device{}() ^
                          (static_cast<std::uint64_t>(::getpid()) << 32)};  // decides waits, never bytes

  std::thread thread_;  // last: it uses all the others
};

void Engine::run() {
  // Signals are for the program's own threads; and without NOSIGNAL's help, a write to a closed TLS connection raises
  // SIGPIPE.
  sigset_t all;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, nullptr);

  while (true) {
    {
      std::scoped_lock lock(mutex_);
      if (stopping_) break;
      waiting_.insert(waiting_.end(), arrivals_.begin(), arrivals_.end());
      arrivals_.clear();
    }
    const Clock::duration pause = start_waiting();
    int running = 0;
    curl_.multi_perform(multi_.get(), &running);
    if (collect_ended()) continue;  // there may be room for others
    const auto pause_ms = std::chrono::ceil<std::chrono::milliseconds>(pause).count();
    curl_.multi_poll(multi_.get(), nullptr, 0, static_cast<int>(pause_ms), nullptr);
  }
  for (const auto& [easy, attempt] : under_way_) curl_.multi_remove_handle(multi_.get(), easy);
  under_way_.clear();
}

Clock::duration Engine::start_waiting() {
  for (auto it = under_way_.begin(); it != under_way_.end();) {
    if (!it->second->exchange->batch_->cancelled_) {
      ++it;
      continue;
    }
    curl_.multi_remove_handle(multi_.get(), it->first);
    --hosts_[it->second->exchange->endpoint->target.host].under_way;
    it = under_way_.erase(it);
  }

  const Clock::time_point now = Clock::now();
  Clock::duration pause = std::chrono::minutes(1);
  for (auto it = waiting_.begin(); it != waiting_.end();) {
    const std::shared_ptr<Exchange> exchange = *it;
    Host& host = hosts_[exchange->endpoint->target.host];
    const Clock::time_point start_time = std::max(exchange->not_before_, host.not_before);
    if (exchange->batch_->cancelled_) {
      it = waiting_.erase(it);
    } else if (start_time > now) {
      pause = std::min(pause, start_time - now);
      ++it;
    } else if (host.under_way >= std::max(1, exchange->endpoint->options.connections)) {
      ++it;
    } else {
      it = waiting_.erase(it);
      start(exchange, host);
    }
  }
  return pause;
}

void Engine::start(std::shared_ptr<Exchange> exchange, Host& host) {
  auto attempt = std::make_unique<Try>();
  attempt->curl = &curl_;
  attempt->easy = {curl_.easy_init(), CleanUpEasy{&curl_}};
  attempt->outgoing = exchange->next_try();
  attempt->exchange = std::move(exchange);
  set_options(*attempt);

  ++attempt->exchange->tries_;
  attempt->exchange->endpoint->count(&Tally::requests);
  if (attempt->exchange->tries_ > 1) attempt->exchange->endpoint->count(&Tally::retries);
  ++host.under_way;
  curl_.multi_add_handle(multi_.get(), attempt->easy.get());
  under_way_.emplace(attempt->easy.get(), std::move(attempt));
}

void Engine::set_options(Try& attempt) {
  const Target& target = attempt.exchange->endpoint->target;
  const TransferOptions& options = attempt.exchange->endpoint->options;
  const Outgoing& outgoing = attempt.outgoing;
  const auto set = [&, easy = attempt.easy.get()](CURLoption option, auto value) {
    curl_.easy_setopt(easy, option, value);
  };

  set(CURLOPT_URL, target.url.c_str());
  set(CURLOPT_PROTOCOLS_STR, "http,https");
  set(CURLOPT_FOLLOWLOCATION, target.signing.empty() ? 1L : 0L);  // a session token is for its own host
  set(CURLOPT_MAXREDIRS, redirects);
  set(CURLOPT_REDIR_PROTOCOLS_STR, target.is_https ? "https" : "http,https");
  set(CURLOPT_USERAGENT, "nadir/" NADIR_VERSION);
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_TCP_KEEPALIVE, 1L);
  set(CURLOPT_BUFFERSIZE, 256L << 10);
  set(CURLOPT_PIPEWAIT, target.is_https ? 1L : 0L);  // better one HTTP/2 connection than eight
  set(CURLOPT_CONNECTTIMEOUT_MS, std::lround(options.connect_timeout_s * 1e3));
  set(CURLOPT_LOW_SPEED_LIMIT, static_cast<long>(options.low_speed_bytes_per_s));
  set(CURLOPT_LOW_SPEED_TIME, static_cast<long>(options.low_speed_s));
  // The library itself does not read what the curl command does.
  for (const char* const name : {"CURL_CA_BUNDLE", "SSL_CERT_FILE"})
    if (const char* const file = std::getenv(name); file && *file) {
      set(CURLOPT_CAINFO, file);
      break;
    }

  const auto add_line = [&](const std::string& line) {
    if (curl_slist* const longer = curl_.slist_append(attempt.lines.get(), line.c_str())) {
      (void)attempt.lines.release();
      attempt.lines = {longer, FreeList{&curl_}};
    }
  };
  for (const auto* const lines : {&target.headers, &options.headers, &outgoing.headers})
    for (const std::string& line : *lines) add_line(line);
  if (!outgoing.body.empty()) add_line("Expect:");  // no waiting for leave to send it
  if (!outgoing.range.empty()) set(CURLOPT_RANGE, outgoing.range.c_str());
  if (outgoing.compressed) set(CURLOPT_ACCEPT_ENCODING, "");
  if (outgoing.method == "HEAD") {
    set(CURLOPT_NOBODY, 1L);
  } else if (outgoing.method != "GET" || !outgoing.body.empty()) {
    set(CURLOPT_POSTFIELDSIZE_LARGE, static_cast<curl_off_t>(outgoing.body.size()));
    set(CURLOPT_POSTFIELDS, outgoing.body.data());
    if (outgoing.method != "POST") set(CURLOPT_CUSTOMREQUEST, outgoing.method.c_str());
  }
  if (!target.signing.empty()) {
    // S3 demands it, and libcurl 7.88 signs what is there but does not add it: SHA-256 of no bytes.
    if (outgoing.body.empty())
      add_line("x-amz-content-sha256: e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    set(CURLOPT_AWS_SIGV4, target.signing.c_str());
    set(CURLOPT_USERNAME, target.access_key.c_str());
    set(CURLOPT_PASSWORD, target.secret_key.c_str());
  }
  set(CURLOPT_HTTPHEADER, attempt.lines.get());
  set(CURLOPT_ERRORBUFFER, &attempt.problem[0]);
  set(CURLOPT_HEADERFUNCTION, &on_header);
  set(CURLOPT_HEADERDATA, static_cast<void*>(&attempt));
  set(CURLOPT_WRITEFUNCTION, &on_body);
  set(CURLOPT_WRITEDATA, static_cast<void*>(&attempt));
}

bool Engine::collect_ended() {
  bool any = false;
  int left = 0;
  while (const CURLMsg* const message = curl_.multi_info_read(multi_.get(), &left)) {
    if (message->msg != CURLMSG_DONE) continue;
    const CURLcode code = message->data.result;
    const auto found = under_way_.find(message->easy_handle);
    const std::unique_ptr<Try> attempt = std::move(found->second);
    under_way_.erase(found);
    curl_.multi_remove_handle(multi_.get(), attempt->easy.get());
    --hosts_[attempt->exchange->endpoint->target.host].under_way;
    judge(*attempt, code);
    any = true;
  }
  return any;
}

void Engine::judge(Try& attempt, CURLcode code) {
  const std::shared_ptr<Exchange>& exchange = attempt.exchange;
  const std::string& name = exchange->endpoint->target.name;
  const TransferOptions& options = exchange->endpoint->options;
  const bool is_last = exchange->tries_ >= options.tries;
  const auto seconds = [](double s) {
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s));
  };

  if (code == CURLE_OK) attempt.tell_head();

  // The server asks to come later: all requests to it wait.
  if (attempt.told_head && is_passing(attempt.head.status)) {
    std::string what = fmt::format("{}: HTTP {}", name, attempt.head.status);
    if (const std::string said = summary(attempt.excerpt); !said.empty()) what += fmt::format(" ({})", said);
    const double asked_s = retry_after_s(attempt.head);
    if (asked_s > options.retry_after_limit_s)
      return finish(exchange,
                    Error{Error::Kind::Io, fmt::format("{}: the server asks to come back in {:.0f} s", what, asked_s)});
    if (is_last)
      return finish(exchange,
                    Error{Error::Kind::Io, fmt::format("{}, after {} tries: the server is overloaded or out of order; "
                                                       "try again later or with fewer connections",
                                                       what, exchange->tries_)});
    const Clock::duration wait = seconds(std::max(asked_s, back_off_s(*exchange)));
    if (attempt.head.status == 429 || attempt.head.status == 503) {
      Host& host = hosts_[exchange->endpoint->target.host];
      host.not_before = std::max(host.not_before, Clock::now() + wait);
    }
    return try_later(exchange, wait);
  }

  if (code == CURLE_OK && attempt.verdict == Verdict::Proceed) attempt.verdict = exchange->end();
  if (attempt.verdict == Verdict::Failed) return finish(exchange);
  if (attempt.verdict == Verdict::Again && !is_last) return try_later(exchange, Clock::duration::zero());
  if (code == CURLE_OK && attempt.verdict == Verdict::Proceed) return finish(exchange);

  std::string reason = attempt.problem[0] ? attempt.problem : curl_.easy_strerror(code);
  if (attempt.verdict != Verdict::Proceed) reason = "the answer was not what was asked for or ended early";
  if (attempt.verdict == Verdict::Proceed && !may_pass(code))
    return finish(exchange, Error{Error::Kind::Io, fmt::format("{}: {}", name, reason)});
  if (is_last)
    return finish(exchange, Error{Error::Kind::Io,
                                  fmt::format("{}: {}, after {} tries: check the network, the proxy and the address",
                                              name, reason, exchange->tries_)});
  try_later(exchange, seconds(back_off_s(*exchange)));
}

void Engine::try_later(const std::shared_ptr<Exchange>& exchange, Clock::duration wait) {
  exchange->not_before_ = Clock::now() + wait;
  waiting_.push_front(exchange);  // it was before those that wait for room
}

void Engine::finish(const std::shared_ptr<Exchange>& exchange, std::optional<Error> error) {
  if (error) exchange->error = std::move(error);
  exchange->batch_->add(exchange);
}

double Engine::back_off_s(const Exchange& exchange) {
  const TransferOptions& options = exchange.endpoint->options;
  const double most_s = std::min(options.backoff_cap_s, std::ldexp(options.backoff_base_s, exchange.tries_ - 1));
  return std::uniform_real_distribution<double>(0.0, 1.0)(random_) * most_s;
}

double Engine::retry_after_s(const Head& head) const {
  const std::string text(head["retry-after"]);
  if (const auto seconds = parse_digits(text)) return static_cast<double>(*seconds);
  const std::time_t date = text.empty() ? -1 : curl_.getdate(text.c_str(), nullptr);
  if (date == -1) return 0.0;
  // Against the server's clock, where it tells: ours may be wrong by more than the wait.
  const std::string server_text(head["date"]);
  const std::time_t server_date = server_text.empty() ? -1 : curl_.getdate(server_text.c_str(), nullptr);
  return std::max(0.0, std::difftime(date, server_date == -1 ? std::time(nullptr) : server_date));
}

Result<void> submit(std::span<const std::shared_ptr<Exchange>> exchanges) {
  const auto engine = Engine::instance();
  if (!engine) return fail(engine);
  (*engine)->submit(exchanges);
  return {};
}

void cancel(Batch& batch) {
  batch.cancelled_ = true;
  if (const auto engine = Engine::instance()) (*engine)->wake();
}

std::shared_ptr<Exchange> Batch::next() {
  std::unique_lock lock(mutex_);
  something_ended_.wait(lock, [&] { return !ended_.empty(); });
  std::shared_ptr<Exchange> exchange = std::move(ended_.front());
  ended_.pop_front();
  return exchange;
}

void Batch::add(std::shared_ptr<Exchange> exchange) {
  {
    std::scoped_lock lock(mutex_);
    ended_.push_back(std::move(exchange));
  }
  something_ended_.notify_one();
}

}  // namespace nadir::transfer
