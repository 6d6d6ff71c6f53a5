// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/console_node.h"

namespace berth::console {
namespace {

constexpr Utime between_counts = second;

class ConsoleNode final : public Node {
 public:
  ConsoleNode(const NodeSetup& node, Board& board, Server& server, Bus& bus, Loop& loop)
      : Node(node, bus, loop), board_(board), server_(server) {
    loop.watch(server.descriptor(), [this] {
      for (const Incoming& one : server_.take()) take(one);
    });
    loop.every(between_counts, [this] { tell_counters(); });
    report(node_status_t::RUNNING);
  }
  ~ConsoleNode() override { loop().unwatch(server_.descriptor()); }

 private:
  void take(const Incoming& one) {
    switch (one.kind) {
      case Incoming::Kind::refused:
        return event(event_t::WARNING, "console-refused-" + one.code, one.text);
      case Incoming::Kind::joined:
        return event(event_t::INFO, "console-viewer", one.viewer + " looks, from " + one.text);
      case Incoming::Kind::left:
        return event(event_t::INFO, "console-viewer", one.viewer + " has left");
      case Incoming::Kind::command:
        return server_.answer(one.viewer, {one.command.id, false, "this console only shows", ""});
    }
  }

  void tell_counters() {
    board_.at(now());
    const ServerCounters counters = server_.counters();
    count("viewers", static_cast<double>(counters.viewers));
    count("messages", static_cast<double>(counters.messages));
    count("bytes", static_cast<double>(counters.bytes));
    count("late_frames", static_cast<double>(counters.late_frames));
    count("refused", static_cast<double>(counters.refused));
  }

  Board& board_;
  Server& server_;
};

}  // namespace

std::unique_ptr<Node> make_console_node(const NodeSetup& setup, Board& board, Server& server,
                                        Bus& bus, Loop& loop) {
  return std::make_unique<ConsoleNode>(setup, board, server, bus, loop);
}

}  // namespace berth::console
