// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/targets/run_returns.h"

#include <berth/run_info_t.hpp>

#include "lcmtypes/channels.h"
#include "lcmtypes/scan_packet.h"
#include "logs/file/log_reader.h"
#include "logs/run/truth_track.h"

namespace berth::targets {
namespace {

constexpr std::size_t max_returns = 200'000;
constexpr double full_scale = 4095;

struct Timed {
  Utime utime;
  TrueReturn seen;
};

/// Takes every so many returns: twice as many of them whenever there are too many.
class Thinner {
 public:
  void take(const ScanPacket& packet) {
    for (std::size_t i = 0; i < packet.status.size(); ++i) {
      if (packet.status[i] != ScanPacket::HIT || packet.range2_m[i] > 0) continue;
      if (count_++ % step_ != 0) continue;
      Timed one{packet.utime + packet.time_us[i], {}};
      one.seen.origin = packet.origin(i);
      one.seen.direction = packet.direction(i);
      one.seen.range = static_cast<double>(packet.range_m[i]);
      one.seen.range_sigma = static_cast<double>(packet.range_sigma_m[i]);
      one.seen.power = packet.intensity[i] / full_scale;
      kept_.push_back(one);
      if (kept_.size() < max_returns) continue;
      for (std::size_t k = 0; 2 * k < kept_.size(); ++k) kept_[k] = kept_[2 * k];
      kept_.resize((kept_.size() + 1) / 2);
      step_ *= 2;
    }
  }
  const std::vector<Timed>& kept() const { return kept_; }

 private:
  std::vector<Timed> kept_;
  std::size_t count_ = 0;
  std::size_t step_ = 1;
};

}  // namespace

RunReturns read_returns(const std::filesystem::path& log) {
  RunReturns run;
  logs::LogReader reader(log);
  logs::LogEvent event;
  logs::TruthTrack truth;
  Thinner thinner;
  while (reader.next(event)) {
    if (event.channel == channels::ground_truth) {
      if (const auto m = logs::decode<ground_truth_t>(event.data)) truth.add(logs::sample_of(*m));
    } else if (event.channel == channels::scan_data) {
      if (const auto packet = logs::decode<ScanPacket>(event.data)) thinner.take(*packet);
    } else if (event.channel == channels::run_info) {
      if (const auto info = logs::decode<run_info_t>(event.data))
        run.target_hash = info->target_hash;
    }
  }
  for (const Timed& one : thinner.kept()) {
    const auto then = truth.at(one.utime);
    if (!then) continue;
    run.returns.push_back(one.seen);
    run.returns.back().pose = then->pose;
    run.returns.back().covariance = then->covariance;
  }
  return run;
}

}  // namespace berth::targets
