// SPDX-License-Identifier: BSD-3-Clause
#include "app/console/replay_console.h"

#include <cstdio>

#include "app/console/board_sink.h"
#include "app/console/replay/replay_source.h"
#include "app/terminal/progress_line.h"
#include "common/bus/process_loop.h"
#include "common/core/error.h"

namespace berth::console {
namespace {

constexpr Utime between_frames = 20 * millisecond;

Answer answer_of(ReplaySource& replay, const Command& command, Utime wall) {
  try {
    return {command.id, true, replay.obey(command.name, command.arguments, wall), ""};
  } catch (const InputError& e) {
    return {command.id, false, e.what(), ""};
  }
}

}  // namespace

void serve_replay(const std::filesystem::path& run, const std::filesystem::path& second,
                  ServerOptions options) {
  ProcessLoop loop(clock_offset_now());
  loop.stop_on_signals();
  Board board;
  for (const char* list : {"samples", "samples2"}) board.keep(list, ReplaySource::max_samples);
  BoardSink sink(board);
  logs::TypeCatalogue types;
  types.add(run / "types");
  if (!second.empty()) types.add(second / "types");
  terminal::ProgressLine reading(run.string());
  ReplaySource replay(run, second, types, sink, loop.now(),
                      [&reading](double share) { reading.show(share); });
  reading.status("");

  options.mode = "replay";
  Server server(options, board);
  for (auto& [path, mesh] : replay.meshes()) server.offer(path, "application/json", mesh);
  loop.watch(server.descriptor(), [&] {
    for (const Incoming& incoming : server.take()) {
      if (incoming.kind == Incoming::Kind::refused) {
        std::fprintf(stderr, "refused (%s): %s\n", incoming.code.c_str(), incoming.text.c_str());
      }
      if (incoming.kind != Incoming::Kind::command) continue;
      server.answer(incoming.viewer, answer_of(replay, incoming.command, loop.now()));
    }
  });
  loop.every(between_frames, [&] { replay.run(loop.now()); });
  std::printf("console %s\nCtrl-C ends it\n", server.url().c_str());
  std::fflush(stdout);
  loop.run();
  loop.unwatch(server.descriptor());
}

}  // namespace berth::console
