#pragma once

/// @file
/// A minimal HTTP client, for tests of the live page.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <string>

namespace grapnel::test {

struct HttpReply {
  int status = 0;  // 0: no connection, or no reply within 10 s
  std::string head, body;
};

/// A connection to a port of 127.0.0.1; -1 if there is none.
inline int connected(int port) {
  const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
  const timeval patience{10, 0};
  setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return socket;
  close(socket);
  return -1;
}

/// The reply to these bytes, until the server closes.
inline HttpReply reply_to(int port, const std::string& bytes) {
  const int socket = connected(port);
  if (socket < 0) return {};
  (void)!write(socket, bytes.data(), bytes.size());
  std::string all;
  char buffer[4096];
  for (ssize_t n = 0; (n = read(socket, buffer, sizeof buffer)) > 0;) all.append(buffer, static_cast<std::size_t>(n));
  close(socket);
  const std::size_t gap = all.find("\r\n\r\n");
  if (!all.starts_with("HTTP/1.1 ") || gap == std::string::npos) return {};
  return {std::stoi(all.substr(9)), all.substr(0, gap), all.substr(gap + 4)};
}

/// A request to an address "http://HOST:PORT/PATH".
inline HttpReply request(const std::string& method, const std::string& address, const std::string& host = {}) {
  const std::string rest = address.substr(std::string("http://").size());
  const std::size_t slash = rest.find('/'), colon = rest.find(':');
  return reply_to(std::stoi(rest.substr(colon + 1)), method + " " + rest.substr(slash) + " HTTP/1.1\r\nHost: " +
                                                         (host.empty() ? rest.substr(0, slash) : host) +
                                                         "\r\nConnection: close\r\nContent-Length: 0\r\n\r\n");
}

}  // namespace grapnel::test
