// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>

#include "common/core/lidar_profile.h"
#include "drivers/lidar/adapter.h"
#include "drivers/lidar/recording.h"

namespace berth::lidar {

struct PlaybackSettings {
  bool repeat = false;          ///< starts anew when it is over; else further scans are refused
  Utime max_gap = 10 * second;  ///< of waiting for a recorded scan's time
};

/// A LIDAR that answers scan orders with the scans of a recording, in their order; the ordered
/// windows are ignored. Beams come on the loop's clock, as far apart as they were recorded. A scan
/// starts as long after the one before as it did when it was recorded; at once when it is requested
/// later than that, and all that follows moves with it.
class PlaybackAdapter final : public Adapter {
 public:
  PlaybackAdapter(std::unique_ptr<Recording> recording, PlaybackSettings settings,
                  const LidarProfile& profile, Loop& loop);
  ~PlaybackAdapter() override;
  PlaybackAdapter(const PlaybackAdapter&) = delete;
  PlaybackAdapter& operator=(const PlaybackAdapter&) = delete;

  void start(Events events) override;
  bool ready() const override { return ready_; }
  const std::string& reason() const override { return reason_; }
  const std::string& name() const override { return recording_->name(); }
  const Identity& identity() const override { return identity_; }
  ClockLine clock() const override { return {}; }
  void order(const ScanOrder& order) override;
  void cancel(std::int64_t scan_id) override;
  void drop(const std::string& reason) override;

 private:
  struct Playing {
    std::int64_t id = 0;
    std::size_t windows = 1;
    RecordedScan scan;
    std::size_t next = 0;
  };

  void become_ready(Utime wait);
  std::optional<RecordedScan> next_scan(std::string& refusal);
  void schedule();
  void play();
  void end(ScanResult result, const std::string& reason);
  Utime on_clock(Utime recorded) const { return recorded + shift_; }

  std::unique_ptr<Recording> recording_;
  PlaybackSettings settings_;
  Identity identity_;
  Loop& loop_;
  Events events_;
  bool ready_ = false;
  std::string reason_ = "not started yet";
  std::optional<Playing> playing_;
  int played_ = 0;
  bool anchored_ = false;  // shift_ holds for the next scan
  Utime shift_ = 0;        // from the recording's clock to the loop's
  Loop::TimerId timer_ = 0;
};

}  // namespace berth::lidar
