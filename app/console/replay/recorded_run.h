// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <vector>

#include "app/console/view/cell_view.h"
#include "app/runs/replay/player.h"
#include "app/runs/run_files.h"

namespace berth::console {

/// A run directory's log, looked at as of any time at once.
class RecordedRun {
 public:
  /// Before a time whose state is built up, everything of so long is taken in.
  static constexpr Utime run_up = 5 * second;

  /// Reads the log once. @throws InputError
  RecordedRun(const std::filesystem::path& directory, const std::function<void(double)>& progress);

  const LogIndex& index() const { return index_; }
  const RunFiles& files() const { return files_; }
  const Cell& cell() const { return cell_; }
  const LidarProfile& lidar() const { return lidar_; }
  /// When the first step of a procedure began; the log's first event where there is none.
  Utime begin() const { return begin_; }
  double length_s() const { return seconds(index_.last() - index_.first()); }

  /// The criteria of each procedure in the log as they were judged in its end.
  CellView::Verdicts verdicts() const;
  /// Steps and events, for a time bar: [{kind, time_s, end_s, text, state or severity}].
  Json marks() const;
  /// Passes on every estimate of the whole run with its truth.
  void samples(const Samples::Ready& ready) const;
  /// Puts the view to what it shows when all events before this place have come.
  void build(CellView& view, std::size_t place) const;

 private:
  using Places = std::vector<std::uint32_t>;

  void sort_by_channel();
  void find_procedures();
  void find_begin();
  const Places& places_of(const std::string& channel) const;
  /// Places of the scan that ran last before a place, and of its request.
  Places last_scan(std::size_t place) const;

  RunFiles files_;
  Cell cell_;
  LidarProfile lidar_;
  LogIndex index_;
  std::map<std::string, Places, std::less<>> places_;  // of each channel's events
  std::vector<procedure_state_t> procedures_;          // of each the last state
  Utime begin_ = 0;
};

}  // namespace berth::console
