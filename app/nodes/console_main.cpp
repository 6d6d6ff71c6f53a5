// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <optional>

#include "app/console/console_node.h"
#include "app/console/run_starter.h"
#include "app/console/serving.h"
#include "app/runs/process_host.h"

namespace {

using namespace berth;

/// Messages that may wait while a scan's packets come in a burst.
constexpr std::size_t max_waiting = 20000;

std::unique_ptr<Node> make_console(ProcessHost& host, const std::string& name,
                                   const console::ConsoleContext& context, console::Board& board,
                                   console::Server& server, bool hold_when_lost) {
  const auto receiver = std::make_shared<console::ConsoleNode*>(nullptr);
  const auto starter = std::make_shared<console::RunStarter>(
      host.files, host.loop,
      [receiver](int code, const std::string& words) { (*receiver)->run_ended(code, words); });
  auto node = std::make_unique<console::ConsoleNode>(
      host.node(name), context, board, server,
      console::ConsoleNode::Options{
          hold_when_lost,
          [starter](const console::RunOrder& order) { return starter->start(order); }},
      host.bus, host.loop);
  *receiver = node.get();
  host.bus.subscribe_all(
      Queue::fifo(max_waiting),
      [receiver](const std::string& channel, Bytes bytes) { (*receiver)->take(channel, bytes); });
  return node;
}

}  // namespace

int main(int argc, char* argv[]) {
  console::ServingOptions options;
  console::Board board;
  std::optional<console::ConsoleContext> context;
  std::optional<console::Server> server;
  std::optional<console::AddressFile> address;
  return run_node_program(
      argc, argv, "console", "Serves the operator's page: shows the cell, passes commands on.",
      [&](ProcessHost& host) {
        auto config = console::load_console_config(host.files.setup.config);
        options.apply_to(config);
        server.emplace(console::serving(config), board);
        // A second console next to that of the run is a node of its own.
        std::string name = "console";
        if (console::console_address(host.files.directory)) {
          name += "-" + std::to_string(server->port());
        } else {
          address.emplace(host.files.directory, server->url());
        }
        std::printf("console %s\n", server->url().c_str());
        std::fflush(stdout);
        context.emplace(host.files);
        return make_console(host, name, *context, board, *server, config.hold_on_loss);
      },
      [&](CLI::App& command) { options.add_to(command); });
}
