#pragma once

/// @file
/// A small HTTP server for pages of this machine's user.

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace grapnel::app {

/// Serves HTTP/1.1 on the loopback interface only, at a free port, below a path with a random token of 128 bits.
/// Requests without this token get 404, and those that name another host 403: pages of other sites can neither read nor
/// send. One thread serves all connections, at most 32; none of them waits for another.
class LoopbackServer {
 public:
  struct Request {
    bool is_post = false;
    std::string_view path;  // below the token, "state"
  };
  struct Response {
    int status = 200;
    std::string type = "text/plain; charset=utf-8";
    std::string body = {};
    std::function<void()> sent = {};  // called once the client has all of it
  };
  /// Called in the server's thread. An exception becomes status 500.
  using Handler = std::function<Response(const Request&)>;

  /// @throws std::runtime_error if no port can be opened.
  explicit LoopbackServer(Handler handler);
  ~LoopbackServer();
  LoopbackServer(const LoopbackServer&) = delete;
  LoopbackServer& operator=(const LoopbackServer&) = delete;

  /// "http://127.0.0.1:PORT/TOKEN/"
  const std::string& address() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace grapnel::app
