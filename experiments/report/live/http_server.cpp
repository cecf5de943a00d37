#include "experiments/report/live/http_server.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr int look_ms = 100;                // between two looks at the clock
constexpr unsigned dropped_meanwhile = 64;  // connections that are dropped, and not yet closed

bool is_text(std::string_view text) {
  return std::ranges::none_of(text, [](unsigned char c) { return c < 0x20 || c == 0x7f; });
}

/// Whether each '%' begins an escape, and none stands for a control character: the library keeps the one and cuts at the
/// other.
bool is_escaped_well(std::string_view text) {
  for (std::size_t at = text.find('%'); at != std::string_view::npos; at = text.find('%', at + 1)) {
    const std::string_view digits = text.substr(at + 1, 2);
    if (digits.size() < 2 || !std::ranges::all_of(digits, [](unsigned char c) { return std::isxdigit(c) != 0; }))
      return false;
    if (digits[0] < '2' || digits == "7f" || digits == "7F") return false;
  }
  return true;
}

}  // namespace

/// What the library calls back.
struct HttpServer::Calls {
  static void connection(void* self, MHD_Connection* connection, void** context, MHD_ConnectionNotificationCode code) {
    auto& server = *static_cast<HttpServer*>(self);
    if (code == MHD_CONNECTION_NOTIFY_CLOSED) {
      server.callers_.remove_if([&](const Caller& caller) { return &caller == *context; });
      return;
    }
    const auto* about = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
    *context = &server.callers_.emplace_back(Caller{about->connect_fd, Clock::now()});
    server.drop_beyond_bounds(server.callers_.back());
  }

  static void* target(void* /*self*/, const char* raw, MHD_Connection* connection) {
    of(connection).sound = is_escaped_well(raw);
    return nullptr;
  }

  static Caller& of(MHD_Connection* connection) {
    const auto* about = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    return *static_cast<Caller*>(about->socket_context);
  }

  static MHD_Result request(void* self, MHD_Connection* connection, const char* path, const char* method,
                            const char* /*version*/, const char* /*upload*/, std::size_t* /*upload_size*/,
                            void** /*context*/) {
    auto& server = *static_cast<HttpServer*>(self);
    return server.answer(connection, of(connection), server.answer_to(connection, path, method)) ? MHD_YES : MHD_NO;
  }

  static MHD_Result take_pair(void* request, MHD_ValueKind /*kind*/, const char* key, const char* value) {
    static_cast<HttpRequest*>(request)->query[key] = value == nullptr ? "" : value;
    return MHD_YES;
  }

  static MHD_Result take_host(void* hosts, MHD_ValueKind /*kind*/, const char* key, const char* value) {
    std::string name = key;
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
    if (name == "host") static_cast<std::list<std::string>*>(hosts)->emplace_back(value == nullptr ? "" : value);
    return MHD_YES;
  }

  static void done_with(void* body) { delete static_cast<std::shared_ptr<const std::string>*>(body); }
};

HttpServer::HttpServer(Handler handler, HttpBounds bounds) : handler_(std::move(handler)), bounds_(bounds) {}

HttpServer::~HttpServer() {
  if (listener_ >= 0) ::close(listener_);
}

int HttpServer::listen(int port) {
  const int descriptor = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (descriptor < 0) return -1;
  const int yes = 1;  // not SO_REUSEPORT, which would let two programs have one port
  ::setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(static_cast<std::uint16_t>(port));
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof at;
  if (::bind(descriptor, reinterpret_cast<sockaddr*>(&at), sizeof at) != 0 || ::listen(descriptor, SOMAXCONN) != 0 ||
      ::getsockname(descriptor, reinterpret_cast<sockaddr*>(&at), &size) != 0) {
    ::close(descriptor);
    return -1;
  }
  listener_ = descriptor;
  port_ = ntohs(at.sin_port);
  return port_;
}

void HttpServer::serve(const std::function<bool()>& stop) {
  MHD_Daemon* const daemon = MHD_start_daemon(
      MHD_USE_EPOLL, 0, nullptr, nullptr, Calls::request, this, MHD_OPTION_LISTEN_SOCKET, listener_,
      MHD_OPTION_CONNECTION_LIMIT, static_cast<unsigned>(bounds_.connections) + dropped_meanwhile,
      MHD_OPTION_CONNECTION_MEMORY_LIMIT, bounds_.connection_bytes, MHD_OPTION_NOTIFY_CONNECTION, Calls::connection,
      this, MHD_OPTION_URI_LOG_CALLBACK, Calls::target, this, MHD_OPTION_STRICT_FOR_CLIENT, 1, MHD_OPTION_END);
  if (daemon == nullptr) return;
  listener_ = -1;  // the library's
  while (!stop()) {
    MHD_run_wait(daemon, look_ms);
    drop_the_overdue();
  }
  MHD_stop_daemon(daemon);
}

