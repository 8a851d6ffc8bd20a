#include "loopback_server.hpp"

#include <fmt/format.h>

#include <utility>  // before Boost 1.74, which uses std::exchange without it

#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
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

// A connection without a complete request, or whose response is not taken, is closed after this time.
constexpr std::chrono::seconds kPatience{20};
constexpr std::uint64_t kMostBody = 1024;  // of a request [bytes]

std::string random_token() {
  std::random_device source;
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", source());
  return token;
}

// What the connections share; the server outlives them.
struct Site {
  LoopbackServer::Handler handler;
  std::string token;
  std::string host;  // "127.0.0.1:PORT"
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
  Connection(tcp::socket socket, const Site& site) : stream_(std::move(socket)), site_(site) {}

  void read() {
    parser_.emplace();
    parser_->body_limit(kMostBody);
    stream_.expires_after(kPatience);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (!error) self->write();
    });
  }

 private:
  void write() {
    const http::request<http::string_body>& request = parser_->get();
    LoopbackServer::Response made = respond(site_, request);
    response_ = {static_cast<http::status>(made.status), request.version(), std::move(made.body)};
    response_.set(http::field::content_type, made.type);
    response_.set(http::field::cache_control, "no-store");
    response_.set("Referrer-Policy", "no-referrer");
    response_.set("X-Content-Type-Options", "nosniff");
    response_.set(http::field::x_frame_options, "DENY");
    response_.keep_alive(request.keep_alive());
    response_.prepare_payload();
    stream_.expires_after(kPatience);
    http::async_write(stream_, response_, [self = shared_from_this()](beast::error_code error, std::size_t) {
      if (error) return;
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
  const Site& site_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  http::response<http::string_body> response_;
};

}  // namespace

struct LoopbackServer::State {
  explicit State(Handler handler) : site{std::move(handler), random_token(), {}} {
    const tcp::endpoint loopback(asio::ip::address_v4::loopback(), 0);
    acceptor.open(loopback.protocol());
    acceptor.bind(loopback);
    acceptor.listen();
    site.host = fmt::format("127.0.0.1:{}", acceptor.local_endpoint().port());
    address = fmt::format("http://{}/{}/", site.host, site.token);
    accept();
    thread = std::thread([this] { context.run(); });
  }
  ~State() {
    context.stop();
    thread.join();
  }

  void accept() {
    acceptor.async_accept([this](beast::error_code error, tcp::socket socket) {
      if (!error) std::make_shared<Connection>(std::move(socket), site)->read();
      accept();
    });
  }

  Site site;
  std::string address;
  asio::io_context context{1};
  tcp::acceptor acceptor{context};
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
