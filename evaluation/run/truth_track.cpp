// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/run/truth_track.h"

#include <algorithm>
#include <berth/ground_truth_t.hpp>
#include <berth/pose_estimate_t.hpp>
#include <cstdlib>

#include "evaluation/run/run_record.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/conversions.h"
#include "lcmtypes/good_estimate.h"
#include "logs/file/log_reader.h"

namespace berth::evaluation {
namespace {

bool earlier(const TruthSample& sample, Utime utime) { return sample.utime < utime; }

}  // namespace

TruthSample sample_of(const ground_truth_t& message) {
  TruthSample sample;
  sample.utime = message.utime;
  sample.pose = pose_of(message);
  sample.covariance = covariance_of(message.covariance);
  sample.velocity = velocity_of(message);
  return sample;
}

void TruthTrack::add(const TruthSample& sample) {
  if (samples_.empty() || samples_.back().utime < sample.utime) {
    samples_.push_back(sample);
    return;
  }
  const auto place = std::lower_bound(samples_.begin(), samples_.end(), sample.utime, earlier);
  if (place->utime != sample.utime) samples_.insert(place, sample);
}

void TruthTrack::add_live(const TruthSample& sample) {
  constexpr Utime kept = 10 * second;
  if (!samples_.empty() && sample.utime < samples_.back().utime - kept) samples_.clear();
  add(sample);
  const Utime latest = samples_.back().utime;
  // Seldom, because what stays is moved.
  if (latest - samples_.front().utime > 2 * kept) forget_before(latest - kept);
}

void TruthTrack::forget_before(Utime utime) {
  samples_.erase(samples_.begin(),
                 std::lower_bound(samples_.begin(), samples_.end(), utime, earlier));
}

void TruthTrack::forget_after(Utime utime) {
  samples_.erase(std::lower_bound(samples_.begin(), samples_.end(), utime + 1, earlier),
                 samples_.end());
}

std::span<const TruthSample> TruthTrack::between(Utime first, Utime last) const {
  const auto begin = std::lower_bound(samples_.begin(), samples_.end(), first, earlier);
  return {begin, std::lower_bound(begin, samples_.end(), last + 1, earlier)};
}

std::optional<TruthSample> TruthTrack::at(Utime utime) const {
  const auto after = std::lower_bound(samples_.begin(), samples_.end(), utime, earlier);
  if (after == samples_.end()) return std::nullopt;
  if (after->utime == utime) return *after;
  if (after == samples_.begin()) return std::nullopt;
  const TruthSample& a = *std::prev(after);
  const TruthSample& b = *after;
  if (b.utime - a.utime > max_gap) return std::nullopt;
  const double s = static_cast<double>(utime - a.utime) / static_cast<double>(b.utime - a.utime);
  TruthSample sample;
  sample.utime = utime;
  sample.pose = interpolate(a.pose, b.pose, s);
  sample.covariance = (1 - s) * a.covariance + s * b.covariance;
  sample.velocity.linear = (1 - s) * a.velocity.linear + s * b.velocity.linear;
  sample.velocity.angular = (1 - s) * a.velocity.angular + s * b.velocity.angular;
  return sample;
}

TargetPoses::TargetPoses(const std::filesystem::path& log, PoseSource source) {
  const bool by_truth = source == PoseSource::truth;
  logs::LogReader reader(log);
  logs::LogEvent event;
  while (reader.next(event)) {
    if (by_truth) {
      const auto message = logs::decode<ground_truth_t>(event, channels::ground_truth);
      if (message) truth_[message->session].add(sample_of(*message));
    } else {
      const auto message = logs::decode<pose_estimate_t>(event, channels::pose_estimate);
      if (!message || !is_good(*message)) continue;
      const EstimateSample sample = sample_of(*message);
      estimates_[{message->session, message->scan_id}].push_back(
          {sample.utime, sample.pose, sample.velocity});
    }
  }
}

std::optional<Pose> TargetPoses::at(std::int64_t session, std::int64_t scan_id, Utime utime) const {
  if (const auto track = truth_.find(session); track != truth_.end()) {
    const auto sample = track->second.at(utime);
    return sample ? std::optional(sample->pose) : std::nullopt;
  }
  const auto of_scan = estimates_.find({session, scan_id});
  if (of_scan == estimates_.end()) return std::nullopt;
  const auto nearest = std::min_element(
      of_scan->second.begin(), of_scan->second.end(), [&](const Estimate& a, const Estimate& b) {
        return std::abs(a.utime - utime) < std::abs(b.utime - utime);
      });
  return moved(nearest->pose, nearest->velocity, seconds(utime - nearest->utime));
}

}  // namespace berth::evaluation
