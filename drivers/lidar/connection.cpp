// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/connection.h"

#include <array>
#include <map>
#include <utility>
#include <vector>

#include "common/bus/process_loop.h"
#include "common/bus/simulation.h"
#include "common/core/error.h"

namespace berth::lidar {
namespace {

struct Listener {
  SimulatedLoop& loop;
  Accepted accepted;
};

/// Of one Simulation, by address.
using Listeners = std::map<std::string, Listener>;

/// Callbacks of one end, empty once it is closed; pending events keep it alive. Like the reader of
/// a socket, it wakes one latency after the first message and reads all messages that have arrived
/// by then.
struct End {
  Loop& loop;
  Utime latency;
  Connection::OnMessage on_message{};
  Connection::OnClosed on_closed{};
  std::vector<Message> waiting{};  // not empty: it is about to wake

  static void give(const std::shared_ptr<End>& end, const Message& message) {
    end->waiting.push_back(message);
    if (end->waiting.size() > 1) return;
    end->loop.after(end->latency, [end] {
      for (const Message& one : std::exchange(end->waiting, {})) {
        const Connection::OnMessage on_message = end->on_message;  // which may close its own end
        if (on_message) on_message(one);
      }
    });
  }
};

class MemoryConnection final : public Connection {
 public:
  MemoryConnection(std::shared_ptr<End> own, std::shared_ptr<End> peer)
      : own_(std::move(own)), peer_(std::move(peer)) {}
  ~MemoryConnection() override {
    close(*own_);
    peer_->loop.after(peer_->latency, [peer = peer_] {
      const OnClosed on_closed = close(*peer);
      if (on_closed) on_closed("the peer closed the connection");
    });
  }

  void open(OnMessage on_message, OnClosed on_closed) override {
    own_->on_message = std::move(on_message);
    own_->on_closed = std::move(on_closed);
  }
  void speak(int /*the messages are as they are*/) override {}
  void send(const Message& message) override { End::give(peer_, message); }

 private:
  static OnClosed close(End& end) {
    end.on_message = nullptr;
    return std::exchange(end.on_closed, nullptr);
  }

  std::shared_ptr<End> own_;
  std::shared_ptr<End> peer_;
};

/// Conversations in the twin: messages as values, at most the simulation's wire latency later.
void dial_memory(SimulatedLoop& loop, const std::string& address, Connected connected) {
  const Utime latency = loop.simulation().wire_latency();
  loop.after(latency, [&loop, latency, address, connected = std::move(connected)] {
    const auto& listeners = loop.simulation().shared<Listeners>();
    const auto found = listeners.find(address);
    if (found == listeners.end()) return connected(nullptr, "");
    const Listener& listener = found->second;
    const auto near = std::make_shared<End>(End{loop, latency});
    const auto far = std::make_shared<End>(End{listener.loop, latency});
    listener.loop.after(0, [&listener, near, far] {
      listener.accepted(std::make_unique<MemoryConnection>(far, near));
    });
    connected(std::make_unique<MemoryConnection>(near, far), "");
  });
}

/// @throws InputError when the address is served already.
void listen_memory(SimulatedLoop& loop, const std::string& address, Accepted accepted) {
  auto& listeners = loop.simulation().shared<Listeners>();
  if (!listeners.insert({address, {loop, std::move(accepted)}}).second) {
    throw InputError("address " + address + " is served twice");
  }
}

constexpr std::size_t outbox_limit = 8 << 20;
constexpr Utime retry_period = 2 * millisecond;

}  // namespace

void dial(Loop& loop, const std::string& address, Connected connected, Utime timeout) {
  if (auto* twin = dynamic_cast<SimulatedLoop*>(&loop)) {
    return dial_memory(*twin, address, std::move(connected));
  }
  auto& process = dynamic_cast<ProcessLoop&>(loop);
  process.sockets().dial(
      address,
      [&process, address, connected = std::move(connected)](Socket socket) {
        if (socket.fd() < 0) return connected(nullptr, process.sockets().trouble(address));
        connected(std::make_unique<TcpConnection>(process, std::move(socket)), "");
      },
      timeout);
}

void listen(Loop& loop, const std::string& address, Accepted accepted) {
  if (auto* twin = dynamic_cast<SimulatedLoop*>(&loop)) {
    return listen_memory(*twin, address, std::move(accepted));
  }
  auto& process = dynamic_cast<ProcessLoop&>(loop);
  process.sockets().listen(address, [&process, accepted = std::move(accepted)](Socket socket) {
    accepted(std::make_unique<TcpConnection>(process, std::move(socket)));
  });
}

TcpConnection::TcpConnection(ProcessLoop& loop, Socket socket)
    : loop_(loop), socket_(std::move(socket)) {}

TcpConnection::~TcpConnection() {
  *alive_ = false;
  loop_.cancel(retry_);
  loop_.unwatch(socket_.fd());
}

void TcpConnection::open(OnMessage on_message, OnClosed on_closed) {
  on_message_ = std::move(on_message);
  on_closed_ = std::move(on_closed);
  loop_.watch(socket_.fd(), [this] { read(); });
}

void TcpConnection::fail(const std::string& reason) {
  if (over_) return;
  over_ = true;
  loop_.cancel(retry_);
  loop_.unwatch(socket_.fd());
  // Not from within send(): its caller may be inside a callback.
  loop_.after(0, [this, reason, alive = alive_] {
    if (*alive) on_closed_(reason);
  });
}

void TcpConnection::read() {
  std::array<std::uint8_t, 16384> bytes;
  const auto alive = alive_;
  while (true) {
    const auto size = socket_.read(bytes);
    if (!size) return fail("the peer closed the connection");
    decoder_.feed(std::span(bytes).first(*size));
    while (const auto message = decoder_.next()) {
      on_message_(*message);
      if (!*alive || over_) return;
    }
    if (decoder_.broken()) return fail(decoder_.error());
    if (*size < bytes.size()) return;  // that was all there is
  }
}

void TcpConnection::send(const Message& message) { send_bytes(encode(message, version_)); }

void TcpConnection::send_bytes(std::span<const std::uint8_t> bytes) {
  outbox_.insert(outbox_.end(), bytes.begin(), bytes.end());
  flush();
}

void TcpConnection::flush() {
  loop_.cancel(retry_);
  const auto taken = socket_.write(outbox_);
  if (!taken) return fail("the peer closed the connection");
  outbox_.erase(outbox_.begin(), outbox_.begin() + static_cast<std::ptrdiff_t>(*taken));
  if (outbox_.empty() || over_) return;
  if (outbox_.size() > outbox_limit) return fail("the peer does not read");
  retry_ = loop_.after(retry_period, [this] { flush(); });
}

}  // namespace berth::lidar
