// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/targets/run_returns.h"

#include <berth/run_info_t.hpp>

#include "evaluation/run/truth_track.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/scan_packet.h"
#include "logs/file/log_reader.h"

namespace berth::targets {
namespace {

constexpr std::size_t max_returns = 200'000;
constexpr double full_scale = 4095;

/// Takes every so many returns: twice as many of them whenever there are too many.
class Thinner {
 public:
  void take(const TrueReturn& seen) {
    if (count_++ % step_ != 0) return;
    kept_.push_back(seen);
    if (kept_.size() < max_returns) return;
    for (std::size_t k = 0; 2 * k < kept_.size(); ++k) kept_[k] = kept_[2 * k];
    kept_.resize((kept_.size() + 1) / 2);
    step_ *= 2;
  }
  std::vector<TrueReturn>& kept() { return kept_; }

 private:
  std::vector<TrueReturn> kept_;
  std::size_t count_ = 0;
  std::size_t step_ = 1;
};

void take(const ScanPacket& packet, const evaluation::TruthTrack& truth, double reach,
          Thinner& thinner) {
  for (std::size_t i = 0; i < packet.status.size(); ++i) {
    if (packet.status[i] != ScanPacket::HIT || packet.range2_m[i] > 0) continue;
    const auto then = truth.at(packet.utime + packet.time_us[i]);
    if (!then) continue;
    TrueReturn seen;
    seen.origin = packet.origin(i);
    seen.direction = packet.direction(i);
    seen.range = static_cast<double>(packet.range_m[i]);
    if ((seen.origin + seen.range * seen.direction - then->pose.position).norm() > reach) continue;
    seen.range_sigma = static_cast<double>(packet.range_sigma_m[i]);
    seen.power = packet.intensity[i] / full_scale;
    seen.pose = then->pose;
    seen.covariance = then->covariance;
    thinner.take(seen);
  }
}

}  // namespace

RunReturns read_returns(const std::filesystem::path& log, double reach) {
  RunReturns run;
  evaluation::TruthTrack truth;
  logs::LogEvent event;
  for (logs::LogReader reader(log); reader.next(event);) {
    if (const auto sample = logs::decode<ground_truth_t>(event, channels::ground_truth)) {
      truth.add(evaluation::sample_of(*sample));
    } else if (const auto info = logs::decode<run_info_t>(event, channels::run_info)) {
      run.target_hash = info->target_hash;
    }
  }
  Thinner thinner;
  for (logs::LogReader reader(log); reader.next(event);) {
    if (const auto packet = logs::decode<ScanPacket>(event, channels::scan_data)) {
      take(*packet, truth, reach, thinner);
    }
  }
  run.returns = std::move(thinner.kept());
  return run;
}

}  // namespace berth::targets
