#include "target.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>

#include "nadir/base/text.h"
#include "nadir/transfer/remote_file.h"

namespace nadir::transfer {
namespace {

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return result;
}

std::string variable(const char* name, const char* otherwise = "") {
  const char* const value = std::getenv(name);
  return value && *value ? value : otherwise;
}

bool is_no(std::string_view value) {
  const std::string text = lower(value);
  return text == "no" || text == "false" || text == "off" || text == "0";
}

bool is_yes(std::string_view value) {
  const std::string text = lower(value);
  return text == "yes" || text == "true" || text == "on" || text == "1";
}

/// Keys are names, not URLs: all but unreserved characters and slashes is escaped, once, as S3 signs it.
std::string escape_key(std::string_view key) {
  std::string text;
  for (const char c : key) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       std::string_view("-._~/").find(c) != std::string_view::npos;
    if (plain)
      text += c;
    else
      text += fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return text;
}

/// Parts of a query that say who may read, not what: of Azure, S3, Google and CloudFront.
bool is_signature(std::string_view parameter, bool is_azure) {
  constexpr std::array azure = {"sv",  "ss",  "srt",   "st",    "se",  "sp",  "sr",  "sig",
                                "sip", "spr", "skoid", "sktid", "skt", "ske", "sks", "skv"};
  constexpr std::array others = {"signature",      "expires",      "key-pair-id", "policy", "awsaccesskeyid",
                                 "googleaccessid", "access_token", "token",       "key",    "api_key"};
  const std::string name = lower(parameter.substr(0, parameter.find('=')));
  if (is_azure && std::find(azure.begin(), azure.end(), name) != azure.end()) return true;
  return name.starts_with("x-amz-") || name.starts_with("x-goog-") ||
         std::find(others.begin(), others.end(), name) != others.end();
}

std::string without_signature(std::string_view query) {
  const std::vector<std::string_view> parameters = split(query, '&');
  const bool is_azure =
      std::any_of(parameters.begin(), parameters.end(), [](std::string_view text) { return text.starts_with("sig="); });
  std::string kept;
  for (const std::string_view parameter : parameters) {
    if (parameter.empty() || is_signature(parameter, is_azure)) continue;
    kept += kept.empty() ? '?' : '&';
    kept += parameter;
  }
  return kept;
}

Result<Target> resolve_http(const std::string& url) {
  const std::size_t scheme_end = url.find("://");
  const std::string scheme = lower(std::string_view(url).substr(0, scheme_end));
  std::string_view rest = std::string_view(url).substr(scheme_end + 3);
  rest = rest.substr(0, rest.find('#'));

  const std::size_t query_start = rest.find('?');
  const std::string_view query =
      query_start == std::string_view::npos ? std::string_view{} : rest.substr(query_start + 1);
  rest = rest.substr(0, query_start);
  const std::size_t path_start = rest.find('/');
  std::string_view authority = rest.substr(0, path_start);
  const std::string_view path = path_start == std::string_view::npos ? std::string_view("/") : rest.substr(path_start);
  if (const std::size_t at = authority.rfind('@'); at != std::string_view::npos) authority = authority.substr(at + 1);

  Target target;
  target.url = url;
  target.host = scheme + "://" + lower(authority);
  target.name = target.host + std::string(path);
  target.identity = target.name + without_signature(query);
  target.is_https = scheme == "https";
  if (authority.empty() || authority.front() == ':')
    return fail(Error::Kind::Malformed, fmt::format("{}: expected a host after '{}://'", target.name, scheme));
  return target;
}

Result<Target> resolve_s3(const std::string& url) {
  const std::string_view rest = std::string_view(url).substr(5);
  const std::size_t slash = rest.find('/');
  if (slash == std::string_view::npos || slash == 0 || slash + 1 == rest.size())
    return fail(Error::Kind::Malformed, fmt::format("{}: expected s3://bucket/key", url));
  const std::string bucket(rest.substr(0, slash));
  const std::string key = escape_key(rest.substr(slash + 1));
  const std::string region = variable("AWS_REGION", variable("AWS_DEFAULT_REGION", "us-east-1").c_str());

  // Without the scheme that some write in front of it.
  std::string endpoint = variable("AWS_S3_ENDPOINT", fmt::format("s3.{}.amazonaws.com", region).c_str());
  std::string scheme = is_no(variable("AWS_HTTPS")) ? "http" : "https";
  if (const std::size_t end = endpoint.find("://"); end != std::string::npos) {
    scheme = endpoint.substr(0, end);
    endpoint = endpoint.substr(end + 3);
  }
  while (endpoint.ends_with('/')) endpoint.pop_back();
  // A bucket with a dot is no name that a wildcard certificate covers.
  const bool in_host = !is_no(variable("AWS_VIRTUAL_HOSTING")) && bucket.find('.') == std::string::npos;
  auto target = resolve_http(in_host ? fmt::format("{}://{}.{}/{}", scheme, bucket, endpoint, key)
                                     : fmt::format("{}://{}/{}/{}", scheme, endpoint, bucket, key));
  if (!target) return target;
  target->name = url;

  if (const std::string payer = variable("AWS_REQUEST_PAYER"); !payer.empty())
    target->headers.push_back("x-amz-request-payer: " + payer);
  const std::string access_key = variable("AWS_ACCESS_KEY_ID");
  const std::string secret_key = variable("AWS_SECRET_ACCESS_KEY");
  if (access_key.empty() || secret_key.empty() || is_yes(variable("AWS_NO_SIGN_REQUEST"))) return target;
  target->signing = fmt::format("aws:amz:{}:s3", region);
  target->access_key = access_key;
  target->secret_key = secret_key;
  if (const std::string token = variable("AWS_SESSION_TOKEN"); !token.empty())
    target->headers.push_back("x-amz-security-token: " + token);
  return target;
}

}  // namespace

bool is_url(std::string_view path) {
  const std::string start = lower(path.substr(0, 8));
  return start.starts_with("http://") || start.starts_with("https://") || start.starts_with("s3://");
}

Result<Target> resolve(const std::string& url) {
  if (!is_url(url)) return fail(Error::Kind::Malformed, fmt::format("{}: expected http://, https:// or s3://", url));
  const auto is_bad = [](unsigned char c) { return c <= ' ' || c == 127; };
  if (lower(url.substr(0, 5)) == "s3://") return resolve_s3(url);
  auto target = resolve_http(url);
  if (target && std::any_of(url.begin(), url.end(), is_bad))
    return fail(Error::Kind::Malformed,
                fmt::format("{}: has a blank or control character: write %20 for a blank", target->name));
  return target;
}

}  // namespace nadir::transfer
