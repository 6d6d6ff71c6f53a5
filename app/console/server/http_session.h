// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <boost/beast/ssl.hpp>
#include <type_traits>

#include "app/console/server/viewer_session.h"

namespace berth::console {

/// Largest header of a request, bytes. A body is in none.
inline constexpr std::uint32_t largest_header = 16384;
/// A response may take so many times the time of a request: a megabyte of it, over a slow link.
inline constexpr int requests_in_a_response = 12;

/// One connection over Stream (beast::tcp_stream, or TLS on it): requests for the page's files one
/// after the other, or the one that makes it a viewer. A request has to be whole within
/// request_time; slow clients are disconnected.
template <class Stream>
class HttpSession : public std::enable_shared_from_this<HttpSession<Stream>> {
 public:
  HttpSession(Stream&& stream, Hub& hub, std::string from)
      : stream_(std::move(stream)), hub_(hub), from_(std::move(from)) {
    ++hub_.connections;
  }
  ~HttpSession() { --hub_.connections; }
  HttpSession(const HttpSession&) = delete;
  HttpSession& operator=(const HttpSession&) = delete;

  void start() {
    if constexpr (std::is_same_v<Stream, beast::tcp_stream>) {
      read();
    } else {
      lowest().expires_after(hub_.options.request_time);
      stream_.async_handshake(boost::asio::ssl::stream_base::server,
                              [self = this->shared_from_this()](beast::error_code error) {
                                if (!error) return self->read();
                                self->hub_.inbox.refuse(
                                    "tls", self->from_ + ": no TLS handshake: " + error.message());
                              });
    }
  }

 private:
  using Response = http::response<http::string_body>;

  beast::tcp_stream& lowest() { return beast::get_lowest_layer(stream_); }

  void read() {
    parser_.emplace();
    parser_->header_limit(largest_header);
    parser_->body_limit(std::uint64_t{0});
    lowest().expires_after(hub_.options.request_time);
    http::async_read(stream_, incoming_, *parser_,
                     [self = this->shared_from_this()](beast::error_code error, std::size_t) {
                       self->on_read(error);
                     });
  }

  void on_read(beast::error_code error) {
    if (!error) return serve();
    if (error == beast::error::timeout) {
      // Silence between two requests is how a browser leaves.
      if (parser_->got_some() || served_ == 0) {
        hub_.inbox.refuse("slow", from_ + ": no whole request in time");
      }
    } else if (error == http::error::header_limit) {
      refuse(431, "header", "The header is too long.");
    } else if (error == http::error::body_limit) {
      refuse(413, "body", "No request here has a body.");
    } else if (error.category() == http::make_error_code(http::error::end_of_stream).category() &&
               error != http::error::end_of_stream && error != http::error::partial_message) {
      refuse(400, "request", "This is not HTTP: " + error.message() + ".");
    } else {
      end();
    }
  }

  std::string field(http::field name) const { return std::string(parser_->get()[name]); }

  void serve() {
    const auto& request = parser_->get();
    const std::string target(request.target());
    const std::string path = target.substr(0, target.find('?'));
    keep_alive_ = request.keep_alive();
    const Verdict verdict = hub_.access.judge(
        {std::string(request.method_string()), target, field(http::field::host),
         field(http::field::origin), field(http::field::cookie), field(http::field::authorization)},
        hub_.port);
    if (verdict.status == 303) return redirect(verdict);
    if (verdict.status != 200) return refuse(verdict.status, verdict.code, verdict.text);
    if (!is_plain_path(path)) {
      return refuse(400, "path", "No such path can be here: " + harmless(path));
    }
    if (path == "/live") return serve_live();
    if (websocket::is_upgrade(request)) return refuse(404, "path", "No WebSocket is here.");
    const auto content = hub_.contents.find(path);
    if (!content) return answer(404, "text/plain; charset=utf-8", "There is no " + path + "\n");
    serve(*content);
  }

