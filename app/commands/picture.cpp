// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <berth/arm_state_t.hpp>
#include <cstdio>
#include <fstream>
#include <memory>

#include "app/cell_picture.h"
#include "app/commands/commands.h"
#include "app/exit_code.h"
#include "app/runs/run_files.h"
#include "app/runs/run_list.h"
#include "common/core/error.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/conversions.h"
#include "lcmtypes/scan_packet.h"
#include "logs/file/log_reader.h"

namespace berth::commands {
namespace {

struct PictureOptions {
  std::filesystem::path run;
  double at_s = -1;
  std::filesystem::path out = "cell.svg";
};

void take_joints(const logs::LogEvent& event, const char* channel, Joints& joints) {
  joints = reported_joints(logs::decode<arm_state_t>(event, channel)).value_or(joints);
}

/// The returns of the scan that runs; a new scan starts anew.
void take_returns(const logs::LogEvent& event, std::int64_t& scan, std::vector<Vector3d>& returns) {
  const auto packet = logs::decode<ScanPacket>(event, channels::scan_data);
  if (!packet) return;
  if (packet->scan_id != scan) returns.clear();
  scan = packet->scan_id;
  for (std::size_t i = 0; i < packet->status.size(); ++i) {
    if (packet->status[i] != ScanPacket::HIT) continue;
    returns.push_back(packet->point(i, packet->range_m[i]));
  }
}

int picture(const PictureOptions& options) {
  const RunFiles files = RunFiles::open(directory_of_run(options.run.string()));
  const Target target = load_target(files.setup.target, files.setup.target_length);
  const Cell cell = load_cell(files.setup.layout_file(), target);
  CellPicture picture;
  picture.replica = cell.replica.home;
  picture.sensor = cell.sensor.home;
  logs::LogReader reader(files.log());
  logs::LogEvent event;
  Utime start = 0;
  Utime now = 0;
  std::int64_t scan = 0;
  while (reader.next(event)) {
    if (start == 0) start = event.utime;
    if (options.at_s >= 0 && seconds(event.utime - start) > options.at_s) break;
    now = event.utime;
    take_joints(event, channels::arm_state_replica, picture.replica);
    take_joints(event, channels::arm_state_sensor, picture.sensor);
    take_returns(event, scan, picture.returns);
  }
  char caption[200];
  std::snprintf(caption, sizeof caption, "%s, %.1f s after the start, replica at %.2f m, scan %lld",
                files.name.c_str(), seconds(now - start),
                cell.relative_pose(picture.replica, picture.sensor).position.norm(),
                static_cast<long long>(scan));
  picture.caption = caption;
  std::ofstream out(options.out);
  out << draw(cell, picture);
  if (!out.flush()) throw InputError(options.out.string() + ": cannot be written");
  return exit_code::passed;
}

}  // namespace

void add_picture(CLI::App& app, int& exit_code) {
  auto* command = app.add_subcommand("picture", "Draw the cell at one time of a run, as SVG");
  auto options = std::make_shared<PictureOptions>();
  command->add_option("run", options->run, "Run directory, name of a run in runs/, or 'last'")
      ->required();
  command->add_option("--time", options->at_s, "Seconds after the start; the end when left out");
  command->add_option("--out", options->out, "Picture to write")->capture_default_str();
  command->callback([options, &exit_code] { exit_code = picture(*options); });
}

}  // namespace berth::commands
