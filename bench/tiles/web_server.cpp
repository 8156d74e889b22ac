#include "web_server.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

namespace nadir::bench {
namespace {

namespace fs = std::filesystem;

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

int free_port() {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof address;
  ::bind(socket, reinterpret_cast<sockaddr*>(&address), size);
  ::getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size);
  ::close(socket);
  return ntohs(address.sin_port);
}

bool answers(int port) {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  const sockaddr_in address = loopback(port);
  const bool ok = ::connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  ::close(socket);
  return ok;
}

}  // namespace

Result<std::unique_ptr<WebServer>> WebServer::start(const std::string& folder, double delay_ms) {
  const char* const nginx = "/usr/sbin/nginx";
  if (::access(nginx, X_OK) != 0)
    return fail(Error::Kind::NotFound, "nginx is not installed: install the package nginx-light");
  std::unique_ptr<WebServer> server(new WebServer(folder));
  const int inner = free_port();
  const std::string work = folder + "/nginx";
  fs::create_directories(work);
  std::ofstream(work + "/nginx.conf") << fmt::format(
      "daemon off; master_process off; pid {0}/pid; error_log {0}/error.log; events {{}}\n"
      "http {{ access_log {0}/access.log; client_body_temp_path {0}/b; proxy_temp_path {0}/p; fastcgi_temp_path "
      "{0}/f;\n"
      "uwsgi_temp_path {0}/u; scgi_temp_path {0}/s; server {{ listen 127.0.0.1:{1}; root {2}; }} }}\n",
      work, inner, folder);
  server->nginx_ = ::fork();
  if (server->nginx_ == 0) {
    const int nowhere = ::open("/dev/null", O_WRONLY);
    ::dup2(nowhere, 1), ::dup2(nowhere, 2);
    ::execl(nginx, nginx, "-c", (work + "/nginx.conf").c_str(), "-p", work.c_str(), nullptr);
    ::_exit(127);
  }
  for (int i = 0; i < 200 && !answers(inner); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  if (!answers(inner)) return fail(Error::Kind::Io, work + ": nginx does not start; see its error.log");

  std::array<int, 2> input{}, output{};
  if (::pipe(input.data()) != 0 || ::pipe(output.data()) != 0) return fail(Error::Kind::Io, "no pipe for the proxy");
  server->proxy_ = ::fork();
  if (server->proxy_ == 0) {
    ::dup2(input[0], 0), ::dup2(output[1], 1);
    ::close(input[1]), ::close(output[0]);
    ::execl("/usr/bin/python3", "python3", NADIR_SOURCE_DIR "/bench/tiles/delay_proxy.py",
            std::to_string(inner).c_str(), std::to_string(delay_ms).c_str(), nullptr);
    ::_exit(127);
  }
  ::close(input[0]), ::close(output[1]);
  server->proxy_input_ = input[1];
  std::string line;
  for (char c = 0; ::read(output[0], &c, 1) == 1 && c != '\n';) line += c;
  ::close(output[0]);
  server->port_ = std::atoi(line.c_str());
  if (server->port_ == 0) return fail(Error::Kind::Io, "the proxy that adds the journey does not start");
  return server;
}

WebServer::~WebServer() {
  if (proxy_input_ >= 0) ::close(proxy_input_);
  for (const pid_t process : {proxy_, nginx_}) {
    if (process <= 0) continue;
    ::kill(process, SIGTERM);
    ::waitpid(process, nullptr, 0);
  }
}

std::string WebServer::url(const std::string& file) const { return fmt::format("http://127.0.0.1:{}/{}", port_, file); }

std::int64_t WebServer::requests() const {
  std::ifstream log(folder_ + "/nginx/access.log");
  std::int64_t lines = 0;
  for (std::string line; std::getline(log, line);) ++lines;
  return lines;
}

void WebServer::forget_requests() { std::ofstream(folder_ + "/nginx/access.log", std::ios::trunc); }

}  // namespace nadir::bench
