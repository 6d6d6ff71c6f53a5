// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/console_node.h"

#include <berth/run_info_t.hpp>
#include <nlohmann/json.hpp>

#include "app/console/board_sink.h"
#include "app/console/control/runnable.h"
#include "app/console/view/scene.h"
#include "app/runs/manifest.h"
#include "common/core/valid_text.h"
#include "drivers/devices.h"
#include "lcmtypes/channels.h"

namespace berth::console {
namespace {

constexpr Utime between_ticks = 50 * millisecond;
constexpr Utime between_counts = second;

/// Fast sections are published at every tick, also at one that comes a little early.
CellView::Options at_every_tick() {
  CellView::Options options;
  options.fast = between_ticks / 2;
  return options;
}

/// The name by which the cell knows this console's viewers.
std::string name_of(const Server& server) {
  return default_operator() + "@console:" + std::to_string(server.port());
}

}  // namespace

ConsoleContext::ConsoleContext(const RunFiles& files)
    : cell(load_cell(files.setup)),
      lidar(load_lidar_profile(files.setup, load_devices(files.setup.config).lidar.model)) {
  types.add(files.directory / "types");
}

/// The holder of control is published by the command handler, which knows its viewers.
class ConsoleNode::ViewSink final : public BoardSink {
 public:
  using BoardSink::BoardSink;
  void set(const std::string& section, std::string json) override {
    if (section != "control") BoardSink::set(section, std::move(json));
  }
};

ConsoleNode::ConsoleNode(NodeSetup node_setup, const ConsoleContext& context, Board& board,
                         Server& server, Options options, Bus& the_bus, ProcessLoop& the_loop)
    : Node(std::move(node_setup), the_bus, the_loop),
      board_(board),
      server_(server),
      process_loop_(the_loop),
      sink_(std::make_unique<ViewSink>(board)),
      view_(context.cell, context.lidar, context.types, *sink_, at_every_tick()),
      handler_(the_bus, the_loop, {name_of(server), options.hold_when_lost, session()},
               {[this](const std::string& viewer, const Answer& answer) {
                  server_.answer(viewer, answer);
                },
                [this](std::int8_t severity, const std::string& code, const std::string& text) {
                  event(severity, code, text);
                },
                std::move(options.run)}) {
  for (auto& [path, mesh] : mesh_texts(drawn_bodies(context.cell))) {
    server_.offer(path, "application/json", std::move(mesh));
  }
  board_.set("procedures", to_json(runnables(shared_files() / "procedures")));
  publish_control();
  process_loop_.watch(server_.descriptor(), [this] {
    for (const Incoming& incoming : server_.take()) take(incoming);
  });
  timers_.push_back(loop().every(between_ticks, [this] { tick(); }));
  timers_.push_back(loop().every(between_counts, [this] { publish_counters(); }));
  report(node_status_t::RUNNING);
}

ConsoleNode::~ConsoleNode() {
  for (const Loop::TimerId timer : timers_) loop().cancel(timer);
  process_loop_.unwatch(server_.descriptor());
}

void ConsoleNode::take(const std::string& channel, Bytes bytes) {
  if (channel == channels::run_info) {
    const auto info = logs::decode<run_info_t>(bytes);
    if (info && info->run != run_) {
      if (!run_.empty()) view_.reset();
      run_ = info->run;
    }
  }
  view_.take({0, now(), channel, bytes, 0});
}

void ConsoleNode::take(const Incoming& incoming) {
  switch (incoming.kind) {
    case Incoming::Kind::refused:
      return event(event_t::WARNING, "console-refused-" + incoming.code, incoming.text);
    case Incoming::Kind::joined:
      return event(event_t::INFO, "console-viewer",
                   incoming.viewer + " looks, from " + incoming.text);
    case Incoming::Kind::left:
      return event(event_t::INFO, "console-viewer", incoming.viewer + " has left");
    case Incoming::Kind::command:
      handler_.take(incoming.command);
      return publish_control();
  }
}

void ConsoleNode::run_ended(int code, const std::string& words) {
  if (code == 0) return event(event_t::INFO, "run-started", words);
  event(event_t::ERROR, "run-not-started",
        words.empty() ? "berth run ended with code " + std::to_string(code) : words);
}

void ConsoleNode::tick() {
  handler_.tick();
  view_.advance(now());
  publish_control();
}

void ConsoleNode::publish_control() {
  const CommandHandler::Control control = handler_.control();
  board_.set("control", json_text(nlohmann::json{{"holder", control.holder},
                                                 {"viewer", control.viewer},
                                                 {"utime_expires", control.utime_expires},
                                                 {"holds_when_lost", control.holds_when_lost}}));
}

void ConsoleNode::publish_counters() {
  const ServerCounters counters = server_.counters();
  count("viewers", static_cast<double>(counters.viewers));
  count("messages", static_cast<double>(counters.messages));
  count("bytes", static_cast<double>(counters.bytes));
  count("late_frames", static_cast<double>(counters.late_frames));
  count("refused", static_cast<double>(counters.refused));
}

}  // namespace berth::console
