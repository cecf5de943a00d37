#include "experiments/report/live/live_server.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/interrupt.hpp"
#include "experiments/report/live/http_server.hpp"
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

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr const char* address = "127.0.0.1";
constexpr auto between_interrupt_checks = std::chrono::milliseconds(100);

int number_of(const std::string& text, int otherwise) {
  int value = otherwise;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? value : otherwise;
}

/// Each message is a tick, until the sender is gone.
void receive_ticks(int descriptor, LiveState& state) {
  std::array<char, 65536> buffer;
  for (;;) {
    const ssize_t size = ::recv(descriptor, buffer.data(), buffer.size(), 0);
    if (size > 0) state.take_tick(std::string(buffer.data(), static_cast<std::size_t>(size)));
    if (size == 0 || (size < 0 && errno != EINTR)) return;
  }
}

HttpAnswer json_answer(std::string json) {
  return {200, "application/json", std::make_shared<const std::string>(std::move(json))};
}

std::string value_of(const HttpRequest& request, const char* key) {
  const auto found = request.query.find(key);
  return found == request.query.end() ? std::string() : found->second;
}

HttpAnswer report_answer(LiveState& state, const HttpRequest& request) {
  state.refresh();
  std::string json = state.report(number_of(value_of(request, "revision"), -1));
  return json.empty() ? HttpAnswer{204} : json_answer(std::move(json));
}

HttpAnswer trace_answer(LiveState& state, const std::string& id) {
  state.refresh();
  std::string bytes = state.trace(id);  // one of those it knows: nothing else of a path reaches the disk
  if (bytes.empty()) return HttpAnswer{404};
  return {200, "application/octet-stream", std::make_shared<const std::string>(std::move(bytes))};
}

/// What there is to ask for.
HttpServer::Handler pages_of(LiveState& state, std::string text) {
  constexpr std::string_view trace = "/trace/";
  return [&state, page = std::make_shared<const std::string>(std::move(text)), trace](const HttpRequest& request) {
    if (request.path == "/") return HttpAnswer{200, "text/html; charset=utf-8", page};
    if (request.path == "/report.json") return report_answer(state, request);
    if (request.path == "/ticks.json") {
      const int from = std::max(0, number_of(value_of(request, "from"), 0));
      return json_answer(state.ticks(value_of(request, "run"), static_cast<std::size_t>(from)));
    }
    if (request.path.starts_with(trace)) return trace_answer(state, request.path.substr(trace.size()));
    return HttpAnswer{404};
  };
}

/// The port that was bound, or -1.
int listen_on(HttpServer& server, int port) {
  if (port > 0) return server.listen(port);
  const int usual = server.listen(usual_live_port);
  return usual > 0 ? usual : server.listen(0);
}

/// The life of the serving process; its port into `report_to`.
[[noreturn]] void serve(const Campaign& campaign, const std::string& folder, LiveServer::Earlier earlier,
                        int wanted_port, int tick_socket, int report_to, pid_t parent) {
  InterruptGuard::leave_in_child();
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(1);
  for (const int signal : {SIGPIPE, SIGTSTP, SIGTTIN, SIGTTOU}) std::signal(signal, SIG_IGN);  // Ctrl-Z stops no page
  [[maybe_unused]] const int niceness = ::nice(5);  // what it shows comes first
  try {
    LiveState state(campaign, folder, earlier == LiveServer::Earlier::repeated);
    state.refresh();
    const std::string page = report_page(nlohmann::ordered_json::parse(state.report(-1)), {});
    HttpServer server(pages_of(state, page));
    const int port = listen_on(server, wanted_port);
    if (::write(report_to, &port, sizeof port) != sizeof port || port < 0) ::_exit(1);
    ::close(report_to);
    std::thread(receive_ticks, tick_socket, std::ref(state)).detach();
    server.serve();
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
  int ticks[2];  // a pair that nobody else can send to
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ticks) != 0)
    throw std::runtime_error(fmt::format("--live: no socket: {}", std::strerror(errno)));
  tick_socket_ = ticks[0];
  std::fflush(nullptr);
  const pid_t self = ::getpid();
  process_ = ::fork();
  if (process_ == 0) {
    ::close(ticks[0]);
    serve(campaign, folder, earlier, port, ticks[1], ends[1], self);
  }
  ::close(ends[1]);
  ::close(ticks[1]);
  ssize_t size = -1;
  if (process_ > 0)
    while ((size = ::read(ends[0], &port_, sizeof port_)) < 0 && errno == EINTR) {
    }
  ::close(ends[0]);
  if (size == sizeof port_ && port_ > 0) return;
  if (process_ > 0) ::waitpid(process_, nullptr, 0);
  ::close(tick_socket_);
  throw ConfigError(fmt::format("--live-port: {} of {} cannot be had (allowed: a free port)",
                                port > 0 ? port : usual_live_port, address));
}

LiveServer::~LiveServer() {
  ::close(tick_socket_);
  ::kill(process_, SIGKILL);  // it keeps nothing, and may have been stopped
  while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

std::string LiveServer::url() const { return fmt::format("http://{}:{}/", address, port_); }

void LiveServer::stay() const {
  std::fprintf(stderr, "solenoid: the page stays at %s until Ctrl-C\n", url().c_str());
  while (!InterruptGuard::raised()) std::this_thread::sleep_for(between_interrupt_checks);
}

}  // namespace solenoid
