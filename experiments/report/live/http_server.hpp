#pragma once

#include <chrono>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>

struct MHD_Connection;

namespace solenoid {

/// What a page asks for: the path and the query, both decoded.
struct HttpRequest {
  std::string path;
  std::map<std::string, std::string> query;
};

struct HttpAnswer {
  unsigned status = 200;
  const char* type = "text/plain";
  std::shared_ptr<const std::string> body = nullptr;  ///< shared by those who are sent the same
};

/// What callers may cost. Beyond any of it the caller is dropped who has been at it longest, never the newest.
struct HttpBounds {
  std::size_t connections = 64;
  std::size_t head_bytes = 8192;          ///< of a request's head
  std::size_t connection_bytes = 16'384;  ///< of a request, its answer's head included
  std::size_t queued_bytes = 32'000'000;  ///< of answers not yet taken, together
  std::chrono::milliseconds request_time{2000}, answer_time{20'000};
};

/// Serves GET on 127.0.0.1 from one thread, by GNU libmicrohttpd, which waits for nobody: a caller who sends or takes
/// slowly, or nothing at all, holds a descriptor and some kilobytes until its time is over. One answer a connection,
/// always whole: `Range` is ignored. Callers must use this machine's names in `Host`, so that no other site reads along by
/// a name of its own.
class HttpServer {
 public:
  using Handler = std::function<HttpAnswer(const HttpRequest&)>;
  explicit HttpServer(Handler handler, HttpBounds bounds = {});
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// Listens on a port, or on a free one for 0. Returns it, or -1 if it is taken.
  int listen(int port);
  /// Serves until `stop` says so, which is asked several times a second.
  void serve(const std::function<bool()>& stop = [] { return false; });

 private:
  using Clock = std::chrono::steady_clock;
  struct Caller {
    int descriptor;
    Clock::time_point since;
    std::size_t answer = 0;  ///< bytes that it is being sent; 0: it has not asked yet
    bool dropped = false;
    bool sound = true;  ///< what it asked for
  };
  struct Calls;
  bool called_by_its_name(MHD_Connection* connection) const;
  HttpAnswer answer_to(MHD_Connection* connection, const char* path, const std::string& method) const;
  bool answer(MHD_Connection* connection, Caller& caller, HttpAnswer answer);
  void drop(Caller& caller) const;
  void drop_the_overdue();
  void drop_beyond_bounds(const Caller& newest);

  Handler handler_;
  HttpBounds bounds_;
  int listener_ = -1, port_ = 0;
  std::list<Caller> callers_;  // in the order of their coming
};

}  // namespace solenoid
