#include "experiments/report/live/http_server.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <optional>
#include <vector>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace solenoid {
namespace {

constexpr int look_ms = 100;  // between two looks at the clock

const char* reason_of(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 204:
      return "No Content";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 431:
      return "Request Header Fields Too Large";
    case 500:
      return "Internal Server Error";
    default:
      return "Bad Request";
  }
}

int hex_digit(char c) {
  return c >= '0' && c <= '9'   ? c - '0'
         : c >= 'a' && c <= 'f' ? c - 'a' + 10
         : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                : -1;
}

/// Percent-decoded; nothing for what is not, or for a control character.
std::optional<std::string> decoded(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    char c = text[i];
    if (c == '%') {
      const int high = i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
      const int low = high < 0 ? -1 : hex_digit(text[i + 2]);
      if (low < 0) return std::nullopt;
      c = static_cast<char>(16 * high + low);
      i += 2;
    }
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) return std::nullopt;
    plain += c;
  }
  return plain;
}

std::optional<HttpRequest> request_of(std::string_view target) {
  if (!target.starts_with('/')) return std::nullopt;
  const std::size_t question = target.find('?');
  const auto path = decoded(target.substr(0, question));
  if (!path) return std::nullopt;
  HttpRequest request{*path, {}};
  std::string_view rest = question == std::string_view::npos ? std::string_view() : target.substr(question + 1);
  while (!rest.empty()) {
    const std::string_view pair = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(rest.size(), pair.size() + 1));
    const std::size_t equals = std::min(pair.size(), pair.find('='));
    const auto key = decoded(pair.substr(0, equals));
    const auto value = decoded(pair.substr(std::min(pair.size(), equals + 1)));
    if (!key || !value) return std::nullopt;
    request.query[*key] = *value;
  }
  return request;
}

std::string_view without_spaces(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

bool same_name(std::string_view a, std::string_view b) {
  return std::ranges::equal(
      a, b, {}, [](unsigned char c) { return std::tolower(c); }, [](unsigned char c) { return std::tolower(c); });
}

/// The values of a header, whose lines follow the first.
std::vector<std::string_view> header(std::string_view head, std::string_view name) {
  std::vector<std::string_view> values;
  for (std::size_t at = head.find("\r\n"); at != std::string_view::npos; at = head.find("\r\n", at + 2)) {
    const std::string_view rest = head.substr(at + 2), line = rest.substr(0, rest.find("\r\n"));
    const std::size_t colon = line.find(':');
    if (colon != std::string_view::npos && same_name(line.substr(0, colon), name))
      values.push_back(without_spaces(line.substr(colon + 1)));
  }
  return values;
}

}  // namespace

struct HttpServer::Connection {
  enum class State { reads, answers, ends };  ///< ends: all is sent, the caller has not yet hung up
  int descriptor;
  Clock::time_point until;
  State state = State::reads;
  std::string in = {}, head = {};  ///< the request; the answer's head
  std::shared_ptr<const std::string> body = nullptr;
  std::size_t sent = 0;
  short events = 0;

