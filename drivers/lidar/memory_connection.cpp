// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/memory_connection.h"

#include <map>
#include <utility>
#include <vector>

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

/// What one end is called with; nothing once it is closed. Outlives it in the events under way. As
/// the reader of a socket it wakes a latency after the first message and takes all that came by
/// then.
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

}  // namespace

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

void listen_memory(SimulatedLoop& loop, const std::string& address, Accepted accepted) {
  auto& listeners = loop.simulation().shared<Listeners>();
  if (!listeners.insert({address, {loop, std::move(accepted)}}).second) {
    throw InputError("address " + address + " is served twice");
  }
}

}  // namespace berth::lidar