  void serve(const Content& content) {
    const std::string tag = '"' + content.tag + '"';
    const bool unchanged = field(http::field::if_none_match) == tag;
    auto response = make(unchanged ? 304 : 200, content.type, unchanged ? "" : *content.bytes);
    response->set(http::field::etag, tag);
    write(std::move(response));
  }

  void serve_live() {
    if (!websocket::is_upgrade(parser_->get())) {
      return answer(426, "text/plain; charset=utf-8", "This is a WebSocket.\n");
    }
    if (hub_.full()) return refuse(503, "viewers", "There are too many viewers already.");
    std::make_shared<ViewerSession<Stream>>(std::move(stream_), hub_, from_)
        ->accept(parser_->get());
  }

  void redirect(const Verdict& verdict) {
    auto response = make(303, "text/plain; charset=utf-8", "");
    response->set(http::field::location, verdict.location);
    response->set(http::field::set_cookie, verdict.cookie);
    write(std::move(response));
  }

  void refuse(int status, const std::string& code, const std::string& text) {
    keep_alive_ = false;
    hub_.inbox.refuse(code, from_ + " was refused: " + text);
    auto response = make(status, "text/plain; charset=utf-8", text + '\n');
    if (status == 401) response->set(http::field::www_authenticate, "Bearer");
    if (status == 405) response->set(http::field::allow, "GET, HEAD");
    write(std::move(response));
  }

  void answer(int status, const std::string& type, const std::string& text) {
    write(make(status, type, text));
  }

  std::shared_ptr<Response> make(int status, const std::string& type, std::string body) const {
    auto response = std::make_shared<Response>();
    response->result(static_cast<unsigned>(status));
    response->version(11);
    response->set(http::field::server, "berth-console");
    response->set(http::field::content_type, type);
    response->set(http::field::cache_control, "no-cache");
    response->set("Content-Security-Policy",
                  "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: "
                  "blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
                  "frame-ancestors 'none'");
    response->set("X-Content-Type-Options", "nosniff");
    response->set("X-Frame-Options", "DENY");
    response->set("Referrer-Policy", "no-referrer");
    response->set("Cross-Origin-Opener-Policy", "same-origin");
    response->set("Cross-Origin-Resource-Policy", "same-origin");
    response->keep_alive(keep_alive_);
    response->body() = std::move(body);
    response->prepare_payload();
    return response;
  }

  void write(std::shared_ptr<Response> response) {
    ++served_;
    if (parser_->get().method() == http::verb::head) response->body().clear();  // its length stays
    const bool more = response->keep_alive();
    lowest().expires_after(requests_in_a_response * hub_.options.request_time);
    Response& message = *response;
    http::async_write(stream_, message,
                      [self = this->shared_from_this(), response = std::move(response), more](
                          beast::error_code error, std::size_t) {
                        if (error) return;
                        more ? self->read() : self->end();
                      });
  }

  void end() {
    lowest().expires_after(hub_.options.request_time);
    if constexpr (std::is_same_v<Stream, beast::tcp_stream>) {
      drain();
    } else {
      stream_.async_shutdown([self = this->shared_from_this()](beast::error_code) {});
    }
  }

  /// Takes what the peer still sends, until it closes or its time is up: a connection closed on
  /// unread bytes is reset, and the peer may lose the answer.
  void drain() {
    beast::error_code error;
    if (!draining_) lowest().socket().shutdown(boost::asio::socket_base::shutdown_send, error);
    draining_ = true;
    incoming_.clear();
    lowest().async_read_some(
        incoming_.prepare(4096),
        [self = this->shared_from_this()](beast::error_code failed, std::size_t size) {
          if (!failed && size > 0) self->drain();
        });
  }

  Stream stream_;
  Hub& hub_;
  std::string from_;
  beast::flat_buffer incoming_;
  std::optional<http::request_parser<http::string_body>> parser_;
  int served_ = 0;
  bool keep_alive_ = false;
  bool draining_ = false;
};

}  // namespace berth::console