  Connection(int socket, Clock::time_point deadline) : descriptor(socket), until(deadline) {}
  ~Connection() { ::close(descriptor); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  std::size_t size() const { return head.size() + (body ? body->size() : 0); }
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
  std::vector<pollfd> waiting;
  while (!stop()) {
    waiting.assign(1, {listener_, POLLIN, 0});
    for (const Connection& caller : callers_)
      waiting.push_back(
          {caller.descriptor, caller.state == Connection::State::answers ? short{POLLOUT} : short{POLLIN}, 0});
    if (::poll(waiting.data(), waiting.size(), look_ms) < 0 && errno != EINTR) return;
    std::size_t i = 1;
    for (Connection& caller : callers_) caller.events = waiting[i++].revents;
    const auto now = Clock::now();
    callers_.remove_if([&](Connection& caller) { return now > caller.until || (caller.events && !go_on(caller)); });
    if (waiting.front().revents) accept_callers();
  }
}

void HttpServer::accept_callers() {
  for (;;) {
    const int descriptor = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (descriptor < 0 && (errno == EMFILE || errno == ENFILE) && !callers_.empty()) {
      drop_longest();
      continue;
    }
    if (descriptor < 0) return;
    if (callers_.size() >= bounds_.connections) drop_longest();
    Connection& caller = callers_.emplace_back(descriptor, Clock::now() + bounds_.request_time);
    if (!read_request(caller)) callers_.pop_back();  // which has mostly been sent with the call
  }
}

/// Those that have asked for nothing yet go before those that are being answered.
void HttpServer::drop_longest() {
  const auto idle = std::ranges::find(callers_, Connection::State::reads, &Connection::state);
  callers_.erase(idle != callers_.end() ? idle : callers_.begin());
}

/// False: it is over with this caller.
bool HttpServer::go_on(Connection& caller) {
  if (caller.state == Connection::State::answers) return send_answer(caller);
  if (caller.state == Connection::State::reads) return read_request(caller);
  char ignored[4096];
  const ssize_t n = ::recv(caller.descriptor, ignored, sizeof ignored, 0);
  return n > 0 || (n < 0 && (errno == EAGAIN || errno == EINTR));
}

bool HttpServer::read_request(Connection& caller) {
  for (;;) {
    char buffer[4096];
    const ssize_t n = ::recv(caller.descriptor, buffer, sizeof buffer, 0);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno == EAGAIN;
    if (n == 0) return false;
    caller.in.append(buffer, static_cast<std::size_t>(n));
    if (caller.in.size() > bounds_.head_bytes || caller.in.find("\r\n\r\n") != std::string::npos) break;
  }
  answer(caller);
  return send_answer(caller);
}

void HttpServer::answer(Connection& caller) {
  const std::size_t end = caller.in.find("\r\n\r\n");
  const bool whole = end != std::string::npos && end <= bounds_.head_bytes;
  HttpAnswer answer = whole ? answer_to(std::string_view(caller.in).substr(0, end)) : HttpAnswer{431};
  caller.in = {};
  caller.head = fmt::format("HTTP/1.1 {} {}\r\nConnection: close\r\nCache-Control: no-store\r\n", answer.status,
                            reason_of(answer.status));
  if (answer.status != 204)
    caller.head +=
        fmt::format("Content-Type: {}\r\nContent-Length: {}\r\n", answer.type, answer.body ? answer.body->size() : 0);
  caller.head += "\r\n";
  caller.body = std::move(answer.body);
  caller.state = Connection::State::answers;
  caller.until = Clock::now() + bounds_.answer_time;
  // Callers who do not take their answers go, the longest there first; the newest stays whatever it was answered.
  for (auto other = callers_.begin(); other != callers_.end() && queued() > bounds_.queued_bytes; ++other)
    if (&*other != &caller && other->body) {
      other->body = nullptr;
      other->until = {};
    }
}

HttpAnswer HttpServer::answer_to(std::string_view head) const {
  const std::string_view line = head.substr(0, head.find("\r\n"));
  const std::size_t first = line.find(' '), last = line.rfind(' ');
  if (first == std::string_view::npos || first == last || !line.substr(last + 1).starts_with("HTTP/1."))
    return HttpAnswer{400};
  if (!called_by_its_name(head)) return HttpAnswer{403};
  if (line.substr(0, first) != "GET") return HttpAnswer{405};
  const auto request = request_of(line.substr(first + 1, last - first - 1));
  if (!request) return HttpAnswer{400};
  try {
    return handler_(*request);
  } catch (const std::exception&) {
    return HttpAnswer{500};
  }
}

bool HttpServer::called_by_its_name(std::string_view head) const {
  const std::vector<std::string_view> hosts = header(head, "Host");
  return hosts.size() == 1 && (same_name(hosts.front(), fmt::format("127.0.0.1:{}", port_)) ||
                               same_name(hosts.front(), fmt::format("localhost:{}", port_)));
}

std::size_t HttpServer::queued() const {
  std::size_t bytes = 0;
  for (const Connection& caller : callers_) bytes += caller.body ? caller.body->size() : 0;
  return bytes;
}

bool HttpServer::send_answer(Connection& caller) {
  while (caller.sent < caller.size()) {
    const bool in_head = caller.sent < caller.head.size();
    const std::string& from = in_head ? caller.head : *caller.body;
    const std::size_t at = in_head ? caller.sent : caller.sent - caller.head.size();
    const ssize_t n = ::send(caller.descriptor, from.data() + at, from.size() - at, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno == EAGAIN;
    caller.sent += static_cast<std::size_t>(n);
  }
  ::shutdown(caller.descriptor, SHUT_WR);
  caller.body = nullptr;
  caller.head = {};
  caller.sent = 0;
  caller.state = Connection::State::ends;
  caller.until = Clock::now() + bounds_.request_time;
  return true;
}

}  // namespace solenoid
