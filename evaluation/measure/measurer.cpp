// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/measure/measurer.h"

#include <algorithm>
#include <limits>

#include "common/targets/target_file.h"
#include "evaluation/run/target_surface.h"

namespace berth::evaluation {
namespace {

/// From the target's description in RUN_INFO; in an older log without one, from the target of that
/// name.
std::vector<DockingPort> ports_of(const RunRecord& record) {
  if (!record.info()) return {};
  const run_info_t& info = *record.info();
  try {
    for (const attachment_t& attachment : info.attachments) {
      if (attachment.name != target_file) continue;
      return read_ports(attachment.content, std::string(target_file) + " in RUN_INFO",
                        info.target_length_m);
    }
    const std::filesystem::path name(info.target);
    if (name != name.filename() || name.has_extension()) return {};
    return load_target(info.target, info.target_length_m).ports;
  } catch (const std::exception&) {
    return {};  // a damaged log, or a target that is not known here
  }
}

}  // namespace

Measurer::Measurer(const RunRecord& record, NearestPoint nearest)
    : record_(record), nearest_(std::move(nearest)), ports_(ports_of(record)) {
  if (record.info()) symmetry_ = symmetry_of_run(*record.info());
  for (const EstimateSample& estimate : record.estimates()) {
    if (!estimate.ok()) continue;
    if (const auto compared = compare(estimate, record.truth(), symmetry_)) {
      compared_.push_back(*compared);
    } else {
      without_truth_.push_back(estimate.utime);
    }
  }
}

const ComparedEstimate* Measurer::compared_at(Utime utime) const {
  const auto found =
      std::lower_bound(compared_.begin(), compared_.end(), utime,
                       [](const ComparedEstimate& c, Utime t) { return c.estimate.utime < t; });
  return found != compared_.end() && found->estimate.utime == utime ? &*found : nullptr;
}

const DockingPort* Measurer::port(const Phase& phase) const {
  const std::string name = record_.docking_port(phase.end());
  for (const DockingPort& port : ports_) {
    if (name.empty() || port.name == name) return &port;
  }
  return nullptr;
}

Vector3d Measurer::surface_lever(const TruthSample& truth) const {
  const auto [place, is_new] = levers_.try_emplace(truth.utime);
  if (is_new) place->second = truth.pose.rotation * nearest_(truth.pose.inverse().position);
  return place->second;
}

Measured Measurer::measure(const Measurement& what, Statistic statistic, const Phase& phase) const {
  if (what.number) return what.number(*this, phase);
  const Series series = what.series(*this, phase);
  const auto samples = static_cast<std::int64_t>(series.value.size());
  if (samples == 0) {
    std::string reason = series.reason;
    if (reason.empty() && series.without_truth != 0) {
      reason = "no truth for any of " + std::to_string(series.without_truth) + " estimates";
    }
    return {std::numeric_limits<double>::quiet_NaN(), 0, 0, reason.empty() ? "no samples" : reason};
  }
  return {compute(statistic, series.value),
          uncertainty(statistic, series.value, series.truth_sigma), samples, ""};
}

}  // namespace berth::evaluation
