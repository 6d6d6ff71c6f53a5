// SPDX-License-Identifier: BSD-3-Clause
// Subscribes to POSE_ESTIMATE and prints each estimate: time, status, pose, standard deviations.
// Needs liblcm and the messages of lcmtypes/, nothing else of Berth.
//
//   ./berth up                                                  (one terminal)
//   build/release/examples/estimates [--lcm-url URL]            (another)
//   ./berth run procedures/track_static.yaml                    (a third)
//
// LCM reads a log in place of a network, here as fast as it goes; the program ends with the log:
//
//   build/release/examples/estimates --lcm-url "file://runs/RUN/run.lcm?speed=0"
#include <berth/pose_estimate_t.hpp>
#include <cmath>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <string>
#include <vector>

namespace {

constexpr double mm = 1e-3;
constexpr double degree = 0.017453292519943295;  // rad

const char* name_of(int status) {
  switch (status) {
    case berth::pose_estimate_t::IDLE:
      return "idle";
    case berth::pose_estimate_t::ACQUIRING:
      return "acquiring";
    case berth::pose_estimate_t::OK:
      return "ok";
    case berth::pose_estimate_t::AMBIGUOUS:
      return "ambiguous";
    case berth::pose_estimate_t::LOST:
      return "lost";
    default:
      return "unknown";
  }
}

// T_sensor_model: the model's pose in the sensor frame (x right, y down, z along the boresight).
void on_estimate(const lcm::ReceiveBuffer*, const std::string&,
                 const berth::pose_estimate_t* estimate, void*) {
  std::printf("%.6f s  %s", 1e-6 * static_cast<double>(estimate->utime), name_of(estimate->status));
  if (estimate->status != berth::pose_estimate_t::OK) {
    std::printf("  %s\n", estimate->reason.c_str());  // its pose means nothing
    return;
  }
  const double* p = estimate->position_m;
  const double* q = estimate->q_wxyz;
  // Row-major, 6 x 6: translation (m), then the rotation vector (rad).
  const double* variance = estimate->covariance;
  const double position_sigma = std::sqrt(variance[0] + variance[7] + variance[14]);
  const double attitude_sigma = std::sqrt(variance[21] + variance[28] + variance[35]);
  std::printf("  p %+.4f %+.4f %+.4f m  q %+.4f %+.4f %+.4f %+.4f  sigma %.1f mm %.2f deg\n", p[0],
              p[1], p[2], q[0], q[1], q[2], q[3], position_sigma / mm, attitude_sigma / degree);
}

}  // namespace

/// @param arguments an LCM URL; without one LCM_DEFAULT_URL, or LCM's own
int main(int count, char** arguments) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  const std::vector<std::string> words(arguments + 1, arguments + count);
  const bool has_url = words.size() == 2 && words[0] == "--lcm-url";
  if (!words.empty() && !has_url) {
    const bool help = words[0] == "--help";
    std::fprintf(help ? stdout : stderr, "usage: estimates [--lcm-url URL]\n");
    return help ? 0 : 2;
  }
  const std::string url = has_url ? words[1] : "";
  lcm::LCM lcm(url);
  if (!lcm.good()) {
    std::fprintf(stderr, "estimates: no LCM at '%s'\n", url.c_str());
    return 2;
  }
  lcm.subscribeFunction("POSE_ESTIMATE", &on_estimate, static_cast<void*>(nullptr));
  while (lcm.handle() == 0) {
  }
  return 0;  // the end of a log
}
