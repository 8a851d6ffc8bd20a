#include "loopback_server.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>

#include <utility>  // before Boost 1.74, which uses std::exchange without it

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <exception>
#include <optional>
#include <random>
#include <stdexcept>
#include <thread>

namespace grapnel::app {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = boost::beast::http;
using tcp = asio::ip::tcp;

// A connection without a complete request, or whose response is not taken, is closed after these times.
constexpr std::chrono::seconds kReading{20}, kWriting{120};
constexpr int kMostConnections = 32;
constexpr std::chrono::milliseconds kPause{100};  // after a failed accept: there may be no file descriptor left
constexpr std::uint64_t kMostBody = 1024;         // of a request [bytes]

std::string random_token() {
  std::random_device source;
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", source());
  return token;
}

// Programs that this one starts do not inherit the descriptor.
void keep_from_children(int descriptor) { ::fcntl(descriptor, F_SETFD, FD_CLOEXEC); }

// What the connections share; the server outlives them.
struct Site {
  LoopbackServer::Handler handler;
  std::string token;
  std::string host;     // "127.0.0.1:PORT"
  int connections = 0;  // open
};

LoopbackServer::Response respond(const Site& site, const http::request<http::string_body>& request) {
  const std::string_view host(request[http::field::host].data(), request[http::field::host].size());
  if (host != site.host) return {403, "text/plain; charset=utf-8", "wrong host\n"};
  std::string_view target(request.target().data(), request.target().size());
  target = target.substr(0, target.find('?'));
  const std::string root = "/" + site.token + "/";
  if (!target.starts_with(root)) return {404, "text/plain; charset=utf-8", "not found\n"};
  const bool is_post = request.method() == http::verb::post;
  if (!is_post && request.method() != http::verb::get) return {405, "text/plain; charset=utf-8", "GET or POST only\n"};
  try {
    return site.handler({is_post, target.substr(root.size())});
  } catch (const std::exception& error) {
    return {500, "text/plain; charset=utf-8", std::string(error.what()) + "\n"};
  }
}

// One connection: reads a request, writes its response, and so on until the client closes or is silent.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, Site& site) : stream_(std::move(socket)), site_(site) { ++site_.connections; }
  ~Connection() { --site_.connections; }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void read() {
    parser_.emplace();
    parser_->body_limit(kMostBody);
    stream_.expires_after(kReading);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (!error) self->write();
    });
  }

 private:
  void write() {
    const http::request<http::string_body>& request = parser_->get();
    LoopbackServer::Response made = respond(site_, request);
    sent_ = std::move(made.sent);
    response_ = {static_cast<http::status>(made.status), request.version(), std::move(made.body)};
    response_.set(http::field::content_type, made.type);
    response_.set(http::field::cache_control, "no-store");
    response_.set("Referrer-Policy", "no-referrer");
    response_.set("X-Content-Type-Options", "nosniff");
    response_.set(http::field::x_frame_options, "DENY");
    response_.keep_alive(request.keep_alive());
    response_.prepare_payload();
    stream_.expires_after(kWriting);
    http::async_write(stream_, response_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (error) return;
      if (self->sent_) self->sent_();
      if (self->response_.need_eof())
        self->close();
      else
        self->read();
    });
  }
  void close() {
    beast::error_code ignored;
    stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
  }

  beast::tcp_stream stream_;
  Site& site_;
  std::function<void()> sent_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  http::response<http::string_body> response_;
};

}  // namespace

struct LoopbackServer::State {
  explicit State(Handler handler) : site{std::move(handler), random_token(), {}, 0} {
    const tcp::endpoint loopback(asio::ip::address_v4::loopback(), 0);
    acceptor.open(loopback.protocol());
    keep_from_children(acceptor.native_handle());
    acceptor.bind(loopback);
    acceptor.listen();
    site.host = fmt::format("127.0.0.1:{}", acceptor.local_endpoint().port());
    address = fmt::format("http://{}/{}/", site.host, site.token);
    accept();
    thread = std::thread([this] { serve(); });
  }
  ~State() {
    context.stop();
    thread.join();
  }

  void accept() {
    acceptor.async_accept([this](beast::error_code error, tcp::socket socket) {
      if (error) return pause();
      accept();  // first: what follows may throw
      keep_from_children(socket.native_handle());
      if (site.connections < kMostConnections) std::make_shared<Connection>(std::move(socket), site)->read();
    });
  }
  void pause() {
    timer.expires_after(kPause);
    timer.async_wait([this](beast::error_code) { accept(); });
  }
  // Signals are for other threads. An exception, as for lack of memory, ends a connection, but not the work.
  void serve() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, nullptr);
    while (!context.stopped()) {
      try {
        context.run();
      } catch (const std::exception&) {  // that connection is closed
      }
    }
  }

  Site site;
  std::string address;
  asio::io_context context{1};
  tcp::acceptor acceptor{context};
  asio::steady_timer timer{context};
  std::thread thread;
};

LoopbackServer::LoopbackServer(Handler handler) {
  try {
    state_ = std::make_unique<State>(std::move(handler));
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error(std::string("no port of 127.0.0.1 can be opened: ") + error.code().message());
  }
}

LoopbackServer::~LoopbackServer() = default;

const std::string& LoopbackServer::address() const { return state_->address; }

}  // namespace grapnel::app
