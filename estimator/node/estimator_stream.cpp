// SPDX-License-Identifier: BSD-3-Clause
// Estimates while a tracking scan runs: every so many returns the scan, as far as it goes, goes
// into a copy of the filter; as a whole it is judged at its end, and goes into the filter itself
// then.
#include <algorithm>
#include <cmath>

#include "estimator/node/estimator.h"
#include "estimator/node/messages.h"
#include "lcmtypes/good_estimate.h"

namespace berth::estimator {

namespace {

/// Whether too few of the beams that should fit the target do. A few of a small batch at edges are
/// no contradiction: twice the chance of the draw.
bool contradicted(double fit, double expected) {
  constexpr double share = 0.75;
  return fit < share * expected - 2 * std::sqrt(share * (1 - share) * expected);
}

}  // namespace

void Estimator::stream() {
  if (!streams() || now_.mode != estimator_state_t::TRACKING || scan_->own_windows ||
      range_ == OperatingRange::long_range) {
    return;
  }
  if (!stream_) stream_ = Stream{tracker_->clone(), 0, {}, 0, false};
  // In their order, however they arrive: the same estimates every time.
  std::vector<RawBeam> beams;
  for (auto packet = scan_->packets.find(stream_->next_packet);
       packet != scan_->packets.end() && packet->first == stream_->next_packet;
       packet = scan_->packets.find(stream_->next_packet)) {
    beams.clear();
    append_beams(packet->second, beams);
    for (const RawBeam& beam : beams) {
      stream_->beams.push_back(beam);
      stream_->returns += beam.status == BeamStatus::hit ? 1 : 0;
      if (stream_->returns >= setup_.options.estimate_every) track_so_far(*stream_);
    }
    ++stream_->next_packet;
  }
}

/// The scan, as far as it goes, is tracked as a whole one: what its beams have in common counts
/// once.
void Estimator::track_so_far(Stream& stream) {
  const std::int64_t start = setup_.stopwatch();
  stream.returns = 0;
  const CleanScan scan = preprocess(stream.beams, now_.gate, setup_.lidar.beam);
  if (scan.points.empty()) return;
  const auto tracker = stream.tracker->clone();
  sensor_motions_.carry(*tracker, scan.utime_mean);
  const TrackingResult measured = tracking_->track(scan, predicted_by(*tracker, scan.utime_mean));
  const double expected = measured.used / std::max(1e-3, measured.confidence);
  stream.doubtful = stream.doubtful || contradicted(measured.used, expected);
  if (stream.doubtful || !measured.ok || !measured.motion ||
      !tracker->update(measured.pose, measured.covariance, *measured.motion, scan.utime_mean)) {
    return;
  }
  pose_estimate_t estimate = blank_estimate(scan_->id, scan);
  estimate.utime = scan.utime_last;
  publish_streamed(stream, *tracker, measured, estimate, start);
}

void Estimator::publish_streamed(Stream& stream, const TargetTracker& tracker,
                                 const TrackingResult& measured, pose_estimate_t& estimate,
                                 std::int64_t start) {
  estimate.last_packet = stream.next_packet;
  estimate.method = "stream";
  estimate.status = pose_estimate_t::OK;
  fill_filtered(tracker, estimate);
  if (!is_good(estimate)) {
    stream.doubtful = true;
    return;
  }
  fill_measurement(measured, estimate);
  estimate.seq = ++estimate_seq_;
  output_.estimate(estimate);

  estimator_diagnostics_t d{};
  d.utime = estimate.utime;
  d.seq = estimate.seq;
  d.session = estimate.session;
  d.scan_id = estimate.scan_id;
  d.track_us = setup_.stopwatch() - start;
  output_.diagnostics(d);
}

}  // namespace berth::estimator
