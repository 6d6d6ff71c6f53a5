// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/bus/process_loop.h"
#include "common/bus/worker.h"
#include "common/clouds/cloud.h"
#include "common/core/lidar_profile.h"
#include "drivers/lidar/adapter.h"
#include "drivers/lidar/recording.h"

namespace berth::lidar {

/// Time of a file's scan, on the system's clock, where the file has one.
struct StatedTime {
  Utime first = 0;     ///< of the first beam, us since 1970
  std::string source;  ///< "the times of its beams", for messages
};

/// Moves a scan's beams to when they were fired; in this order of preference:
/// - times of its beams since 1970 (after 2000-01-01) stay as they are;
/// - a time in the file's name, YYYYMMDDThhmmss[.ffffff]Z (UTC), is that of the first beam;
/// - else the last beam was fired when the file was changed last, which is later than the scan by
///   as long as the export took.
/// @param changed of the file, us since 1970
StatedTime state_time(RecordedScan& scan, Utime changed);

/// A LIDAR, operated by other means, that exports its scans as files into a folder (common/clouds):
/// the next complete file answers a scan order. A file is complete when it is renamed into the
/// folder or closed by its writer (inotify(7), without polling). A file that cannot be read, that
/// comes without an order or whose scan began before its order is reported and passed over.
///
/// Its clock is the system's. Files are read on a worker; beams go out 400 messages a second.
class FolderAdapter final : public Adapter {
 public:
  /// @throws InputError when the path is no folder.
  FolderAdapter(std::filesystem::path folder, const clouds::CloudOptions& options,
                const LidarProfile& profile, ProcessLoop& loop);
  ~FolderAdapter() override;
  FolderAdapter(const FolderAdapter&) = delete;
  FolderAdapter& operator=(const FolderAdapter&) = delete;

  void start(Events events) override;
  bool ready() const override { return watched_ >= 0 && reason_.empty(); }
  const std::string& reason() const override { return reason_; }
  const std::string& name() const override { return name_; }
  const Identity& identity() const override { return identity_; }
  ClockLine clock() const override;
  void order(const ScanOrder& order) override;
  void cancel(std::int64_t scan_id) override;
  void drop(const std::string& reason) override;

 private:
  struct Pending {
    std::int64_t id = 0;
    Utime ordered = 0;  // time of the order on the clock of file stamps
    std::optional<RecordedScan> scan;
    std::size_t next = 0;  // of its beams
  };
  /// As it was read.
  struct Version {
    std::uint64_t inode = 0;
    std::int64_t changed_ns = 0;  // since 1970
    std::int64_t size = 0;
    bool operator==(const Version&) const = default;
  };
  struct File {
    std::filesystem::path path;
    Version version;
    RecordedScan scan;
    std::string fault;
  };

  void watch();
  void read_events();
  void take_file(const std::string& file);
  void read(File& file) const;
  void use(File& file);
  void send_beams();
  void end(ScanResult result);

  std::filesystem::path folder_;
  std::string name_;
  clouds::CloudOptions options_;
  double rate_hz_;
  std::size_t beams_per_message_;
  Identity identity_;
  ProcessLoop& loop_;
  std::unique_ptr<Worker> worker_;
  Events events_;
  int inotify_ = -1;
  int watched_ = -1;
  std::string reason_ = "not started yet";
  std::optional<Pending> pending_;
  /// By path. A file that is renamed before it is closed causes two events.
  std::map<std::string, Version> seen_;
  Loop::TimerId timer_ = 0;
  Loop::TimerId watch_timer_ = 0;
};

}  // namespace berth::lidar
