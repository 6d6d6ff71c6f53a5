// SPDX-License-Identifier: BSD-3-Clause
#include "procedures/language/recorded_trajectory.h"

#include <algorithm>
#include <berth/testbed_state_t.hpp>

#include "common/core/error.h"
#include "common/core/text.h"
#include "evaluation/run/run_record.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/conversions.h"

namespace berth::procedures {
namespace {

/// A record with longer gaps does not say how the motion went, s.
constexpr double max_gap = 1;

std::filesystem::path log_of(const std::filesystem::path& run) {
  return std::filesystem::is_directory(run) ? run / "run.lcm" : run;
}

}  // namespace

testbed::Waypoints poses_of_run(const std::filesystem::path& run, const std::string& phase_name,
                                bool commanded) {
  const std::filesystem::path file = log_of(run);
  std::vector<std::pair<Utime, Pose>> poses;
  evaluation::LogSummary summary;
  const evaluation::RunRecord record =
      evaluation::read_run(file, summary, std::nullopt, [&](const logs::LogEvent& event) {
        if (!commanded) return;
        const auto state = logs::decode<testbed_state_t>(event, channels::testbed_state);
        if (!state) return;
        poses.emplace_back(state->utime,
                           exact_pose_of(state->commanded_position_m, state->commanded_q_wxyz));
      });
  if (!commanded) {
    for (const auto& sample : record.truth().samples())
      poses.emplace_back(sample.utime, sample.pose);
  }
  const auto phase = record.phase(phase_name.empty() ? evaluation::whole_run : phase_name);
  if (!phase) {
    std::string known;
    for (const evaluation::Phase& p : record.phases())
      known += (known.empty() ? "" : ", ") + p.name;
    throw InputError(file.string() + ": has no phase '" + phase_name + "'" +
                     (known.empty() ? "" : "; its phases are: " + known));
  }
  testbed::Waypoints samples;
  for (const auto& [utime, pose] : poses) {
    if (!phase->contains(utime)) continue;
    const double time = seconds(utime - phase->start());
    if (!samples.empty() && time <= samples.back().time) continue;
    if (!samples.empty() && time - samples.back().time > max_gap) {
      throw InputError(file.string() + ": where the replica was is not recorded from " +
                       fixed(samples.back().time, 1) + " s to " + fixed(time, 1) + " s of '" +
                       phase->name + "'");
    }
    samples.push_back({time, pose});
  }
  if (samples.size() < 2) {
    throw InputError(file.string() + ": holds " + std::to_string(samples.size()) +
                     " relative poses in '" + phase->name + "', expected at least two");
  }
  return samples;
}

}  // namespace berth::procedures
