// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>

#include "app/console/view/channel_health.h"
#include "app/console/view/criteria.h"
#include "app/console/view/estimate_sections.h"
#include "app/console/view/scan_section.h"
#include "app/console/view/scene.h"
#include "app/console/view/section.h"
#include "testbed/motion/clearance.h"

namespace berth::console {

/// The state that a page shows: folds the messages of the bus, or of a log, into the sections of
/// PROTOCOL.md. Knows no bus, thread or clock. Messages of a foreign type and damaged ones are
/// counted and change nothing else.
class CellView {
 public:
  /// Of procedures, by their starts; no criteria for one that did not come to its end.
  using Verdicts = std::map<Utime, std::vector<criterion_result_t>>;

  struct Options {
    bool with_samples = true;  ///< false: another object writes `samples`
    /// From which samples count, `utime_start` of `run`; 0: the first received of a run.
    Utime start = 0;
    /// Where they are known beforehand: they fill in as the run goes. Nothing: the criteria are
    /// measured as it goes.
    std::optional<Verdicts> verdicts;
    Json more_of_run = Json::object();  ///< of `run`, in addition to its message
    Utime fast = 50 * millisecond;
    Utime slow = second;
  };

  /// Writes the section `scene`. All that is given must outlive it.
  CellView(const Cell& cell, const LidarProfile& lidar, const logs::TypeCatalogue& types,
           Sink& sink, const Options& options);
  CellView(const Cell& cell, const LidarProfile& lidar, const logs::TypeCatalogue& types,
           Sink& sink)
      : CellView(cell, lidar, types, sink, Options{}) {}

  /// A message; event.utime is when it was received. Costs little; writes nothing but events.
  void take(const logs::LogEvent& event);
  /// Writes the sections that are due by now.
  void advance(Utime now);
  /// Writes all that changed.
  void flush(Utime now);
  /// Where another run's estimate has the target by now, sensor frame: the frame `ghost2`.
  void set_second_ghost(const std::optional<Pose>& pose) { second_ghost_ = pose; }
  /// Where this run's own has it; nothing when there is no current one.
  std::optional<Pose> estimated_pose(Utime now) const;
  /// Forgets everything: what comes next is of another run, or from elsewhere in a log.
  void reset();

 private:
  /// A section that is written at most once a period.
  struct Pace {
    Utime period;
    Utime last = 0;
    bool due(Utime now) {
      if (now >= last && now - last < period) return false;
      last = now;
      return true;
    }
  };

  void take_state(const logs::LogEvent& event);
  void publish_fast(Utime now);
  void publish_states(Utime now);
  void publish_slow(Utime now);
  std::string procedure_json();
  std::string testbed_json();
  void publish_run(Bytes message);
  void on_sample(const Sample& sample);
  bool changed(const char* channel);

  const Cell& cell_;
  const logs::TypeCatalogue& types_;
  Sink& sink_;
  Options options_;

  CellMessages latest_;
  Frames frames_;
  ScanSection scan_;
  ChannelHealth channel_health_;
  Samples samples_;
  std::optional<Sample> last_sample_;
  std::map<std::string, std::vector<std::uint8_t>, std::less<>> states_;  // newest, by channel
  std::map<std::string, bool, std::less<>> changed_;  // since they were published, by channel
  std::int64_t session_ = 0;
  Utime start_;  // of the run: samples count from it
  std::optional<Pose> second_ghost_;
  evaluation::NearestPoint nearest_;
  Criteria criteria_;
  std::vector<criterion_result_t> criteria_so_far_;
  testbed::Clearance clearance_;
  Pace fast_;
  Pace states_pace_{200 * millisecond};
  Pace slow_;
  Pace criteria_pace_{2 * second};
};

}  // namespace berth::console
