// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include "app/console/control/command_handler.h"
#include "app/console/server/server.h"
#include "app/console/view/cell_view.h"
#include "app/runs/run_files.h"
#include "common/bus/node.h"
#include "common/bus/process_loop.h"
#include "logs/types/type_catalogue.h"

namespace berth::console {

/// Context of a console: read from its run's directory.
struct ConsoleContext {
  /// @throws InputError
  explicit ConsoleContext(const RunFiles& files);

  Cell cell;
  LidarProfile lidar;
  logs::TypeCatalogue types;
};

/// The console on the bus: shows every message on the board, and turns the requests of pages into
/// the commands that terminals send.
class ConsoleNode final : public Node {
 public:
  struct Options {
    bool hold_when_lost = true;
    /// Starts a procedure; @return the reason why not, or nothing.
    std::function<std::string(const RunOrder&)> run;
  };

  /// ConsoleContext, board and server must outlive it.
  ConsoleNode(NodeSetup setup, const ConsoleContext& context, Board& board, Server& server,
              Options options, Bus& bus, ProcessLoop& loop);
  ~ConsoleNode() override;

  /// Every message of the bus, as it comes.
  void take(const std::string& channel, Bytes bytes);
  /// A run that was started at this console and has not come about, or has begun.
  void run_ended(int code, const std::string& words);

 private:
  class ViewSink;

  void take(const Incoming& incoming);
  void tick();
  void publish_control();
  void publish_counters();

  Board& board_;
  Server& server_;
  ProcessLoop& process_loop_;
  std::unique_ptr<ViewSink> sink_;
  CellView view_;
  CommandHandler handler_;
  std::string run_;  // that the view shows
  std::vector<Loop::TimerId> timers_;
};

}  // namespace berth::console
