// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "app/runs/run_files.h"
#include "common/bus/lcm_bus.h"
#include "common/bus/node.h"

namespace CLI {
class App;
}

namespace berth {

/// The process a node lives in.
struct ProcessHost {
  const RunFiles& files;
  LcmBus& bus;
  ProcessLoop& loop;
  std::function<void(int exit_code)> finish;  ///< ends the program

  NodeSetup node(const std::string& name) const {
    return {name, files.setup.session, files.configuration_hash};
  }
};

/// The main function of every node program: options, loop, bus and node, until SIGINT or SIGTERM.
/// Errors go to stderr. @return 0, the code given to finish, or 2 for trouble at the start.
int run_node_program(int argc, char* argv[], const std::string& name,
                     const std::string& description,
                     const std::function<std::unique_ptr<Node>(ProcessHost&)>& make,
                     const std::function<void(CLI::App&)>& add_options = {});

}  // namespace berth
