// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/server/server.h"

#include <pthread.h>
#include <signal.h>
#include <sys/resource.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/host_name.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl.hpp>
#include <boost/asio/steady_timer.hpp>
#include <thread>

#include "app/console/server/credentials.h"
#include "app/console/server/http_session.h"
#include "app/console/server/hub.h"
#include "common/core/error.h"

namespace berth::console {

namespace asio = boost::asio;
using Tcp = asio::ip::tcp;
using namespace std::chrono_literals;

namespace {

/// Bytes that wait in our own queue for a viewer that reads slowly; beyond it the viewer gets fewer
/// frames. Small, so that a sign of life is not long behind the data before it.
constexpr int send_buffer_bytes = 16 * 1024;  // the kernel takes twice as much
constexpr auto time_for_goodbye = 200ms;
/// Control loops go first where processors are short.
constexpr int niceness = 10;

asio::ip::address address_of(const ServerOptions& options) {
  boost::system::error_code error;
  const auto address = asio::ip::make_address(options.address, error);
  if (error) {
    throw InputError("console address '" + options.address +
                     "': expected a numeric one, such as 127.0.0.1, ::1 or 0.0.0.0");
  }
  if (!address.is_loopback() && (options.token.empty() || options.certificate.empty())) {
    throw InputError("console address " + options.address +
                     " can be reached from other hosts: expected a token and a certificate too");
  }
  return address;
}

asio::ssl::context secrets_of(const ServerOptions& options) {
  asio::ssl::context context(asio::ssl::context::tls_server);
  if (options.certificate.empty()) return context;
  SSL_CTX_set_min_proto_version(context.native_handle(), TLS1_2_VERSION);
  context.set_options(asio::ssl::context::no_compression);
  boost::system::error_code error;
  context.use_certificate_chain_file(options.certificate.string(), error);
  if (error) {
    throw InputError("certificate " + options.certificate.string() + ": " + error.message());
  }
  require_private(options.key);
  context.use_private_key_file(options.key.string(), asio::ssl::context::pem, error);
  if (error) throw InputError("key " + options.key.string() + ": " + error.message());
  return context;
}

}  // namespace

class Server::Impl {
 public:
  Impl(const ServerOptions& options, const Board& board)
      : hub_(options, board), ssl_(secrets_of(options)), acceptor_(context_), timer_(context_) {
    listen(address_of(options));
    accept();
    next_turn();
    thread_ = std::thread([this] {
      setpriority(PRIO_PROCESS, 0, niceness);  // of this thread alone
      run();
    });
  }

  ~Impl() {
    asio::post(context_, [this] {
      acceptor_.close();
      hub_.close_all();
      timer_.expires_after(time_for_goodbye);
      timer_.async_wait([this](boost::system::error_code) { context_.stop(); });
    });
    thread_.join();
  }

  Hub& hub() { return hub_; }
  asio::io_context& context() { return context_; }

  std::string url() const {
    const auto& options = hub_.options;
    const auto address = asio::ip::make_address(options.address);
    std::string host = options.address;  // "localhost" may be another console's ::1
    if (address.is_unspecified()) {
      host = asio::ip::host_name();
    } else if (address.is_v6()) {
      host = '[' + host + ']';
    }
    return (options.certificate.empty() ? "http://" : "https://") + host + ':' +
           std::to_string(hub_.port) + '/';
  }

 private:
  void listen(const asio::ip::address& address) {
    const auto& options = hub_.options;
    boost::system::error_code error;
    for (int i = 0; i < std::max(1, options.ports_to_try); ++i) {
      const auto port = static_cast<std::uint16_t>(options.port + (options.port == 0 ? 0 : i));
      const Tcp::endpoint endpoint(address, port);
      if (acceptor_.is_open()) acceptor_.close();
      acceptor_.open(endpoint.protocol());
      acceptor_.set_option(asio::socket_base::reuse_address(true));
      acceptor_.bind(endpoint, error);
      if (!error) acceptor_.listen(asio::socket_base::max_listen_connections, error);
      if (!error) {
        hub_.port = acceptor_.local_endpoint().port();
        return;
      }
    }
    throw InputError("console at " + options.address + ", port " + std::to_string(options.port) +
                     ": " + error.message());
  }

  void run() {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, nullptr);  // signals are the node's
    for (;;) {
      try {
        context_.run();
        return;
      } catch (const std::exception& e) {
        // One connection's trouble; its session is gone, the others stay.
        hub_.inbox.refuse("trouble", e.what());
      }
    }
  }

  void accept() {
    acceptor_.async_accept([this](boost::system::error_code error, Tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (error) {  // no descriptors left, for example: others may be given back
        hub_.inbox.refuse("accept", "no connection could be taken: " + error.message());
        pause_.expires_after(100ms);
        return pause_.async_wait([this](boost::system::error_code stopped) {
          if (!stopped) accept();
        });
      }
      take(std::move(socket));
      accept();
    });
  }

  void take(Tcp::socket socket) {
    boost::system::error_code error;
    const auto peer = socket.remote_endpoint(error);
    if (error) return;  // gone already
    const std::string from = peer.address().to_string();
    if (hub_.connections >= hub_.options.max_connections) {
      return hub_.inbox.refuse("connections", from + ": too many connections");
    }
    socket.set_option(Tcp::no_delay(true), error);
    socket.set_option(asio::socket_base::send_buffer_size(send_buffer_bytes), error);
    beast::tcp_stream stream(std::move(socket));
    if (hub_.options.certificate.empty()) {
      std::make_shared<HttpSession<beast::tcp_stream>>(std::move(stream), hub_, from)->start();
    } else {
      using TlsStream = beast::ssl_stream<beast::tcp_stream>;
      std::make_shared<HttpSession<TlsStream>>(TlsStream(std::move(stream), ssl_), hub_, from)
          ->start();
    }
  }

  /// From beat to beat, so that lateness does not add up; beats that were missed are skipped.
  void next_turn() {
    const auto now = std::chrono::steady_clock::now();
    const auto period =
        std::chrono::microseconds(static_cast<std::int64_t>(1e6 / hub_.options.frames_per_s));
    beat_ = std::max(beat_ + period, now);
    timer_.expires_at(beat_);
    timer_.async_wait([this](boost::system::error_code stopped) {
      if (stopped) return;
      next_turn();
      hub_.send_frames();
    });
  }

  Hub hub_;
  asio::io_context context_{1};
  asio::ssl::context ssl_;
  Tcp::acceptor acceptor_;
  asio::steady_timer timer_;
  asio::steady_timer pause_{context_};
  std::chrono::steady_clock::time_point beat_;
  std::thread thread_;
};

Server::Server(const ServerOptions& options, const Board& board)
    : impl_(std::make_unique<Impl>(options, board)) {}

Server::~Server() = default;

std::uint16_t Server::port() const { return static_cast<std::uint16_t>(impl_->hub().port); }

std::string Server::url() const { return impl_->url(); }

void Server::offer(const std::string& path, const std::string& content_type, std::string content) {
  impl_->hub().contents.offer(path, content_type, std::move(content));
}

int Server::descriptor() const { return impl_->hub().inbox.descriptor(); }

std::vector<Incoming> Server::take() { return impl_->hub().inbox.take(); }

void Server::answer(const std::string& viewer, const Answer& answer) {
  asio::post(impl_->context(),
             [hub = &impl_->hub(), viewer, answer] { hub->answer(viewer, answer); });
}

ServerCounters Server::counters() const { return impl_->hub().counters(); }

}  // namespace berth::console