HttpAnswer HttpServer::answer_to(MHD_Connection* connection, const char* path, const std::string& method) const {
  const auto* head = MHD_get_connection_info(connection, MHD_CONNECTION_INFO_REQUEST_HEADER_SIZE);
  if (head == nullptr || head->header_size > bounds_.head_bytes) return {431};
  if (!called_by_its_name(connection)) return {403};
  if (method != "GET") return {405};
  HttpRequest request{path, {}};
  MHD_get_connection_values(connection, MHD_GET_ARGUMENT_KIND, Calls::take_pair, &request);
  bool sound = Calls::of(connection).sound && request.path.starts_with('/') && is_text(request.path);
  for (const auto& [key, value] : request.query) sound = sound && is_text(key) && is_text(value);
  if (!sound) return {400};
  try {
    return handler_(request);
  } catch (const std::exception&) {
    return {500};
  }
}

bool HttpServer::called_by_its_name(MHD_Connection* connection) const {
  std::list<std::string> hosts;
  MHD_get_connection_values(connection, MHD_HEADER_KIND, Calls::take_host, &hosts);
  if (hosts.size() != 1) return false;
  std::string& host = hosts.front();
  std::ranges::transform(host, host.begin(), [](unsigned char c) { return std::tolower(c); });
  return host == fmt::format("127.0.0.1:{}", port_) || host == fmt::format("localhost:{}", port_);
}

bool HttpServer::answer(MHD_Connection* connection, Caller& caller, HttpAnswer answer) {
  auto body = std::make_unique<std::shared_ptr<const std::string>>(answer.body ? std::move(answer.body)
                                                                               : std::make_shared<const std::string>());
  const std::string& text = **body;
  MHD_Response* const response = MHD_create_response_from_buffer_with_free_callback_cls(
      text.size(), const_cast<char*>(text.data()), Calls::done_with, body.get());
  if (response == nullptr) return false;
  caller.answer = text.size() + 1;
  caller.since = Clock::now();
  static_cast<void>(body.release());  // the response's
  MHD_add_response_header(response, MHD_HTTP_HEADER_CONNECTION, "close");
  MHD_add_response_header(response, MHD_HTTP_HEADER_CACHE_CONTROL, "no-store");
  if (answer.status != MHD_HTTP_NO_CONTENT)
    MHD_add_response_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, answer.type);
  const bool queued = MHD_queue_response(connection, answer.status, response) == MHD_YES;
  MHD_destroy_response(response);
  drop_beyond_bounds(caller);
  return queued;
}

void HttpServer::drop(Caller& caller) const {
  caller.dropped = true;
  ::shutdown(caller.descriptor, SHUT_RDWR);  // the library finds it ended, and closes it
}

void HttpServer::drop_the_overdue() {
  const auto now = Clock::now();
  for (Caller& caller : callers_)
    if (!caller.dropped && now - caller.since > (caller.answer == 0 ? bounds_.request_time : bounds_.answer_time))
      drop(caller);
}

/// Of too many connections those that have asked for nothing yet go first; of too many bytes those that do not take them.
void HttpServer::drop_beyond_bounds(const Caller& newest) {
  std::size_t connections = 0, bytes = 0;
  for (const Caller& caller : callers_) {
    if (caller.dropped) continue;
    ++connections;
    bytes += caller.answer;
  }
  const auto drop_while = [&](const auto& too_much, const auto& may_go) {
    for (Caller& caller : callers_) {
      if (!too_much()) return;
      if (caller.dropped || &caller == &newest || !may_go(caller)) continue;
      --connections;
      bytes -= caller.answer;
      drop(caller);
    }
  };
  const auto too_many = [&] { return connections > bounds_.connections; };
  drop_while(too_many, [](const Caller& caller) { return caller.answer == 0; });
  drop_while(too_many, [](const Caller&) { return true; });
  drop_while([&] { return bytes > bounds_.queued_bytes; }, [](const Caller& caller) { return caller.answer > 0; });
}

}  // namespace solenoid
