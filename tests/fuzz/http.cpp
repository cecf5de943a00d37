// What callers of a live page send. The server is a thread of this process, and each input a connection.
#include "experiments/report/live/http_server.hpp"
#include "tests/fuzz/fuzz.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>
#include <thread>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

namespace {

using namespace solenoid;

constexpr int longest_ms = 5;

void require_text(std::string_view text) {
  if (std::ranges::any_of(text, [](unsigned char c) { return c < 0x20 || c == 0x7f; }))
    fuzz::find("a handler was given a control character");
}

HttpAnswer echo(const HttpRequest& request) {
  if (!request.path.starts_with('/')) fuzz::find("a path that is none");
  require_text(request.path);
  for (const auto& [key, value] : request.query) {
    require_text(key);
    require_text(value);
  }
  return {200, "text/plain", std::make_shared<const std::string>(request.path)};
}

/// The port, once it is served.
int served_port() {
  static HttpServer server(echo);
  static const int port = [] {
    const int free = server.listen(0);
    std::thread([] { server.serve(); }).detach();
    return free;
  }();
  return port;
}

}  // namespace

/// "{HOST}" in the input is the server's name.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const int port = served_port();
  std::string request(fuzz::text_of(bytes, size));
  if (const std::size_t at = request.find("{HOST}"); at != std::string::npos)
    request.replace(at, 6, fmt::format("127.0.0.1:{}", port));
  const int caller = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(port));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const linger at_once{1, 0};  // no port has to wait until its last packets have died away: there are 28,000
  ::setsockopt(caller, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  if (::connect(caller, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0 &&
      errno != EINTR)  // by the fuzzer's clock: it goes on connecting, and send waits for it
    fuzz::find(std::string("nobody listens: ") + std::strerror(errno));
  std::string answer;
  if (::send(caller, request.data(), request.size(), MSG_NOSIGNAL) >= 0) {
    char buffer[4096];
    pollfd answered{caller, POLLIN, 0};
    if (::poll(&answered, 1, longest_ms) == 0) ::shutdown(caller, SHUT_RDWR);  // no whole request: it waits for more
    for (ssize_t n = 0; (n = ::recv(caller, buffer, sizeof buffer, 0)) > 0;)
      answer.append(buffer, static_cast<std::size_t>(n));
  }
  ::close(caller);
  if (!answer.empty() && !answer.starts_with("HTTP/1.")) fuzz::find("an answer that is none: " + answer.substr(0, 100));
  return 0;
}
