// SPDX-License-Identifier: BSD-3-Clause
// board_dump RUN MESSAGES.jsonl MESHES: what the console's page would receive of a recorded run, a
// message every half second, and the meshes of its scene. To develop the page against real data.
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "app/console/board_sink.h"
#include "app/console/view/cell_view.h"
#include "app/runs/run_files.h"
#include "common/core/lidar_profile.h"
#include "drivers/devices.h"
#include "logs/file/log_reader.h"

namespace berth::console {
namespace {

namespace fs = std::filesystem;

void dump(const fs::path& run, const fs::path& messages, const fs::path& meshes) {
  const RunFiles files = RunFiles::open(run);
  const Cell cell = load_cell(files.setup);
  const LidarProfile lidar =
      load_lidar_profile(files.setup, load_devices(files.setup.config).lidar.model);
  logs::TypeCatalogue types;
  types.add(shared_files() / "lcmtypes");
  for (const auto& [path, text] : mesh_texts(drawn_bodies(cell))) {
    const fs::path file = meshes / fs::path(path).relative_path();
    fs::create_directories(file.parent_path());
    std::ofstream(file) << text;
  }
  Board board;
  BoardSink sink(board);
  CellView view(cell, lidar, types, sink);
  std::ofstream out(messages);
  logs::LogReader reader(files.log());
  logs::LogEvent event;
  std::uint64_t revision = 0;
  Utime next = 0;
  while (reader.next(event)) {
    view.take(event);
    view.advance(event.utime);
    if (event.utime < next) continue;
    next = event.utime + 500 * millisecond;
    const BoardMessage message = board.message_since(revision);
    if (message.text == nullptr) continue;
    revision = message.revision;
    out << *message.text << "\n";
  }
}

}  // namespace
}  // namespace berth::console

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "board_dump RUN MESSAGES.jsonl MESHES\n");
    return 2;
  }
  try {
    berth::console::dump(argv[1], argv[2], argv[3]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "board_dump: %s\n", error.what());
    return 2;
  }
  return 0;
}
