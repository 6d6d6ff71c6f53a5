// SPDX-License-Identifier: BSD-3-Clause
#include <sys/resource.h>

#include <cstdio>
#include <optional>

#include "app/console/console_node.h"
#include "app/console/serving.h"
#include "app/hosts/process_host.h"

namespace {

/// Control loops go first where processors are short.
constexpr int niceness = 10;

}  // namespace

int main(int argc, char* argv[]) {
  using namespace berth;
  setpriority(PRIO_PROCESS, 0, niceness);
  console::ServingOptions options;
  console::Board board;
  std::optional<console::Server> server;
  std::optional<console::AddressFile> address;
  return run_node_program(
      argc, argv, "console", "Serves the operator's page: shows the cell, passes commands on.",
      [&](ProcessHost& host) {
        auto config = console::load_console_config(host.files.setup.config);
        options.apply_to(config);
        server.emplace(console::serving(config), board);
        // A second console beside that of the run is a node of its own.
        std::string name = "console";
        if (console::console_address(host.files.directory)) {
          name += "-" + std::to_string(server->port());
        } else {
          address.emplace(host.files.directory, server->url());
        }
        std::printf("console %s\n", server->url().c_str());
        std::fflush(stdout);
        return console::make_console_node(host.node(name), board, *server, host.bus, host.loop);
      },
      [&](CLI::App& command) { options.add_to(command); });
}
