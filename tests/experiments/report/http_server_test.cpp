#include "experiments/report/live/http_server.hpp"

#include <atomic>
#include <cstring>
#include <fstream>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace solenoid {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

/// A server in a thread, which answers with what it was asked for, or with something large.
class Served {
 public:
  explicit Served(HttpBounds bounds = {}) : server_(answer_to, bounds), port_(server_.listen(0)) {
    thread_ = std::thread([this] { server_.serve([this] { return stop_.load(); }); });
  }
  ~Served() {
    stop_ = true;
    thread_.join();
  }
  int port() const { return port_; }
  std::string host() const { return "127.0.0.1:" + std::to_string(port_); }

 private:
  static HttpAnswer answer_to(const HttpRequest& request) {
    static const auto large = std::make_shared<const std::string>(std::string(3'000'000, 'x'));
    if (request.path == "/large") return {200, "text/plain", large};
    if (request.path == "/wrong") throw std::runtime_error("wrong");
    std::string text = request.path;
    for (const auto& [key, value] : request.query) text.append("|").append(key).append("=").append(value);
    return {200, "text/plain", std::make_shared<const std::string>(text)};
  }

  HttpServer server_;
  int port_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

class Caller {
 public:
  explicit Caller(const Served& served) : descriptor_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_port = htons(static_cast<std::uint16_t>(served.port()));
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const timeval patience{20, 0};
    ::setsockopt(descriptor_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    connected_ = ::connect(descriptor_, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
  }
  ~Caller() { ::close(descriptor_); }
  Caller(const Caller&) = delete;
  Caller& operator=(const Caller&) = delete;

  bool connected() const { return connected_; }
  bool say(const std::string& text) const {
    return ::send(descriptor_, text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
  }
  /// All that comes until the other side ends.
  std::string hear() const {
    std::string all;
    char buffer[65536];
    for (ssize_t n = 0; (n = ::recv(descriptor_, buffer, sizeof buffer, 0)) > 0;)
      all.append(buffer, static_cast<std::size_t>(n));
    return all;
  }

 private:
  int descriptor_;
  bool connected_ = false;
};

std::string asked(const Served& served, const std::string& target, const std::string& headers = "",
                  const std::string& host = "") {
  const Caller caller(served);
  caller.say("GET " + target + " HTTP/1.1\r\nHost: " + (host.empty() ? served.host() : host) + "\r\n" + headers +
             "\r\n");
  return caller.hear();
}

long resident_kilobytes() {
  long pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return resident * (::sysconf(_SC_PAGESIZE) / 1024);
}

TEST(HttpServer, AnswersWhatIsAskedFor) {
  const Served served;
  EXPECT_THAT(asked(served, "/a%20b?run=x%26y&from=3&empty"), EndsWith("\r\n\r\n/a b|empty=|from=3|run=x&y"));
  EXPECT_THAT(asked(served, "/"), StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_EQ(asked(served, "/large").size() % 1'000'000, asked(served, "/large").find("\r\n\r\n") + 4);
  EXPECT_THAT(asked(served, "/wrong"), StartsWith("HTTP/1.1 500"));
}

TEST(HttpServer, TakesARequestInPieces) {
  const Served served;
  const Caller caller(served);
  for (const std::string& piece :
       {std::string("GET /a HT"), std::string("TP/1.1\r\nHo"), "st: " + served.host() + "\r\n\r", std::string("\n")}) {
    caller.say(piece);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_THAT(caller.hear(), EndsWith("/a"));
}

TEST(HttpServer, OnlyThisMachinesNamesAreAnswered) {
  const Served served;
  const std::string port = ":" + std::to_string(served.port());
  EXPECT_THAT(asked(served, "/", "", "localhost" + port), StartsWith("HTTP/1.1 200"));
  for (const std::string& host : {std::string("evil.example"), "evil.example" + port, std::string("127.0.0.1"),
                                  "127.0.0.1" + port + "1", "127.0.0.1" + port + "\r\nHost: evil.example"})
    EXPECT_THAT(asked(served, "/", "", host), StartsWith("HTTP/1.1 403")) << host;
  const Caller nameless(served);
  nameless.say("GET / HTTP/1.0\r\n\r\n");
  EXPECT_THAT(nameless.hear(), StartsWith("HTTP/1.1 403"));
}

TEST(HttpServer, WhatIsNoRequestIsRefused) {
  const Served served;
  const std::string host = "\r\nHost: " + served.host() + "\r\n\r\n";
  for (const char* line : {"POST / HTTP/1.1", "HEAD / HTTP/1.1", "DELETE / HTTP/1.1"}) {
    const Caller caller(served);
    caller.say(line + host);
    EXPECT_THAT(caller.hear(), StartsWith("HTTP/1.1 405")) << line;
  }
  for (const char* line : {"", "GET /", "GET  HTTP/1.1", "GET / FTP/1.1", "GET a HTTP/1.1", "GET /%zz HTTP/1.1",
                           "GET /%00 HTTP/1.1", "GET /%2 HTTP/1.1", "GET /?a=%0d%0a HTTP/1.1"}) {
    const Caller caller(served);
    caller.say(line + host);
    EXPECT_THAT(caller.hear(), StartsWith("HTTP/1.1 400")) << line;
  }
  const Caller without_target(served);
  without_target.say("GET" + host);
  EXPECT_EQ(without_target.hear(), "");  // libmicrohttpd closes without a word
  EXPECT_THAT(asked(served, "/" + std::string(10'000, 'a')), StartsWith("HTTP/1.1 431"));
  EXPECT_THAT(asked(served, "/", "X: " + std::string(10'000, 'a') + "\r\n"), StartsWith("HTTP/1.1 431"));
}

TEST(HttpServer, ADecodedPathIsAWordToItsHandlerAndNoMore) {
  const Served served;
  EXPECT_THAT(asked(served, "/trace/..%2f..%2fetc/passwd"), EndsWith("/trace/../../etc/passwd"));
}

TEST(HttpServer, RangesAreIgnored) {
  const Served served;
  std::string ranges = "Range: bytes=0-";
  for (int i = 0; ranges.size() < 8000; ++i) ranges += ",0-";
  const long before = resident_kilobytes();
  for (int i = 0; i < 4; ++i) {
    const std::string answer = asked(served, "/large", ranges + "\r\n");
    EXPECT_THAT(answer.substr(0, 100), StartsWith("HTTP/1.1 200"));
    EXPECT_LT(answer.size(), 3'001'000u);
  }
  EXPECT_LT(resident_kilobytes() - before, 50'000);
}

TEST(HttpServer, IdleAndSlowCallersKeepNobodyOut) {
  const Served served;
  std::vector<std::unique_ptr<Caller>> callers;
  callers.reserve(200);
  for (int i = 0; i < 200; ++i) {
    callers.push_back(std::make_unique<Caller>(served));
    ASSERT_TRUE(callers.back()->connected()) << i;
    if (i % 2) callers.back()->say("GET / HT");
    if (i % 20 == 19) {
      EXPECT_THAT(asked(served, "/a"), EndsWith("/a")) << i;
    }
  }
  for (int round = 0; round < 10; ++round) {
    for (const auto& caller : callers) caller->say("x");
    EXPECT_THAT(asked(served, "/a"), EndsWith("/a"));
  }
}

TEST(HttpServer, ASlowCallerIsDroppedWhenItsTimeIsOver) {
  const Served served({.request_time = std::chrono::milliseconds(200)});
  const Caller slow(served);
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 100 && slow.say("x"); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(slow.hear(), "");
  EXPECT_GT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(190));
}

TEST(HttpServer, WhoDoesNotTakeAnswersHoldsABoundedPart) {
  const Served served({.queued_bytes = 10'000'000});
  std::vector<std::unique_ptr<Caller>> callers;
  callers.reserve(50);
  for (int i = 0; i < 50; ++i) {
    callers.push_back(std::make_unique<Caller>(served));
    callers.back()->say("GET /large HTTP/1.1\r\nHost: " + served.host() + "\r\n\r\n");
  }
  EXPECT_THAT(asked(served, "/a"), EndsWith("/a"));
  EXPECT_EQ(asked(served, "/large").size(), asked(served, "/large").find("\r\n\r\n") + 4 + 3'000'000);
}

}  // namespace
}  // namespace solenoid
