// SPDX-License-Identifier: BSD-3-Clause
#include "test/app/console/web_client.h"

#include <arpa/inet.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <sstream>

#include "test/catch.h"

namespace berth::console {
namespace {

constexpr int patience_ms = 20000;

}  // namespace

struct WebClient::Connection {
  int fd = -1;
  SSL_CTX* context = nullptr;
  SSL* tls = nullptr;

  ~Connection() {
    SSL_free(tls);
    SSL_CTX_free(context);
    close(fd);
  }
};

WebClient::WebClient(std::uint16_t port, const std::string& certificate)
    : connection_(std::make_unique<Connection>()) {
  const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  connection_->fd = fd;
  if (receive_buffer_bytes > 0) {
    setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof receive_buffer_bytes);
  }
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  REQUIRE(connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  if (certificate.empty()) return;
  connection_->context = SSL_CTX_new(TLS_client_method());
  REQUIRE(SSL_CTX_load_verify_locations(connection_->context, certificate.c_str(), nullptr) == 1);
  SSL_CTX_set_verify(connection_->context, SSL_VERIFY_PEER, nullptr);
  connection_->tls = SSL_new(connection_->context);
  SSL_set1_host(connection_->tls, "localhost");
  SSL_set_fd(connection_->tls, fd);
  REQUIRE(SSL_connect(connection_->tls) == 1);
}

WebClient::~WebClient() = default;

void WebClient::send(const std::string& bytes) {
  // A connection that the server has ended is noticed by reading.
  if (connection_->tls != nullptr) {
    SSL_write(connection_->tls, bytes.data(), static_cast<int>(bytes.size()));
    return;
  }
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t n =
        ::send(connection_->fd, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (n <= 0) return;
    sent += static_cast<std::size_t>(n);
  }
}

bool WebClient::more() {
  std::array<char, 65536> buffer{};
  ssize_t size = 0;
  if (connection_->tls != nullptr) {
    size = SSL_read(connection_->tls, buffer.data(), buffer.size());
  } else {
    pollfd ready{connection_->fd, POLLIN, 0};
    REQUIRE(poll(&ready, 1, patience_ms) == 1);
    size = recv(connection_->fd, buffer.data(), buffer.size(), 0);
  }
  if (size > 0) received_.append(buffer.data(), static_cast<std::size_t>(size));
  return size > 0;
}

std::string WebClient::until(const std::string& mark) {
  auto end = received_.find(mark);
  while (end == std::string::npos && more()) end = received_.find(mark);
  if (end == std::string::npos) return "";
  std::string text = received_.substr(0, end + mark.size());
  received_.erase(0, end + mark.size());
  return text;
}

std::string WebClient::exactly(std::size_t size) {
  while (received_.size() < size && more()) {
  }
  std::string bytes = received_.substr(0, size);
  received_.erase(0, bytes.size());
  return bytes;
}

WebResponse WebClient::response(bool head) {
  WebResponse response;
  std::istringstream lines(until("\r\n\r\n"));
  std::string line;
  if (!std::getline(lines, line) || line.size() < 12) return response;
  response.status = std::stoi(line.substr(9, 3));
  while (std::getline(lines, line) && line.size() > 1) {
    const auto colon = line.find(": ");
    std::string name = line.substr(0, colon);
    std::transform(name.begin(), name.end(), name.begin(), ::tolower);
    response.fields[name] = line.substr(colon + 2, line.size() - colon - 3);
  }
  const auto length = response.fields.find("content-length");
  if (!head && response.status != 304 && length != response.fields.end()) {
    response.body = exactly(std::stoul(length->second));
  }
  return response;
}

WebResponse WebClient::get(const std::string& target, const std::string& more) {
  send("GET " + target + " HTTP/1.1\r\nHost: localhost\r\n" + more + "\r\n");
  return response();
}

int WebClient::upgrade(const std::string& more, const std::string& target) {
  return get(target,
             "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
             "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n" +
                 more)
      .status;
}

void WebClient::send_frame(const std::string& text, int opcode, bool masked) {
  std::string frame(1, static_cast<char>(0x80 | opcode));
  const int mask_bit = masked ? 0x80 : 0;
  if (text.size() < 126) {
    frame += static_cast<char>(mask_bit | static_cast<int>(text.size()));
  } else {
    frame += static_cast<char>(mask_bit | 127);
    for (int byte = 7; byte >= 0; --byte) {
      frame += static_cast<char>((text.size() >> (8U * static_cast<unsigned>(byte))) & 0xffU);
    }
  }
  if (masked) frame += std::string(4, '\0');  // a mask that leaves the bytes as they are
  send(frame + text);
}

WebFrame WebClient::frame() {
  for (;;) {
    const std::string head = exactly(2);
    if (head.size() < 2) return {};
    WebFrame frame;
    frame.opcode = head[0] & 0x0f;
    std::size_t size = static_cast<unsigned char>(head[1]) & 0x7fU;
    if (size >= 126) {
      const std::string longer = exactly(size == 126 ? 2 : 8);
      size = 0;
      for (const char c : longer) size = size << 8U | static_cast<unsigned char>(c);
    }
    frame.text = exactly(size);
    if (frame.opcode == 9) {
      send_frame(frame.text, 10);
      continue;
    }
    if (frame.opcode == 8 && frame.text.size() >= 2) {
      frame.close_code = static_cast<unsigned char>(frame.text[0]) << 8U |
                         static_cast<unsigned char>(frame.text[1]);
      frame.text.erase(0, 2);
    }
    return frame;
  }
}

bool WebClient::ends() {
  while (more()) received_.clear();
  return true;
}

}  // namespace berth::console
