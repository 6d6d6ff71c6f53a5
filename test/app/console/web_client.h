// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

namespace berth::console {

/// What came back for a request.
struct WebResponse {
  int status = 0;                             ///< 0: the connection ended without one
  std::map<std::string, std::string> fields;  ///< names in lower case
  std::string body;
};

/// One message of a WebSocket; of opcode 8, a farewell, with its code.
struct WebFrame {
  int opcode = -1;  ///< -1: the connection ended
  int close_code = 0;
  std::string text;
};

/// A client that can misbehave: it writes whatever bytes it is given. Reads fail the test after
/// some seconds of silence.
class WebClient {
 public:
  /// certificate: PEM to trust, for TLS; empty: plain.
  explicit WebClient(std::uint16_t port, const std::string& certificate = "");
  ~WebClient();
  WebClient(const WebClient&) = delete;
  WebClient& operator=(const WebClient&) = delete;

  /// Of the next connections' kernel buffers, so that a viewer that does not read is noticed early.
  static inline int receive_buffer_bytes = 0;

  void send(const std::string& bytes);
  WebResponse response(bool head = false);
  /// A GET, with more lines in its header if need be, each ended by "\r\n".
  WebResponse get(const std::string& target, const std::string& more = "");
  /// Asks for the WebSocket. @return the status, 101 when it is one.
  int upgrade(const std::string& more = "", const std::string& target = "/live");

  /// One masked frame, as a client has to send it.
  void send_frame(const std::string& text, int opcode = 1, bool masked = true);
  /// The next message or farewell; pings are answered.
  WebFrame frame();
  /// Whether the server ends the connection, whatever it still sends.
  bool ends();

 private:
  struct Connection;

  std::string until(const std::string& mark);
  std::string exactly(std::size_t size);
  bool more();

  std::unique_ptr<Connection> connection_;
  std::string received_;
};

}  // namespace berth::console
