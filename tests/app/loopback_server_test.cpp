// The server of live pages: only this machine, only with the token, and no connection that delays another.
#include "loopback_server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "http_client.hpp"

namespace grapnel::app {
namespace loopback_server_test {

using test::HttpReply;
using test::request;
using testing::HasSubstr;
using testing::MatchesRegex;

LoopbackServer::Response echo(const LoopbackServer::Request& request) {
  if (request.path == "fault") throw std::runtime_error("no such state");
  return {200, "application/json", std::string(request.is_post ? "POST " : "GET ") + std::string(request.path)};
}

int port_of(const std::string& address) { return std::stoi(address.substr(std::string("http://127.0.0.1:").size())); }

TEST(LoopbackServer, AnswersBelowItsToken) {
  const LoopbackServer server(echo), other(echo);
  EXPECT_THAT(server.address(), MatchesRegex("http://127\\.0\\.0\\.1:[0-9]+/[0-9a-f]{32}/"));
  const HttpReply reply = request("GET", server.address() + "state?now");
  EXPECT_EQ(reply.status, 200);
  EXPECT_EQ(reply.body, "GET state");
  EXPECT_THAT(reply.head, HasSubstr("Content-Type: application/json"));
  EXPECT_THAT(reply.head, HasSubstr("Cache-Control: no-store"));
  EXPECT_EQ(request("POST", server.address() + "stop").body, "POST stop");
  EXPECT_EQ(request("GET", server.address()).body, "GET ");
  EXPECT_NE(server.address().substr(server.address().size() - 33), other.address().substr(other.address().size() - 33));
}

TEST(LoopbackServer, RefusesOtherPathsHostsAndMethods) {
  const LoopbackServer server(echo);
  const std::string site = server.address().substr(0, server.address().find('/', 7) + 1);
  EXPECT_EQ(request("GET", site).status, 404);
  EXPECT_EQ(request("GET", site + std::string(32, '0') + "/state").status, 404);
  EXPECT_EQ(request("POST", site + "stop").status, 404);
  EXPECT_EQ(request("GET", server.address() + "state", "example.org").status, 403);
  EXPECT_EQ(request("DELETE", server.address() + "state").status, 405);
  const HttpReply fault = request("GET", server.address() + "fault");
  EXPECT_EQ(fault.status, 500);
  EXPECT_EQ(fault.body, "no such state\n");
}

TEST(LoopbackServer, SurvivesBadAndSilentClients) {
  const LoopbackServer server(echo);
  const int port = port_of(server.address());
  const int silent = test::connected(port);
  ASSERT_GE(silent, 0);
  test::reply_to(port, "GET\r\n\r\n");
  test::reply_to(port, std::string(100'000, 'x'));
  test::reply_to(port, "POST / HTTP/1.1\r\nHost: a\r\nContent-Length: 99999999\r\n\r\n");
  EXPECT_EQ(request("GET", server.address() + "state").status, 200);
  close(silent);
}

}  // namespace loopback_server_test
}  // namespace grapnel::app
