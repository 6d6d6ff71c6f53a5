// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <boost/asio/buffer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <deque>
#include <optional>

#include "app/console/server/hub.h"
#include "common/core/error.h"

namespace berth::console {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;

/// How many commands a second a page may send on average; what a hand and a few timers send is far
/// less. The bucket holds twice as many.
inline constexpr double commands_per_s = 100;
/// Answers that wait for a viewer that does not read.
inline constexpr std::size_t max_waiting_texts = 256;

/// One viewer's WebSocket over Stream (beast::tcp_stream, or TLS on it). One text is written at a
/// time; a viewer that reads slowly is idle less often, and so gets fewer frames.
template <class Stream>
class ViewerSession final : public ViewerLink,
                            public std::enable_shared_from_this<ViewerSession<Stream>> {
 public:
  ViewerSession(Stream&& stream, Hub& hub, std::string from)
      : socket_(std::move(stream)), hub_(hub), from_(std::move(from)) {
    ++hub_.connections;
  }
  ~ViewerSession() override {
    --hub_.connections;
    hub_.leave(name_);
  }
  ViewerSession(const ViewerSession&) = delete;
  ViewerSession& operator=(const ViewerSession&) = delete;

  void accept(const http::request<http::string_body>& request) {
    // From here on the WebSocket keeps the time.
    beast::get_lowest_layer(socket_).expires_never();
    socket_.set_option(
        websocket::stream_base::timeout{hub_.options.request_time, hub_.options.idle_time, true});
    socket_.read_message_max(largest_command);
    socket_.auto_fragment(false);
    socket_.text(true);
    socket_.async_accept(request, [self = this->shared_from_this()](beast::error_code error) {
      if (error) return;
      self->name_ = self->hub_.join(self, self->from_);
      self->read();
    });
  }

  bool idle() const override { return waiting_.empty(); }

  void send(Text text) override {
    if (closing_) return;
    if (waiting_.size() >= max_waiting_texts) return drop("flood", "does not read its answers");
    waiting_.push_back(std::move(text));
    if (waiting_.size() == 1) write();
  }

  void close_going_away() override { close(websocket::close_code::going_away, "the console ends"); }

 private:
  using Clock = std::chrono::steady_clock;

  void write() {
    const Text text = waiting_.front();
    socket_.async_write(boost::asio::buffer(*text), [self = this->shared_from_this(), text](
                                                        beast::error_code error, std::size_t size) {
      if (error) self->closing_ = true;
      if (self->closing_) return self->waiting_.clear();
      self->hub_.sent(size);
      self->waiting_.pop_front();
      if (!self->waiting_.empty()) self->write();
    });
  }

  void read() {
    socket_.async_read(incoming_,
                       [self = this->shared_from_this()](beast::error_code error, std::size_t) {
                         self->on_read(error);
                       });
  }

  void on_read(beast::error_code error) {
    if (error) {
      if (error == websocket::error::message_too_big) {
        hub_.inbox.refuse("frame",
                          peer() + " sent more than " + std::to_string(largest_command) + " bytes");
      } else if (error == websocket::condition::protocol_violation) {
        hub_.inbox.refuse("frame", peer() + " broke the WebSocket protocol: " + error.message());
      }
      return;  // Beast has sent the close frame that belongs to it
    }
    if (!socket_.got_text()) {
      return refuse(websocket::close_code::unknown_data, "frame", "sent a binary message");
    }
    if (!within_rate()) {
      return refuse(websocket::close_code::policy_error, "flood", "sends too many commands");
    }
    Command command;
    try {
      command = parse_command(beast::buffers_to_string(incoming_.data()));
    } catch (const InputError& e) {
      return refuse(websocket::close_code::bad_payload, "frame", "sent " + harmless(e.what()));
    }
    incoming_.consume(incoming_.size());
    hub_.command(name_, std::move(command));
    read();
  }

  bool within_rate() {
    const auto now = Clock::now();
    const std::chrono::duration<double> since = now - filled_;
    filled_ = now;
    allowance_ = std::min(2 * commands_per_s, allowance_ + since.count() * commands_per_s);
    if (allowance_ < 1) return false;
    allowance_ -= 1;
    return true;
  }

  std::string peer() const { return name_ + " from " + from_; }

  void refuse(websocket::close_code code, const char* name, const std::string& what) {
    hub_.inbox.refuse(name, peer() + " " + what);
    close(code, what);
  }

  void close(websocket::close_code code, const std::string& why) {
    if (closing_) return;
    closing_ = true;
    websocket::close_reason reason(code);
    reason.reason = why.substr(0, 100);
    socket_.async_close(reason, [self = this->shared_from_this()](beast::error_code) {});
  }

  /// At once: the peer takes nothing, not even a farewell.
  void drop(const char* name, const std::string& what) {
    closing_ = true;
    hub_.inbox.refuse(name, peer() + " " + what);
    beast::get_lowest_layer(socket_).close();
  }

  websocket::stream<Stream> socket_;
  Hub& hub_;
  std::string from_;
  std::string name_;  // empty until it has joined
  beast::flat_buffer incoming_;
  std::deque<Text> waiting_;  // the first is being written
  bool closing_ = false;
  double allowance_ = 2 * commands_per_s;
  Clock::time_point filled_ = Clock::now();
};

}  // namespace berth::console
