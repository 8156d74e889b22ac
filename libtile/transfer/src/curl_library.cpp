#include "curl_library.h"

#include <dlfcn.h>
#include <fmt/format.h>

namespace nadir::transfer {

Result<Curl> load_curl(const char* name) {
  // Local, because GDAL brings a libcurl of its own, of another TLS flavour.
  void* const library = ::dlopen(name, RTLD_NOW | RTLD_LOCAL);
  if (!library)
    return fail(
        Error::Kind::Unsupported,
        fmt::format(
            "maps behind URLs are read through libcurl, which cannot be loaded ({}): install the package libcurl4",
            ::dlerror()));
  Curl curl;
  const char* missing = nullptr;
  const auto find = [&](auto& function, const char* symbol) {
    function = reinterpret_cast<std::remove_reference_t<decltype(function)>>(::dlsym(library, symbol));
    if (!function) missing = symbol;
  };
  find(curl.global_init, "curl_global_init");
  find(curl.easy_init, "curl_easy_init");
  find(curl.easy_cleanup, "curl_easy_cleanup");
  find(curl.easy_setopt, "curl_easy_setopt");
  find(curl.easy_getinfo, "curl_easy_getinfo");
  find(curl.easy_strerror, "curl_easy_strerror");
  find(curl.multi_init, "curl_multi_init");
  find(curl.multi_cleanup, "curl_multi_cleanup");
  find(curl.multi_setopt, "curl_multi_setopt");
  find(curl.multi_add_handle, "curl_multi_add_handle");
  find(curl.multi_remove_handle, "curl_multi_remove_handle");
  find(curl.multi_perform, "curl_multi_perform");
  find(curl.multi_info_read, "curl_multi_info_read");
  find(curl.multi_poll, "curl_multi_poll");
  find(curl.multi_wakeup, "curl_multi_wakeup");
  find(curl.slist_append, "curl_slist_append");
  find(curl.slist_free_all, "curl_slist_free_all");
  find(curl.getdate, "curl_getdate");
  if (missing)
    return fail(Error::Kind::Unsupported,
                fmt::format("{} has no {}: install libcurl 7.85 or newer (package libcurl4)", name, missing));
  if (const CURLcode code = curl.global_init(CURL_GLOBAL_DEFAULT); code != CURLE_OK)
    return fail(Error::Kind::Unsupported, fmt::format("{} does not start: {}", name, curl.easy_strerror(code)));
  return curl;
}

}  // namespace nadir::transfer
