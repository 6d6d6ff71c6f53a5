// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/lidar/adapter.h"

#include "common/bus/process_loop.h"
#include "common/core/error.h"
#include "drivers/lidar/folder_adapter.h"
#include "drivers/lidar/playback_adapter.h"
#include "drivers/lidar/protocol_adapter.h"
#include "drivers/lidar/recording.h"

namespace berth::lidar {

std::unique_ptr<Adapter> make_adapter(const LidarDevice& device, const LidarProfile& profile,
                                      Loop& loop) {
  if (device.adapter == LidarDevice::Kind::tcp) {
    ProtocolSettings settings;
    settings.address = device.address;
    settings.dial_timeout = device.dial_timeout;
    settings.model = profile.model;
    return std::make_unique<ProtocolAdapter>(std::move(settings), loop);
  }
  if (device.adapter == LidarDevice::Kind::folder) {
    auto* process = dynamic_cast<ProcessLoop*>(&loop);
    if (process == nullptr) {
      throw InputError(
          "devices.yaml: lidar.adapter: folder waits for files in real time, which the "
          "twin has not; expected files there");
    }
    return std::make_unique<FolderAdapter>(
        device.recording, clouds::CloudOptions{device.us_per_time}, profile, *process);
  }
  std::unique_ptr<Recording> recording;
  if (device.adapter == LidarDevice::Kind::files) {
    recording = std::make_unique<CloudRecording>(device.recording, profile.rate_hz,
                                                 clouds::CloudOptions{device.us_per_time});
  } else {
    recording = std::make_unique<LogRecording>(device.recording);
  }
  return std::make_unique<PlaybackAdapter>(
      std::move(recording), PlaybackSettings{device.repeat, device.max_gap}, profile, loop);
}

}  // namespace berth::lidar
