#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace nadir::test {

/// A server that a test runs for as long as it is in scope.
class ServerProcess {
 public:
  /// Starts `command` (its program by path); throws where it does not start. Its standard input closes when the test
  /// ends, however it ends.
  explicit ServerProcess(const std::vector<std::string>& command);
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  /// The next line that it prints, without its end; empty when it has ended.
  std::string read_line();
  bool is_running();

 private:
  pid_t process_ = -1;
  int input_ = -1, output_ = -1;
};

/// A loopback port that nobody listens to.
int free_port();
/// Whether somebody listens there.
bool answers(int port);

}  // namespace nadir::test
