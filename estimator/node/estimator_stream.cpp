// SPDX-License-Identifier: BSD-3-Clause
// Estimates while a tracking scan runs. Its returns go into a copy of the filter, a few at a time;
// the scan as a whole is judged at its end, and goes into the filter itself then.
#include <algorithm>
#include <cmath>

#include "estimator/node/estimator.h"
#include "estimator/node/messages.h"
#include "estimator/tracking/beam_information.h"
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
  if (!stream_) stream_ = Stream{tracker_->clone(), {}, 0, 0, {}, 0, false};
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
      if (stream_->returns >= setup_.options.estimate_every) use_batch(*stream_);
    }
    ++stream_->next_packet;
    if (stream_->beams.empty()) stream_->first_packet = stream_->next_packet;
  }
}

void Estimator::use_batch(Stream& stream) {
  const std::int64_t start = setup_.stopwatch();
  if (tracking_->name() == "likelihood") {
    track_so_far(stream, start);
  } else {
    add_batch(stream, start);
  }
  stream.beams.clear();
  stream.returns = 0;
  stream.first_packet = stream.next_packet;
}

/// The scan, as far as it goes, is tracked as a whole one: what its beams have in common counts
/// once.
void Estimator::track_so_far(Stream& stream, std::int64_t start) {
  stream.so_far.insert(stream.so_far.end(), stream.beams.begin(), stream.beams.end());
  const CleanScan scan = preprocess(stream.so_far, now_.gate, setup_.lidar.beam);
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
  estimate.first_packet = 0;
  publish_streamed(stream, *tracker, measured, estimate, start);
}

/// The returns since the last estimate go into the filter.
void Estimator::add_batch(Stream& stream, std::int64_t start) {
  const CleanScan batch = preprocess(stream.beams, now_.gate, setup_.lidar.beam);
  if (batch.points.empty()) return;

  const std::int64_t utime = batch.utime_mean;
  sensor_motions_.carry(*stream.tracker, utime);
  BeamLinearisation at{{stream.tracker->predict(utime), stream.tracker->velocity()},
                       utime,
                       stream.tracker->predicted_covariance(utime)};
  BeamInformation said;
  const auto linearise = [&](const Motion& about) {
    at.pose = about.pose;
    at.velocity = about.velocity;
    said = beam_information(*model_, noise_.beam(), batch.beams, at,
                            setup_.options.beam_tracking.descent.information);
    return said.motion();
  };
  // Once returns contradict the prediction, the rest waits for the judgement of the whole scan.
  linearise({at.pose, at.velocity});
  stream.doubtful =
      stream.doubtful || contradicted(said.used, said.predicted - said.blocked + said.beside);
  if (stream.doubtful || said.used == 0) return;
  if (!stream.tracker->update(linearise, utime)) return;

  TrackingResult measured;  // these few returns alone measure nothing
  measured.pose = stream.tracker->pose();
  measured.used = said.used;
  measured.confidence = static_cast<double>(said.used) / std::max(1, said.predicted);
  pose_estimate_t estimate = blank_estimate(scan_->id, batch);
  estimate.first_packet = stream.first_packet;
  publish_streamed(stream, *stream.tracker, measured, estimate, start);
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
