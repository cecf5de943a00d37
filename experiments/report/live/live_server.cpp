#include "experiments/report/live/live_server.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/report/live/live_state.hpp"
#include "experiments/report/page.hpp"

#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <thread>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <httplib.h>
#include <netinet/in.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr const char* address = "127.0.0.1";
constexpr int threads = 4, keep_alive_s = 2;
constexpr auto between_interrupt_checks = std::chrono::milliseconds(100);

int number_of(const std::string& text, int otherwise) {
  int value = otherwise;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? value : otherwise;
}

/// A datagram socket on a free port of the loopback address; its port goes to `port`.
int open_tick_socket(int& port) {
  const int descriptor = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof at;
  if (descriptor < 0 || ::bind(descriptor, reinterpret_cast<sockaddr*>(&at), sizeof at) != 0 ||
      ::getsockname(descriptor, reinterpret_cast<sockaddr*>(&at), &size) != 0)
    throw std::runtime_error(fmt::format("--live: no datagram socket: {}", std::strerror(errno)));
  port = ntohs(at.sin_port);
  return descriptor;
}

void receive_ticks(int descriptor, LiveState& state) {
  std::array<char, 65536> buffer;
  for (;;) {
    const ssize_t size = ::recv(descriptor, buffer.data(), buffer.size(), 0);
    if (size > 0) state.take_tick(std::string(buffer.data(), static_cast<std::size_t>(size)));
    if (size < 0 && errno != EINTR) return;
  }
}

/// Only this machine's own pages may ask, by the names of this machine: no other site can read along by a name of its
/// own.
bool asked_by_its_name(const httplib::Request& request, int port) {
  const std::string host = request.get_header_value("Host");
  return host == fmt::format("{}:{}", address, port) || host == fmt::format("localhost:{}", port);
}

void answer(httplib::Response& response, const std::string& body, const char* type) {
  response.set_header("Cache-Control", "no-store");
  response.set_content(body, type);
}

void add_handlers(httplib::Server& server, LiveState& state, const std::string& page, const int& port) {
  server.set_pre_routing_handler([&port](const httplib::Request& request, httplib::Response& response) {
    if (asked_by_its_name(request, port)) return httplib::Server::HandlerResponse::Unhandled;
    response.status = 403;
    return httplib::Server::HandlerResponse::Handled;
  });
  server.Get("/", [&page](const httplib::Request&, httplib::Response& response) {
    answer(response, page, "text/html; charset=utf-8");
  });
  server.Get("/report.json", [&state](const httplib::Request& request, httplib::Response& response) {
    state.refresh();
    const std::string json = state.report(number_of(request.get_param_value("revision"), -1));
    if (json.empty()) {
      response.status = 204;
      return;
    }
    answer(response, json, "application/json");
  });
  server.Get("/ticks.json", [&state](const httplib::Request& request, httplib::Response& response) {
    const int from = std::max(0, number_of(request.get_param_value("from"), 0));
    answer(response, state.ticks(request.get_param_value("run"), static_cast<std::size_t>(from)), "application/json");
  });
  server.Get("/trace/(.+)", [&state](const httplib::Request& request, httplib::Response& response) {
    state.refresh();
    const std::string bytes = state.trace(request.matches[1]);
    if (bytes.empty())
      response.status = 404;
    else
      answer(response, bytes, "application/octet-stream");
  });
}

/// The port that was bound, or -1.
int bind_to(httplib::Server& server, int port) {
  // Without SO_REUSEPORT, which would let two programs have one port.
  server.set_socket_options([](socket_t descriptor) {
    const int yes = 1;
    ::setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  if (port > 0) return server.bind_to_port(address, port) ? port : -1;
  return server.bind_to_port(address, usual_live_port) ? usual_live_port : server.bind_to_any_port(address);
}

/// The life of the serving process; its port into `report_to`.
[[noreturn]] void serve(const Campaign& campaign, const std::string& folder, LiveServer::Earlier earlier,
                        int wanted_port, int tick_socket, int report_to, pid_t parent) {
  InterruptGuard::leave_in_child();
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(1);
  std::signal(SIGPIPE, SIG_IGN);
  [[maybe_unused]] const int niceness = ::nice(5);  // what it shows comes first
  try {
    LiveState state(campaign, folder, earlier == LiveServer::Earlier::repeated);
    state.refresh();
    const std::string page = report_page(nlohmann::ordered_json::parse(state.report(-1)), {});
    httplib::Server server;
    server.new_task_queue = [] { return new httplib::ThreadPool(threads); };
    server.set_keep_alive_timeout(keep_alive_s);
    int port = -1;
    add_handlers(server, state, page, port);
    port = bind_to(server, wanted_port);
    if (::write(report_to, &port, sizeof port) != sizeof port || port < 0) ::_exit(1);
    ::close(report_to);
    std::thread(receive_ticks, tick_socket, std::ref(state)).detach();
    server.listen_after_bind();
  } catch (const std::exception&) {
    // The parent reads no port, or the page goes away: the work goes on.
  }
  ::_exit(1);
}

}  // namespace

LiveServer::LiveServer(const Campaign& campaign, const std::string& folder, int port, Earlier earlier) {
  require_uplot();
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error(fmt::format("--live: no pipe: {}", std::strerror(errno)));
  const int tick_socket = open_tick_socket(tick_port_);
  std::fflush(nullptr);
  const pid_t self = ::getpid();
  process_ = ::fork();
  if (process_ == 0) serve(campaign, folder, earlier, port, tick_socket, ends[1], self);
  ::close(ends[1]);
  ::close(tick_socket);
  ssize_t size = -1;
  if (process_ > 0)
    while ((size = ::read(ends[0], &port_, sizeof port_)) < 0 && errno == EINTR) {
    }
  ::close(ends[0]);
  if (size == sizeof port_ && port_ > 0) return;
  if (process_ > 0) ::waitpid(process_, nullptr, 0);
  throw ConfigError(fmt::format("--live-port: {} of {} cannot be had (allowed: a free port)",
                                port > 0 ? port : usual_live_port, address));
}

LiveServer::~LiveServer() {
  ::kill(process_, SIGTERM);
  while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

std::string LiveServer::url() const { return fmt::format("http://{}:{}/", address, port_); }

void LiveServer::stay() const {
  std::fprintf(stderr, "solenoid: the page stays at %s until Ctrl-C\n", url().c_str());
  while (!InterruptGuard::raised()) std::this_thread::sleep_for(between_interrupt_checks);
}

}  // namespace solenoid
