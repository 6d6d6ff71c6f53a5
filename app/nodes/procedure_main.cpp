// SPDX-License-Identifier: BSD-3-Clause
#include "app/runs/procedure_run.h"
#include "app/runs/process_host.h"

int main(int argc, char* argv[]) {
  using namespace berth;
  return run_node_program(
      argc, argv, "procedure", "Runs a procedure: its steps, its limits, its verdict.",
      [](ProcessHost& host) {
        auto node = make_procedure_node(host.node("procedure"), host.files.setup,
                                        procedure_run(host.files), host.bus, host.loop);
        node->when_finished(
            [&finish = host.finish, procedure = node.get()] { finish(procedure->exit_code()); });
        return node;
      });
}
