// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/simulated/simulated_tracker.h"

#include "common/core/error.h"
#include "common/core/text.h"

namespace berth {

SimulatedTracker::SimulatedTracker(const TrackerSetup& setup, const Options& options,
                                   std::uint64_t seed, ToolPose tool, Loop& loop,
                                   const std::filesystem::path& file)
    : setup_(setup),
      to_tracker_(options.place.inverse()),
      random_(seed, "laser tracker"),
      tool_(std::move(tool)),
      loop_(loop),
      file_(file) {
  if (!file_) throw InputError(file.string() + ": cannot be written");
  file_ << "time,point,x,y,z\n";
  timer_ = loop.every(options.period, [this] { measure(); });
}

SimulatedTracker::~SimulatedTracker() { loop_.cancel(timer_); }

void SimulatedTracker::measure() {
  const Utime t = loop_.now();
  const Reflector& reflector = setup_.reflectors[next_];
  next_ = (next_ + 1) % setup_.reflectors.size();
  const Vector3d point = to_tracker_ * (tool_(reflector.on, t) * reflector.place);
  const Vector3d seen = point + random_.normal_vector(setup_.sigma_at(point.norm()));
  file_ << fixed(seconds(t), 6) << ',' << reflector.name;
  for (int i = 0; i < 3; ++i) file_ << ',' << fixed(1e3 * seen[i], 4);
  file_ << '\n';
}

}  // namespace berth
