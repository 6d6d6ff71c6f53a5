// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "logs/export/scans.h"
#include "logs/file/log_event.h"

namespace berth::logs {

/// Messages of Berth converted to the schemas that Foxglove-compatible viewers draw: poses,
/// frames, clouds of whole scans, log lines. Frames: "view" (x forward, y left, z up) holds
/// "sensor" (z along the boresight); in it are "target truth" and "target estimate".
class Foxglove {
 public:
  enum class Topic { truth, estimate, frames, scan, log };
  struct Description {
    const char* topic;
    const char* schema;
    std::string (*json_schema)();
  };
  static const Description& description(Topic topic);

  /// json: one message. It comes at the time of the event that take() was called with.
  using Out = std::function<void(Topic, const std::string& json)>;
  explicit Foxglove(Out out);

  void take(const LogEvent& event);

 private:
  void put_cloud(const ScanCloud& scan);

  Out out_;
  ScanAssembler scans_;
  bool view_is_published_ = false;
};

}  // namespace berth::logs
